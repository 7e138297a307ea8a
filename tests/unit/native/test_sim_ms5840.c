#include "native/sim_ms5840.h"
#include "support/unit.h"

/* MS5837-02BA datasheet, page 7; the MS5840-02BA has the same first-order arithmetic. */
static const uint16_t EXAMPLE_C[6] = {46372, 43981, 29059, 27842, 31553, 28165};
enum { EXAMPLE_D1 = 6465444, EXAMPLE_D2 = 8077636 };

static struct sim_ms5840 sensor;
static unsigned measurements;

static uint32_t measure(void *context, int type, unsigned osr, uint64_t t_us) {
  (void)context, (void)osr, (void)t_us;
  measurements++;
  return type == 1 ? EXAMPLE_D1 : EXAMPLE_D2;
}

static bool command(uint8_t byte, uint64_t t_us) { return sim_ms5840_command(&sensor, byte, t_us, measure, NULL); }

static uint32_t read_adc(uint64_t t_us) {
  uint8_t bytes[3];
  TEST_ASSERT_TRUE(sim_ms5840_read(&sensor, 0x00, bytes, 3, t_us));
  return (uint32_t)bytes[0] << 16 | (uint32_t)bytes[1] << 8 | bytes[2];
}

void setUp(void) {
  measurements = 0;
  sim_ms5840_init(&sensor, EXAMPLE_C);
  TEST_ASSERT_TRUE(command(0x1E, 0));
}

/* The formulas are judged against the driver's, and those against the datasheet: unit.ms58xx, integration.fault_plan. */
TEST(test_the_inverse_meets_pressure_and_temperature) {
  for (double degC = -10; degC <= 60; degC += 2.5) {
    const uint32_t d2 = sim_ms5840_d2(sensor.prom, degC);
    TEST_ASSERT_DOUBLE_WITHIN(0.011, degC, sim_ms5840_temperature_degC(sensor.prom, d2));
    for (double Pa = 30000; Pa <= 200000; Pa += 17000) {
      const uint32_t d1 = sim_ms5840_d1(sensor.prom, Pa, d2);
      /* 1 Pa of the datasheet's rounding, and a code's 0.04 Pa. */
      TEST_ASSERT_DOUBLE_WITHIN(1.1, Pa, sim_ms5840_pressure_Pa(sensor.prom, d1, d2));
    }
  }
}

TEST(test_reset_reloads_for_2800_us) {
  uint8_t bytes[2];
  TEST_ASSERT_FALSE(sim_ms5840_read(&sensor, 0xA2, bytes, 2, SIM_MS5840_RESET_us - 1));
  TEST_ASSERT_FALSE(command(0x40, SIM_MS5840_RESET_us - 1));
  TEST_ASSERT_TRUE(sim_ms5840_read(&sensor, 0xA2, bytes, 2, SIM_MS5840_RESET_us));
  TEST_ASSERT_EQUAL_UINT16(EXAMPLE_C[0], bytes[0] << 8 | bytes[1]);
}

TEST(test_seven_prom_words_and_no_eighth) {
  uint8_t bytes[2];
  for (unsigned word = 0; word < 7; word++) {
    TEST_ASSERT_TRUE(sim_ms5840_read(&sensor, (uint8_t)(0xA0 + 2 * word), bytes, 2, 5000));
    TEST_ASSERT_EQUAL_UINT16(sensor.prom[word], bytes[0] << 8 | bytes[1]);
  }
  TEST_ASSERT_FALSE(sim_ms5840_read(&sensor, 0xAE, bytes, 2, 5000));
}

TEST(test_undefined_commands_are_refused) {
  const uint8_t undefined[] = {0x01, 0x1F, 0x41, 0x4C, 0x5E, 0x60, 0xFF};
  for (unsigned i = 0; i < sizeof undefined; i++) {
    TEST_ASSERT_FALSE(command(undefined[i], 5000));
  }
}

TEST(test_each_ratio_takes_the_datasheets_time) {
  const struct {
    unsigned osr;
    uint32_t us;
  } rows[] = {{256, 560}, {512, 1100}, {1024, 2170}, {2048, 4320}, {4096, 8610}, {8192, 17200}};
  uint64_t t_us = 5000;
  for (unsigned i = 0; i < 6; i++) {
    TEST_ASSERT_EQUAL_UINT32(rows[i].us, sim_ms5840_conversion_us(rows[i].osr));
    TEST_ASSERT_TRUE(command((uint8_t)(0x40 + 2 * i), t_us));
    t_us += rows[i].us;
    TEST_ASSERT_EQUAL_UINT32(EXAMPLE_D1, read_adc(t_us));
    TEST_ASSERT_TRUE(command((uint8_t)(0x50 + 2 * i), t_us));
    t_us += rows[i].us;
    TEST_ASSERT_EQUAL_UINT32(EXAMPLE_D2, read_adc(t_us));
    TEST_ASSERT_EQUAL_UINT32(0, read_adc(t_us)); /* once */
  }
}

TEST(test_an_early_read_is_0_and_spoils_the_conversion) {
  command(0x40, 5000);
  TEST_ASSERT_EQUAL_UINT32(0, read_adc(5559));
  const uint32_t spoiled = read_adc(5560);
  TEST_ASSERT_NOT_EQUAL_UINT32(0, spoiled);
  TEST_ASSERT_NOT_EQUAL_UINT32(EXAMPLE_D1, spoiled);
  command(0x40, 6000);
  TEST_ASSERT_EQUAL_UINT32(EXAMPLE_D1, read_adc(6560));
}

TEST(test_a_conversion_during_a_conversion_spoils_it) {
  command(0x40, 5000);
  TEST_ASSERT_TRUE(command(0x40, 5300));
  TEST_ASSERT_EQUAL_UINT(1, measurements);
  TEST_ASSERT_NOT_EQUAL_UINT32(EXAMPLE_D1, read_adc(5560));
}

TEST(test_a_reset_ends_a_conversion_without_a_result) {
  command(0x40, 5000);
  TEST_ASSERT_TRUE(command(0x1E, 5100));
  TEST_ASSERT_EQUAL_UINT32(0, read_adc(8000));
}

TEST(test_after_power_up_only_a_reset_helps) {
  uint8_t bytes[2];
  command(0x40, 5000);
  sim_ms5840_power_cycle(&sensor);
  TEST_ASSERT_EQUAL_UINT32(0, read_adc(6000));
  TEST_ASSERT_TRUE(command(0x40, 6000));
  TEST_ASSERT_EQUAL_UINT32(0, read_adc(7000));
  TEST_ASSERT_TRUE(sim_ms5840_read(&sensor, 0xA2, bytes, 2, 7000));
  TEST_ASSERT_EQUAL_UINT16(0, bytes[0] << 8 | bytes[1]);
  TEST_ASSERT_TRUE(command(0x1E, 7000));
  TEST_ASSERT_TRUE(command(0x40, 10000));
  TEST_ASSERT_EQUAL_UINT32(EXAMPLE_D1, read_adc(11000));
}
