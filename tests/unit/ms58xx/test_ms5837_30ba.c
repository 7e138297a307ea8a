/* The driver and the simulated sensor as an image for the MS5837-30BA has them. */
#include "ms58xx/ms58xx.h"
#include "native/sim_ms5840.h"
#include "support/unit.h"

#include <string.h>

/* Worked example of the MS5837-30BA datasheet: 10/2015, page 7, and rev. C2, page 11. */
static const uint16_t EXAMPLE_C[6] = {34982, 36352, 20328, 22354, 26646, 26146};
#define EXAMPLE_D1 4958179u
#define EXAMPLE_D2 6815414u
#define CODE_MAX 0xFFFFFFu

static struct ms58xx_prom prom;

void setUp(void) {
  prom.word[0] = 0x1A << 5; /* the product type of an MS5837-30BA26: rev. C2, page 9 */
  memcpy(&prom.word[1], EXAMPLE_C, sizeof EXAMPLE_C);
  prom.word[0] |= (uint16_t)(sim_ms5840_crc4(prom.word) << 12);
}
static int32_t pressure_Pa_q10(uint32_t d1, uint32_t d2, struct ms58xx_thermal *thermal) {
  ms58xx_compensate_temperature(&prom, d2, MS58XX_BRANCH_UNKNOWN, thermal);
  return ms58xx_compensate_pressure(thermal, d1);
}

TEST(test_worked_example) {
  struct ms58xx_thermal thermal;
  const int32_t q10 = pressure_Pa_q10(EXAMPLE_D1, EXAMPLE_D2, &thermal);
  TEST_ASSERT_EQUAL_INT32(-5962, thermal.dT);
  TEST_ASSERT_EQUAL_INT32(1981, thermal.first_order_cC);
  TEST_ASSERT_EQUAL_INT32(1981, thermal.temperature_cC);
  /* The example ends before the second order: 3 * 19^2 / 2 and 5 * 19^2 / 2^3 are subtracted. It
   * prints an OFF of 2381326464; its own C2, C4, dT and formula give 2381323464, and the same P. */
  TEST_ASSERT_EQUAL_INT64(2381323464 - 541, thermal.offset);
  TEST_ASSERT_EQUAL_INT64(1145816755 - 225, thermal.sensitivity);
  TEST_ASSERT_EQUAL_INT32(39998, q10 / 1024 / 10);
  TEST_ASSERT_EQUAL_DOUBLE(399980, sim_ms5840_pressure_Pa(prom.word, EXAMPLE_D1, EXAMPLE_D2));
  TEST_ASSERT_EQUAL_DOUBLE(19.81, sim_ms5840_temperature_degC(prom.word, EXAMPLE_D2));
}

TEST(test_prom) {
  TEST_ASSERT_EQUAL_INT(MS58XX_PROM_GOOD, ms58xx_check_prom(&prom));
  prom.word[3] ^= 0x0100;
  TEST_ASSERT_EQUAL_INT(MS58XX_PROM_CRC_DIFFERS, ms58xx_check_prom(&prom));
}

/* Two programs written apart: every branch, up to the end of the range. */
TEST(test_driver_and_simulated_sensor_agree) {
  unsigned branches[4] = {0};
  for (double degC = -39.0; degC <= 85.0; degC += 0.37) {
    const uint32_t d2 = sim_ms5840_d2(prom.word, degC);
    for (double Pa = 10000; Pa < MS58XX_MAX_PRESSURE_Pa; Pa *= 1.7) {
      const uint32_t d1 = sim_ms5840_d1(prom.word, Pa, d2);
      struct ms58xx_thermal thermal;
      const int32_t q10 = pressure_Pa_q10(d1, d2, &thermal);
      branches[thermal.branch]++;
      TEST_ASSERT_EQUAL_DOUBLE(sim_ms5840_temperature_degC(prom.word, d2), thermal.temperature_cC / 100.0);
      const double simulated_Pa = sim_ms5840_pressure_Pa(prom.word, d1, d2);
      TEST_ASSERT_TRUE(q10 >= simulated_Pa * 1024 && q10 < (simulated_Pa + 10) * 1024);
      TEST_ASSERT_DOUBLE_WITHIN(1.1, Pa, q10 / 1024.0);
    }
  }
  TEST_ASSERT_GREATER_THAN(100, branches[MS58XX_BRANCH_WARM]);
  TEST_ASSERT_GREATER_THAN(100, branches[MS58XX_BRANCH_COLD]);
  TEST_ASSERT_GREATER_THAN(100, branches[MS58XX_BRANCH_VERY_COLD]);
}

TEST(test_what_32_bits_do_not_hold_is_beyond_the_range) {
  struct ms58xx_thermal thermal;
  TEST_ASSERT_EQUAL_INT32(INT32_MAX, pressure_Pa_q10(CODE_MAX, EXAMPLE_D2, &thermal));
  TEST_ASSERT_GREATER_THAN_INT32(MS58XX_MAX_PRESSURE_Pa, INT32_MAX / 1024);
}

/* The firmware waits longer than the slowest sensor takes, and knows its noise. */
TEST(test_conversions) {
  for (unsigned osr = 256; osr <= 8192; osr *= 2) {
    const struct ms58xx_osr *row = ms58xx_find_osr((uint16_t)osr);
    TEST_ASSERT_EQUAL_UINT32(sim_ms5840_conversion_us(osr), row->maximum_us);
    TEST_ASSERT_EQUAL_UINT32(sim_ms5840_conversion_us(osr) * 105 / 100, row->conversion_us);
    TEST_ASSERT_EQUAL_INT32((int32_t)(sim_ms5840_noise_Pa(osr) * 1024), row->noise_Pa_q10);
    TEST_ASSERT_LESS_OR_EQUAL_INT32(MS58XX_NOISE_MAX_Pa * 1024, row->noise_Pa_q10);
  }
}
