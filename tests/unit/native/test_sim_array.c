#include "native/sim_array.h"

#include <math.h>
#include <string.h>

enum { SENSORS = 15, ALL = (1 << SENSORS) - 1 };
enum { RESET = 0x1E, CONVERT = 0x40, CONVERT_us = 600, READ_ADC = 0x00, READ_C1 = 0xA2 };

static struct sim_array array;
static uint64_t now_us;
#define NOW_us now_us
#include "support/bus_bench.h"

static void sleep_until(uint64_t wake_us) {
  const uint64_t event_us = sim_array_next_event_us(&array);
  now_us = event_us < wake_us ? event_us : wake_us;
}

static uint32_t code(unsigned k) {
  const uint8_t *bytes = result.bytes[k];
  return (uint32_t)bytes[0] << 16 | (uint32_t)bytes[1] << 8 | bytes[2];
}

static enum ft_status frame(void) {
  enum ft_status status = command(CONVERT);
  if (status != FT_OK) {
    return status;
  }
  now_us += CONVERT_us;
  return read_back(READ_ADC, 3);
}

static void expect_good_frame(void) {
  TEST_ASSERT_EQUAL_INT(FT_OK, frame());
  TEST_ASSERT_EQUAL_HEX32(ALL, result.acknowledged);
  for (unsigned k = 0; k < SENSORS; k++) {
    TEST_ASSERT_EQUAL_UINT32(1000000 + k, code(k));
  }
}

void setUp(void) {
  sim_array_init(&array, SENSORS, 1);
  bus = *sim_array_bus(&array);
  now_us = 0;
  for (unsigned k = 0; k < SENSORS; k++) {
    array.d1[k] = 1000000 + k;
  }
  TEST_ASSERT_EQUAL_INT(FT_OK, command(RESET));
  TEST_ASSERT_EQUAL_HEX32(ALL, result.acknowledged);
  now_us += SIM_MS5840_RESET_us;
}

static void strike(enum sim_fault_kind kind, uint32_t at, uint32_t count, uint8_t sensor) {
  array.fault = (struct sim_fault){.kind = kind, .transfer = array.transfers + at, .count = count, .mask = 0x800001, .sensor = sensor};
}

TEST(test_a_frame_and_its_bus_time) {
  const uint64_t start_us = now_us;
  expect_good_frame();
  TEST_ASSERT_EQUAL_UINT64(start_us + SIM_ARRAY_BROADCAST_us + CONVERT_us + SENSORS * SIM_ARRAY_READ_us, now_us);
  TEST_ASSERT_EQUAL_UINT32(1 + 1 + SENSORS, array.transfers);
  TEST_ASSERT_EQUAL_UINT32(0, array.early_reads);
}

TEST(test_no_sensor_has_the_same_code_twice_in_a_row) {
  memset(array.d1, 0, sizeof array.d1);
  for (uint32_t before = 0, n = 0; n < 5; n++, before = code(3)) {
    TEST_ASSERT_EQUAL_INT(FT_OK, frame());
    TEST_ASSERT_TRUE(code(3) != before && (n == 0 || code(3) - before + 1 <= 2));
  }
}

static double ramp_Pa(void *context, unsigned sensor, uint64_t t_us) {
  (void)context;
  return 100000.0 + 1000.0 * sensor + (double)t_us / 1000.0;
}

TEST(test_the_world_is_measured_in_the_middle_of_the_conversion) {
  memset(array.d1, 0, sizeof array.d1);
  array.world.pressure_Pa = ramp_Pa;
  TEST_ASSERT_EQUAL_INT(FT_OK, command(CONVERT));
  const uint64_t t_us = now_us + sim_ms5840_conversion_us(256) / 2;
  now_us += CONVERT_us;
  TEST_ASSERT_EQUAL_INT(FT_OK, read_back(READ_ADC, 3));
  for (unsigned k = 0; k < SENSORS; k++) {
    const uint16_t *prom = array.sensor[k].prom;
    const double Pa = sim_ms5840_pressure_Pa(prom, code(k), sim_ms5840_d2(prom, 25.0));
    TEST_ASSERT_DOUBLE_WITHIN(1.1, ramp_Pa(NULL, k, t_us), Pa);
  }
}

/* 3000 readings: the standard deviation is known to 1.3 % (1 sigma), the mean to 0.2 Pa. */
TEST(test_noise_is_the_datasheets) {
  memset(array.d1, 0, sizeof array.d1);
  array.noise = 1.0;
  double sum = 0, squares = 0;
  int readings = 0;
  for (int n = 0; n < 200; n++) {
    TEST_ASSERT_EQUAL_INT(FT_OK, frame());
    for (unsigned k = 0; k < SENSORS; k++, readings++) {
      const uint16_t *prom = array.sensor[k].prom;
      const double error_Pa = sim_ms5840_pressure_Pa(prom, code(k), sim_ms5840_d2(prom, 25.0)) + 0.5 - 101325.0;
      sum += error_Pa;
      squares += error_Pa * error_Pa;
    }
  }
  TEST_ASSERT_DOUBLE_WITHIN(0.8, 0.0, sum / readings);
  TEST_ASSERT_DOUBLE_WITHIN(0.05 * 11.0, 11.0, sqrt(squares / readings));
}

TEST(test_early_reads_are_seen) {
  TEST_ASSERT_EQUAL_INT(FT_OK, command(CONVERT));
  TEST_ASSERT_EQUAL_INT(FT_OK, read_back(READ_ADC, 3));
  /* The first three reads end within the 560 us of the conversion. */
  TEST_ASSERT_EQUAL_UINT32(2, array.early_reads);
  TEST_ASSERT_EQUAL_UINT32(0, code(0));
  TEST_ASSERT_EQUAL_UINT32(0, code(1));
  TEST_ASSERT_EQUAL_UINT32(1000002, code(2));
}

TEST(test_nack_of_a_command_and_of_a_read) {
  strike(SIM_FAULT_NACK, 1, 0, 0);
  TEST_ASSERT_EQUAL_INT(FT_OK, command(CONVERT));
  TEST_ASSERT_EQUAL_HEX32(0, result.acknowledged);
  TEST_ASSERT_EQUAL_UINT32(1, result.nacks);
  now_us += CONVERT_us;
  strike(SIM_FAULT_NACK, 3, 0, 0);
  TEST_ASSERT_EQUAL_INT(FT_OK, read_back(READ_ADC, 3));
  TEST_ASSERT_EQUAL_HEX32(ALL & ~(1u << 2), result.acknowledged);
  for (unsigned k = 0; k < SENSORS; k++) {
    TEST_ASSERT_TRUE(k == 2 || code(k) == 0);
  }
  expect_good_frame();
}

TEST(test_a_dead_sensor_comes_back_after_its_transfers) {
  strike(SIM_FAULT_DEAD, 1, 3, 7);
  for (int n = 0; n < 2; n++) {
    TEST_ASSERT_EQUAL_INT(FT_OK, frame());
    TEST_ASSERT_EQUAL_HEX32(n == 0 ? ALL & ~(1u << 7) : ALL, result.acknowledged);
    TEST_ASSERT_TRUE(n == 0 || code(7) == 0);
  }
  expect_good_frame();
}

TEST(test_spoilt_bytes) {
  const struct {
    enum sim_fault_kind kind;
    uint32_t code;
  } cases[] = {{SIM_FAULT_FLIP, 1000006 ^ 0x800001}, {SIM_FAULT_ZERO, 0}, {SIM_FAULT_ONES, 0xFFFFFF}};
  for (unsigned i = 0; i < 3; i++) {
    strike(cases[i].kind, 1 + 7, 0, 0);
    TEST_ASSERT_EQUAL_INT(FT_OK, frame());
    for (unsigned k = 0; k < SENSORS; k++) {
      TEST_ASSERT_EQUAL_UINT32(k == 6 ? cases[i].code : 1000000 + k, code(k));
    }
  }
}

TEST(test_a_power_cycle_needs_a_reset) {
  strike(SIM_FAULT_POWER_CYCLE, 1 + 3, 0, 0);
  for (int n = 0; n < 2; n++) {
    TEST_ASSERT_EQUAL_INT(FT_OK, frame());
    TEST_ASSERT_EQUAL_UINT32(0, code(2));
    TEST_ASSERT_EQUAL_UINT32(1000003, code(3));
  }
  TEST_ASSERT_EQUAL_INT(FT_OK, command(RESET));
  now_us += SIM_MS5840_RESET_us;
  expect_good_frame();
}

TEST(test_a_timeout_needs_a_recovery) {
  for (uint32_t at = 1; at <= 1 + SENSORS; at++) {
    strike(SIM_FAULT_TIMEOUT, at, 0, 0);
    const uint64_t start_us = now_us;
    TEST_ASSERT_EQUAL_INT(FT_ERR_TIMEOUT, frame());
    TEST_ASSERT_LESS_THAN_UINT64(start_us + 5000, now_us);
    TEST_ASSERT_EQUAL_INT(FT_ERR_TIMEOUT, command(CONVERT));
    TEST_ASSERT_EQUAL_INT(FT_OK, recover());
    now_us += CONVERT_us;
    expect_good_frame();
  }
}

TEST(test_a_stuck_bus_needs_several_recoveries) {
  strike(SIM_FAULT_STUCK, 5, 3, 0);
  TEST_ASSERT_EQUAL_INT(FT_ERR_TIMEOUT, frame());
  for (int n = 0; n < 3; n++) {
    TEST_ASSERT_EQUAL_INT(FT_ERR_STUCK, recover());
  }
  TEST_ASSERT_EQUAL_INT(FT_OK, recover());
  expect_good_frame();
}

/* What a sensor converts when the chip is reset it has at the same moment as without. */
TEST(test_a_restart_of_the_bus_leaves_the_sensors_at_work) {
  TEST_ASSERT_EQUAL_INT(FT_OK, command(CONVERT));
  TEST_ASSERT_EQUAL_INT(FT_OK, bus.start_read(bus.context, READ_C1, 2, now_us));
  const uint64_t elapsed_us = now_us;
  sim_array_restart_bus(&array, elapsed_us);
  now_us = CONVERT_us;
  TEST_ASSERT_EQUAL_INT(FT_OK, read_back(READ_ADC, 3));
  TEST_ASSERT_EQUAL_HEX32(ALL, result.acknowledged);
  TEST_ASSERT_EQUAL_UINT32(0, array.early_reads);
  TEST_ASSERT_NOT_EQUAL_UINT32(0, code(3));
  expect_good_frame();
}
