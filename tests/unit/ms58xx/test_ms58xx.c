#include "ms58xx/ms58xx.h"
#include "support/random.h"
#include "support/unit.h"

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#define CODE_MAX 0xFFFFFFu

/* Worked example of the MS5837-02BA datasheet, page 7: the same first-order arithmetic. */
static const struct ms58xx_prom example = {{0, 46372, 43981, 29059, 27842, 31553, 28165}};
#define EXAMPLE_D1 6465444u
#define EXAMPLE_D2 8077636u

/* The PROM of a real MS5840 as a driver's author published it. */
static const struct ms58xx_prom real_part = {{26785, 41335, 41466, 26840, 27317, 31225, 28780}};

/* The datasheet's formulas once more, with divisions that round down and integers that hold everything. */
typedef __int128 wide;

static wide divide(wide a, wide b) {
  wide quotient = a / b;
  return a % b != 0 && (a < 0) != (b < 0) ? quotient - 1 : quotient;
}

struct reference {
  int64_t dT, first_order_cC, temperature_cC, offset, sensitivity;
  int64_t pressure_Pa, pressure_Pa_q10;
};

static struct reference datasheet(const struct ms58xx_prom *prom, uint32_t d1, uint32_t d2, enum ms58xx_branch branch) {
  const uint16_t *c = prom->word;
  wide dT = (wide)d2 - (wide)c[5] * 256;
  wide temperature = 2000 + divide(dT * c[6], 8388608);
  wide offset = (wide)c[2] * 131072 + divide((wide)c[4] * dT, 64);
  wide sensitivity = (wide)c[1] * 65536 + divide((wide)c[3] * dT, 128);
  struct reference is = {.dT = (int64_t)dT, .first_order_cC = (int64_t)temperature};
  wide below = temperature - 2000;
  if (branch == MS58XX_BRANCH_UNKNOWN) {
    branch = temperature >= 2000 ? MS58XX_BRANCH_WARM : temperature >= 1000 ? MS58XX_BRANCH_COLD : MS58XX_BRANCH_VERY_COLD;
  }
  if (branch == MS58XX_BRANCH_COLD) {
    temperature -= divide(12 * dT * dT, (wide)1 << 35);
    offset -= divide(30 * below * below, 256);
  } else if (branch == MS58XX_BRANCH_VERY_COLD) {
    temperature -= divide(14 * dT * dT, (wide)1 << 35);
    offset -= divide(35 * below * below, 8);
    sensitivity -= divide(63 * below * below, 32);
  }
  wide numerator = divide((wide)d1 * sensitivity, 2097152) - offset;
  is.temperature_cC = (int64_t)temperature;
  is.offset = (int64_t)offset;
  is.sensitivity = (int64_t)sensitivity;
  is.pressure_Pa = (int64_t)divide(numerator, 32768);
  is.pressure_Pa_q10 = (int64_t)divide(numerator, 32);
  return is;
}

static int32_t saturated(int64_t value) { return value > INT32_MAX ? INT32_MAX : value < INT32_MIN ? INT32_MIN : (int32_t)value; }

static void assert_equals_datasheet(const struct ms58xx_prom *prom, uint32_t d1, uint32_t d2, enum ms58xx_branch previous) {
  struct ms58xx_thermal thermal;
  ms58xx_compensate_temperature(prom, d2, previous, &thermal);
  struct reference is = datasheet(prom, d1, d2, thermal.branch);
  TEST_ASSERT_EQUAL_INT64(is.dT, thermal.dT);
  TEST_ASSERT_EQUAL_INT64(is.first_order_cC, thermal.first_order_cC);
  TEST_ASSERT_EQUAL_INT(ms58xx_branch_of(previous, (int32_t)is.first_order_cC), thermal.branch);
  TEST_ASSERT_EQUAL_INT64(is.temperature_cC, thermal.temperature_cC);
  TEST_ASSERT_EQUAL_INT64(is.offset, thermal.offset);
  TEST_ASSERT_EQUAL_INT64(is.sensitivity, thermal.sensitivity);
  TEST_ASSERT_EQUAL_INT32(saturated(is.pressure_Pa_q10), ms58xx_compensate_pressure(&thermal, d1));
}

/* The smallest code whose first-order temperature is the given one. */
static uint32_t code_of_temperature(const struct ms58xx_prom *prom, int32_t temperature_cC) {
  wide dT = -divide(-(wide)(temperature_cC - 2000) * 8388608, prom->word[6]);
  return (uint32_t)(dT + (wide)prom->word[5] * 256);
}

static int32_t pressure_Pa_q10(const struct ms58xx_prom *prom, uint32_t d1, uint32_t d2, enum ms58xx_branch previous) {
  struct ms58xx_thermal thermal;
  ms58xx_compensate_temperature(prom, d2, previous, &thermal);
  return ms58xx_compensate_pressure(&thermal, d1);
}

TEST(test_osr_table) {
  static const struct {
    uint16_t osr;
    uint32_t longest_us, noise_mPa;
  } rows[] = {{256, 560, 11000}, {512, 1100, 6200}, {1024, 2170, 3900}, {2048, 4320, 2800}, {4096, 8610, 2100}, {8192, 17200, 1600}};
  for (uint8_t i = 0; i < 6; i++) {
    const struct ms58xx_osr *row = ms58xx_find_osr(rows[i].osr);
    TEST_ASSERT_NOT_NULL(row);
    TEST_ASSERT_EQUAL_UINT16(rows[i].osr, row->osr);
    TEST_ASSERT_EQUAL_HEX8(0x40 + 2 * i, row->convert_pressure);
    TEST_ASSERT_EQUAL_HEX8(0x50 + 2 * i, row->convert_temperature);
    TEST_ASSERT_UINT32_WITHIN(1, rows[i].longest_us * 105 / 100, row->conversion_us);
    TEST_ASSERT_INT32_WITHIN(1, rows[i].noise_mPa * 1024 / 1000, row->noise_Pa_q10);
  }
}

TEST(test_crc_of_an520) {
  static const uint8_t bytes[16] = {0x31, 0x32, 0x33, 0x34, 0x35, 0x36, 0x37, 0x38, 0x39, 0x40, 0x41, 0x42, 0x43, 0x44, 0x45, 0x00};
  TEST_ASSERT_EQUAL_HEX8(0xB, ms58xx_crc4_bytes(bytes));
}

TEST(test_real_prom_with_differing_nibble) {
  TEST_ASSERT_EQUAL_HEX8(6, real_part.word[0] >> 12);
  TEST_ASSERT_EQUAL_HEX8(5, ms58xx_prom_crc4(&real_part));
  TEST_ASSERT_EQUAL_INT(MS58XX_PROM_CRC_DIFFERS, ms58xx_check_prom(&real_part));
  struct ms58xx_prom mended = real_part;
  mended.word[0] = (uint16_t)((mended.word[0] & 0x0FFF) | 0x5000);
  TEST_ASSERT_EQUAL_INT(MS58XX_PROM_GOOD, ms58xx_check_prom(&mended));
}

TEST(test_all_sixteen_crcs_occur_and_are_accepted) {
  uint32_t seen = 0;
  for (uint32_t value = 0; value < 4096; value++) {
    struct ms58xx_prom prom = example;
    prom.word[6] = (uint16_t)(28165 + value);
    uint8_t crc = ms58xx_prom_crc4(&prom);
    TEST_ASSERT_LESS_THAN_UINT8(16, crc);
    seen |= 1u << crc;
    for (uint16_t nibble = 0; nibble < 16; nibble++) {
      prom.word[0] = (uint16_t)(nibble << 12 | (example.word[0] & 0x0FFF));
      const struct ms58xx_prom before = prom;
      TEST_ASSERT_EQUAL_HEX8(crc, ms58xx_prom_crc4(&prom));
      TEST_ASSERT_EQUAL_INT(nibble == crc ? MS58XX_PROM_GOOD : MS58XX_PROM_CRC_DIFFERS, ms58xx_check_prom(&prom));
      TEST_ASSERT_EQUAL_MEMORY(&before, &prom, sizeof prom);
    }
  }
  TEST_ASSERT_EQUAL_HEX32(0xFFFF, seen);
}

TEST(test_crc_sees_every_flipped_bit) {
  struct ms58xx_prom prom = example;
  prom.word[0] = (uint16_t)(ms58xx_prom_crc4(&example) << 12);
  TEST_ASSERT_EQUAL_INT(MS58XX_PROM_GOOD, ms58xx_check_prom(&prom));
  for (int bit = 0; bit < 16 * MS58XX_PROM_WORDS; bit++) {
    struct ms58xx_prom flipped = prom;
    flipped.word[bit / 16] ^= (uint16_t)(1u << bit % 16);
    TEST_ASSERT_EQUAL_INT(MS58XX_PROM_CRC_DIFFERS, ms58xx_check_prom(&flipped));
  }
}

TEST(test_blank_proms) {
  struct ms58xx_prom prom = {{0}};
  TEST_ASSERT_EQUAL_HEX8(0, ms58xx_prom_crc4(&prom)); /* the CRC alone would accept it */
  TEST_ASSERT_EQUAL_INT(MS58XX_PROM_BLANK, ms58xx_check_prom(&prom));
  memset(&prom, 0xFF, sizeof prom);
  TEST_ASSERT_EQUAL_INT(MS58XX_PROM_BLANK, ms58xx_check_prom(&prom));
  for (int word = 0; word < MS58XX_PROM_WORDS; word++) {
    static const uint16_t values[] = {0, 1, 0xFFFE, 0xFFFF};
    for (int i = 0; i < 4; i++) {
      prom = example;
      prom.word[word] = values[i];
      bool blank = word > 0 && (i == 0 || i == 3);
      prom.word[0] = (uint16_t)((prom.word[0] & 0x0FFF) | ms58xx_prom_crc4(&prom) << 12);
      TEST_ASSERT_EQUAL_INT(blank ? MS58XX_PROM_BLANK : MS58XX_PROM_GOOD, ms58xx_check_prom(&prom));
    }
  }
}

TEST(test_worked_example) {
  struct ms58xx_thermal thermal;
  ms58xx_compensate_temperature(&example, EXAMPLE_D2, MS58XX_BRANCH_UNKNOWN, &thermal);
  TEST_ASSERT_EQUAL_INT32(68, thermal.dT);
  TEST_ASSERT_EQUAL_INT32(2000, thermal.first_order_cC);
  TEST_ASSERT_EQUAL_INT32(2000, thermal.temperature_cC);
  TEST_ASSERT_EQUAL_INT64(5764707214, thermal.offset);
  TEST_ASSERT_EQUAL_INT64(3039050829, thermal.sensitivity);
  TEST_ASSERT_EQUAL_INT32(110002, ms58xx_compensate_pressure(&thermal, EXAMPLE_D1) >> 10);
}

TEST(test_reading_of_the_real_part) {
  struct ms58xx_thermal thermal;
  ms58xx_compensate_temperature(&real_part, 8073757, MS58XX_BRANCH_UNKNOWN, &thermal);
  TEST_ASSERT_EQUAL_INT32(2275, thermal.temperature_cC);
  TEST_ASSERT_EQUAL_INT32(100241, ms58xx_compensate_pressure(&thermal, 6735203) >> 10);
}

TEST(test_both_sides_of_every_edge) {
  static const struct {
    int32_t temperature_cC;
    enum ms58xx_branch branch;
  } edges[] = {{2001, MS58XX_BRANCH_WARM},     {2000, MS58XX_BRANCH_WARM},       {1999, MS58XX_BRANCH_COLD},
               {1001, MS58XX_BRANCH_COLD},     {1000, MS58XX_BRANCH_COLD},       {999, MS58XX_BRANCH_VERY_COLD},
               {500, MS58XX_BRANCH_VERY_COLD}, {-2000, MS58XX_BRANCH_VERY_COLD}, {8500, MS58XX_BRANCH_WARM}};
  const struct ms58xx_prom *proms[] = {&example, &real_part};
  for (size_t part = 0; part < 2; part++) {
    for (size_t i = 0; i < sizeof edges / sizeof edges[0]; i++) {
      uint32_t d2 = code_of_temperature(proms[part], edges[i].temperature_cC);
      struct ms58xx_thermal thermal;
      ms58xx_compensate_temperature(proms[part], d2, MS58XX_BRANCH_UNKNOWN, &thermal);
      TEST_ASSERT_EQUAL_INT32(edges[i].temperature_cC, thermal.first_order_cC);
      TEST_ASSERT_EQUAL_INT(edges[i].branch, thermal.branch);
      for (int previous = MS58XX_BRANCH_UNKNOWN; previous <= MS58XX_BRANCH_VERY_COLD; previous++) {
        assert_equals_datasheet(proms[part], EXAMPLE_D1, d2, (enum ms58xx_branch)previous);
      }
    }
  }
}

TEST(test_branch_hysteresis) {
  enum { W = MS58XX_BRANCH_WARM, C = MS58XX_BRANCH_COLD, V = MS58XX_BRANCH_VERY_COLD };
  static const struct {
    int previous;
    int32_t temperature_cC;
    int next;
  } cases[] = {
      {W, 2000, W}, {W, 1999, W}, {W, 1970, W}, {W, 1969, C}, {W, 1000, C}, {W, 999, V},  {C, 1999, C}, {C, 2000, C},
      {C, 2029, C}, {C, 2030, W}, {C, 1000, C}, {C, 970, C},  {C, 969, V},  {V, 999, V},  {V, 1000, V}, {V, 1029, V},
      {V, 1030, C}, {V, 1999, C}, {V, 2000, W}, {0, 2000, W}, {0, 1999, C}, {0, 1000, C}, {0, 999, V},
  };
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    TEST_ASSERT_EQUAL_INT(cases[i].next, ms58xx_branch_of((enum ms58xx_branch)cases[i].previous, cases[i].temperature_cC));
  }
  /* A ramp down and up again changes the branch four times, each beyond its edge. */
  static const int32_t changes_cC[] = {1969, 969, 1030, 2030};
  size_t changes = 0;
  enum ms58xx_branch branch = MS58XX_BRANCH_WARM;
  for (int32_t step = -2500; step <= 2500; step++) {
    int32_t temperature_cC = step < 0 ? -step : step;
    enum ms58xx_branch next = ms58xx_branch_of(branch, temperature_cC);
    if (next != branch) {
      TEST_ASSERT_LESS_THAN_size_t(4, changes);
      TEST_ASSERT_EQUAL_INT32(changes_cC[changes], temperature_cC);
      changes++;
      branch = next;
    }
  }
  TEST_ASSERT_EQUAL_size_t(4, changes);
}

/* The rule itself steps by some -60 Pa at 10 degC and 1.08 bar; a latched branch does not. */
TEST(test_step_at_ten_degrees_is_not_crossed_by_noise) {
  uint32_t at_edge = code_of_temperature(&example, 1000);
  uint32_t just_below = at_edge - 1;
  uint32_t d1 = EXAMPLE_D1;
  while (pressure_Pa_q10(&example, d1, at_edge, MS58XX_BRANCH_UNKNOWN) >> 10 > 108000) {
    d1 -= 16;
  }
  int32_t step_Pa_q10 =
      pressure_Pa_q10(&example, d1, just_below, MS58XX_BRANCH_UNKNOWN) - pressure_Pa_q10(&example, d1, at_edge, MS58XX_BRANCH_UNKNOWN);
  TEST_ASSERT_INT32_WITHIN(10 * 1024, -60 * 1024, step_Pa_q10);

  for (int start = MS58XX_BRANCH_COLD; start <= MS58XX_BRANCH_VERY_COLD; start++) {
    struct random random = {4};
    struct ms58xx_thermal thermal;
    ms58xx_compensate_temperature(&example, at_edge, (enum ms58xx_branch)start, &thermal);
    int32_t low = INT32_MAX;
    int32_t high = INT32_MIN;
    for (int i = 0; i < 10000; i++) {
      uint32_t d2 = at_edge - 600 + random_below(&random, 1201); /* +-0.02 degC */
      ms58xx_compensate_temperature(&example, d2, thermal.branch, &thermal);
      TEST_ASSERT_EQUAL_INT(start, thermal.branch);
      int32_t now = ms58xx_compensate_pressure(&thermal, d1);
      low = now < low ? now : low;
      high = now > high ? now : high;
    }
    TEST_ASSERT_LESS_THAN_INT32(12 * 1024, high - low); /* what the temperature itself explains */
  }
}

TEST(test_extremes_saturate) {
  static const uint16_t words[] = {0, UINT16_MAX, 28165};
  static const uint32_t codes[] = {0, CODE_MAX, EXAMPLE_D1, EXAMPLE_D2, 1};
  for (int combination = 0; combination < 729; combination++) {
    struct ms58xx_prom prom = {{0}};
    for (int i = 1, rest = combination; i <= 6; i++, rest /= 3) {
      prom.word[i] = words[rest % 3];
    }
    for (int codes_at = 0; codes_at < 25; codes_at++) {
      for (int previous = MS58XX_BRANCH_UNKNOWN; previous <= MS58XX_BRANCH_VERY_COLD; previous++) {
        assert_equals_datasheet(&prom, codes[codes_at % 5], codes[codes_at / 5], (enum ms58xx_branch)previous);
      }
    }
  }
  /* No offset and the greatest sensitivity with the greatest code read 4 MPa and more: beyond an int32 of 1/1024 Pa. */
  const struct ms58xx_prom highest = {{0, UINT16_MAX, 0, UINT16_MAX, 0, 0, 0}};
  TEST_ASSERT_EQUAL_INT32(INT32_MAX, pressure_Pa_q10(&highest, CODE_MAX, CODE_MAX, MS58XX_BRANCH_UNKNOWN));
  const struct ms58xx_prom lowest = {{0, 0, UINT16_MAX, UINT16_MAX, 0, UINT16_MAX, 0}};
  TEST_ASSERT_EQUAL_INT32(INT32_MIN, pressure_Pa_q10(&lowest, CODE_MAX, 0, MS58XX_BRANCH_UNKNOWN));
}

TEST(test_q10_holds_the_datasheets_integer) {
  struct random random = {5};
  int plausible = 0;
  for (int i = 0; i < 100000; i++) {
    struct ms58xx_prom prom = example;
    for (int word = 1; word <= 6; word++) {
      /* Half of the parts near the example, half anything. */
      prom.word[word] = i % 2 ? (uint16_t)random_u32(&random) : (uint16_t)(prom.word[word] - 2000 + random_below(&random, 4001));
    }
    uint32_t d1 = random_below(&random, CODE_MAX + 1);
    uint32_t d2 = i % 2 ? random_below(&random, CODE_MAX + 1) : EXAMPLE_D2 - 1000000 + random_below(&random, 2000001);
    struct reference is = datasheet(&prom, d1, d2, MS58XX_BRANCH_UNKNOWN);
    int32_t q10 = pressure_Pa_q10(&prom, d1, d2, MS58XX_BRANCH_UNKNOWN);
    TEST_ASSERT_EQUAL_INT32(saturated(is.pressure_Pa_q10), q10);
    if (is.pressure_Pa_q10 == q10) {
      TEST_ASSERT_EQUAL_INT64(is.pressure_Pa, q10 >> 10);
      plausible++;
    }
  }
  TEST_ASSERT_GREATER_THAN_INT(90000, plausible);
}
