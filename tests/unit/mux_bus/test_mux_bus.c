#include "fake_i2c.h"
#include "pico_mux/mux_bus.h"
#define NOW_us fake.now_us
#include "support/bus_bench.h"

#include <string.h>

#define ALL_SENSORS 0x7FFFu
#define STRIP(mux) (0x1Fu << 5 * (mux))
#define CONVERSION_us 600u
#define CONVERT 0x40
#define READ_ADC 0x00

enum { COMMAND_TRANSACTIONS = 4, READ_TRANSACTIONS = 31, OPEN_TRANSACTIONS = 3 };
enum { RECOVERY_us = 24 * 5 };
enum { FRAME_TRANSACTIONS = COMMAND_TRANSACTIONS + READ_TRANSACTIONS };

static struct mux_bus mux_bus;

void setUp(void) {
  fake_i2c_power_up();
  memset(&result, 0xA5, sizeof result);
  TEST_ASSERT_EQUAL_INT(FT_OK, mux_bus_init(&mux_bus, &bus));
}

void tearDown(void) {
  TEST_ASSERT_EQUAL_UINT(0, fake.misuses);
  TEST_ASSERT_EQUAL_UINT(0, fake.collisions);
}

/* For the cases of one test: checks the last one and powers up for the next. */
static void next_case(void) {
  tearDown();
  setUp();
}

static uint64_t earlier(uint64_t a, uint64_t b) { return a < b ? a : b; }

static void sleep_until(uint64_t wake_us) {
  const unsigned events = fake.events;
  while (fake.events == events && fake.now_us < wake_us) {
    fake.now_us = earlier(wake_us, fake_i2c_next_event_us());
    if (fake.now_us == fake_i2c_next_event_us()) {
      fake_i2c_interrupt();
    }
  }
}

static void wait_for_conversion(void) {
  TEST_ASSERT_EQUAL_UINT64(UINT64_MAX, fake_i2c_next_event_us());
  fake.now_us += CONVERSION_us;
}

static enum ft_status frame(void) {
  const enum ft_status status = command(CONVERT);
  if (status != FT_OK) {
    return status;
  }
  wait_for_conversion();
  return read_back(READ_ADC, 3);
}

static void expect_readings(sensor_map sensors) {
  TEST_ASSERT_EQUAL_HEX32(sensors, result.acknowledged);
  for (unsigned k = 0; k < BOARD_SENSOR_COUNT; k++) {
    for (unsigned i = 0; (sensors >> k & 1) != 0 && i < 3; i++) {
      TEST_ASSERT_EQUAL_HEX8(fake_byte(k, READ_ADC, i), result.bytes[k][i]);
    }
  }
}

static void expect_good_frame(void) {
  TEST_ASSERT_EQUAL_INT(FT_OK, frame());
  expect_readings(ALL_SENSORS);
}

TEST(test_a_command_reaches_all_sensors_in_one_write) {
  for (uint8_t byte = 1; byte < 5; byte++) {
    TEST_ASSERT_EQUAL_INT(FT_OK, command(byte));
    TEST_ASSERT_EQUAL_HEX32(ALL_SENSORS, result.acknowledged);
    TEST_ASSERT_EQUAL_UINT(0, result.nacks);
    TEST_ASSERT_EQUAL_HEX32(ALL_SENSORS, fake.command_reached);
    TEST_ASSERT_EQUAL_HEX8(byte, fake.last_command);
    TEST_ASSERT_EQUAL_UINT(3, fake.selects); /* they stay open */
    TEST_ASSERT_EQUAL_UINT(byte, fake.commands);
  }
}

TEST(test_transactions_and_bus_time_of_a_frame) {
  for (int n = 0; n < 3; n++) {
    const unsigned before = fake.transactions;
    const uint64_t start_us = fake.now_us;
    TEST_ASSERT_EQUAL_INT(FT_OK, command(CONVERT));
    TEST_ASSERT_EQUAL_UINT64(start_us + COMMAND_TRANSACTIONS * I2C_WRITE_us, fake.now_us);
    wait_for_conversion();
    TEST_ASSERT_EQUAL_UINT(COMMAND_TRANSACTIONS, fake.transactions - before);
    const uint64_t read_us = fake.now_us;
    polls = 0;
    TEST_ASSERT_EQUAL_INT(FT_OK, read_back(READ_ADC, 3));
    expect_readings(ALL_SENSORS);
    TEST_ASSERT_EQUAL_UINT(0, result.nacks);
    TEST_ASSERT_EQUAL_UINT(FRAME_TRANSACTIONS, fake.transactions - before);
    TEST_ASSERT_EQUAL_UINT64(read_us + 16 * I2C_WRITE_us + 15 * I2C_READ_us(3), fake.now_us);
    TEST_ASSERT_LESS_OR_EQUAL_UINT(5, polls); /* interrupts do the work in between */
  }
}

TEST(test_reads_of_every_length_without_a_command) {
  for (uint8_t count = 1; count <= ARRAY_BUS_MAX_READ_BYTES; count++) {
    TEST_ASSERT_EQUAL_INT(FT_OK, read_back(0xA2, count));
    TEST_ASSERT_EQUAL_HEX32(ALL_SENSORS, result.acknowledged);
    for (unsigned k = 0; k < BOARD_SENSOR_COUNT; k++) {
      TEST_ASSERT_EQUAL_HEX8(fake_byte(k, 0xA2, count - 1u), result.bytes[k][count - 1]);
    }
  }
}

TEST(test_a_controller_that_is_slow_to_become_idle_is_asked_again) {
  fake.busy_polls = 3;
  expect_good_frame();
}

TEST(test_a_missing_multiplexer_costs_its_own_sensors_only) {
  for (unsigned mux = 0; mux < BOARD_MUX_COUNT; mux++) {
    next_case();
    fake.mux_missing[mux] = true;
    for (int n = 0; n < 3; n++) {
      TEST_ASSERT_EQUAL_INT(FT_OK, command(CONVERT));
      TEST_ASSERT_EQUAL_HEX32(ALL_SENSORS & ~STRIP(mux), result.acknowledged);
      TEST_ASSERT_EQUAL_HEX32(ALL_SENSORS & ~STRIP(mux), fake.command_reached);
      uint32_t nacks = result.nacks;
      wait_for_conversion();
      TEST_ASSERT_EQUAL_INT(FT_OK, read_back(READ_ADC, 3));
      expect_readings(ALL_SENSORS & ~STRIP(mux));
      nacks += result.nacks;
      /* Asked once for the command and once for the read. */
      TEST_ASSERT_EQUAL_UINT32(2, nacks);
    }
    fake.mux_missing[mux] = false;
    expect_good_frame();
    TEST_ASSERT_EQUAL_UINT32(0, result.nacks);
  }
}

TEST(test_without_any_multiplexer_nobody_acknowledges) {
  memset(fake.mux_missing, true, sizeof fake.mux_missing);
  TEST_ASSERT_EQUAL_INT(FT_OK, command(CONVERT));
  TEST_ASSERT_EQUAL_HEX32(0, result.acknowledged);
  TEST_ASSERT_EQUAL_UINT32(3, result.nacks);
  TEST_ASSERT_EQUAL_INT(FT_OK, read_back(READ_ADC, 3));
  TEST_ASSERT_EQUAL_HEX32(0, result.acknowledged);
  TEST_ASSERT_EQUAL_UINT32(3, result.nacks);
}

TEST(test_a_missing_sensor_shows_when_it_is_read) {
  for (unsigned k = 0; k < BOARD_SENSOR_COUNT; k++) {
    next_case();
    fake.sensor_missing[k] = true;
    TEST_ASSERT_EQUAL_INT(FT_OK, command(CONVERT));
    TEST_ASSERT_EQUAL_HEX32(ALL_SENSORS, result.acknowledged);
    wait_for_conversion();
    TEST_ASSERT_EQUAL_INT(FT_OK, read_back(READ_ADC, 3));
    expect_readings(ALL_SENSORS & ~(1u << k));
    TEST_ASSERT_EQUAL_UINT32(1, result.nacks);
  }
}

TEST(test_without_any_sensor_the_command_is_refused) {
  memset(fake.sensor_missing, true, sizeof fake.sensor_missing);
  TEST_ASSERT_EQUAL_INT(FT_OK, command(CONVERT));
  TEST_ASSERT_EQUAL_HEX32(0, result.acknowledged);
  TEST_ASSERT_EQUAL_UINT32(1, result.nacks);
}

/* tearDown checks the point of missed selections: open channels never answer for another strip. */
TEST(test_what_is_missed_once_is_repeated) {
  for (unsigned at = 1; at <= 2 * FRAME_TRANSACTIONS; at++) {
    next_case();
    expect_good_frame();
    const unsigned selects = fake.selects, reads = fake.reads;
    *(at % 2 ? &fake.nack_select_at : &fake.nack_read_at) = fake.transactions + (at + 1) / 2;
    expect_good_frame();
    TEST_ASSERT_LESS_OR_EQUAL_UINT(selects + COMMAND_TRANSACTIONS - 1 + READ_TRANSACTIONS, fake.selects);
    if (at % 2 == 0) {
      TEST_ASSERT_EQUAL_UINT32(fake.reads - reads - BOARD_SENSOR_COUNT, result.nacks);
    }
    expect_good_frame();
  }
}

/* Asked twice in the frame in which it fell silent, and once in every other. */
TEST(test_a_sensor_that_is_gone_takes_no_time) {
  expect_good_frame();
  fake.sensor_missing[7] = true;
  for (uint32_t asked = 2; asked > 0; asked--) {
    TEST_ASSERT_EQUAL_INT(FT_OK, frame());
    expect_readings(ALL_SENSORS & ~(1u << 7));
    TEST_ASSERT_EQUAL_UINT32(asked, result.nacks);
  }
  TEST_ASSERT_EQUAL_INT(FT_OK, frame());
  TEST_ASSERT_EQUAL_UINT32(1, result.nacks);
  fake.sensor_missing[7] = false;
  expect_good_frame();
}

TEST(test_a_transaction_that_fails_at_every_place) {
  for (unsigned at = 1; at <= 2 * FRAME_TRANSACTIONS; at++) {
    next_case();
    expect_good_frame();
    *(at % 2 ? &fake.hang_at : &fake.arbitration_lost_at) = fake.transactions + (at + 1) / 2;
    const uint64_t start_us = fake.now_us;
    TEST_ASSERT_EQUAL_INT(FT_ERR_TIMEOUT, frame());
    TEST_ASSERT_LESS_THAN_UINT64(start_us + 5000, fake.now_us);
    TEST_ASSERT_EQUAL_INT(FT_OK, recover());
    expect_good_frame();
  }
}

/* Without interrupts the alarms alone carry an operation through. */
TEST(test_lost_interrupts_only_cost_time) {
  TEST_ASSERT_EQUAL_INT(FT_OK, command(CONVERT));
  wait_for_conversion();
  TEST_ASSERT_EQUAL_INT(FT_OK, bus.start_read(bus.context, READ_ADC, 3, fake.now_us));
  enum ft_status status = FT_PENDING;
  for (int wake = 0; status == FT_PENDING; wake++) {
    TEST_ASSERT_LESS_THAN_INT(READ_TRANSACTIONS + 2, wake);
    status = bus.poll(bus.context, fake.now_us, &result, &fake.now_us);
  }
  TEST_ASSERT_EQUAL_INT(FT_OK, status);
  expect_readings(ALL_SENSORS);
}

TEST(test_a_failed_bus_is_left_alone_until_recovery) {
  fake.hang_at = 2;
  TEST_ASSERT_EQUAL_INT(FT_ERR_TIMEOUT, command(CONVERT));
  TEST_ASSERT_EQUAL_HEX32(0xA5A5A5A5u, result.acknowledged);
  const unsigned before = fake.transactions;
  TEST_ASSERT_EQUAL_INT(FT_ERR_TIMEOUT, command(CONVERT));
  TEST_ASSERT_EQUAL_INT(FT_ERR_TIMEOUT, read_back(READ_ADC, 3));
  TEST_ASSERT_EQUAL_UINT(before, fake.transactions);
}

TEST(test_recovery_frees_sda_within_nine_clocks_or_by_the_reset) {
  for (unsigned clocks = 1; clocks <= 10; clocks++) {
    next_case();
    fake.sda_held = true;
    fake.sda_free_by_mux_reset = clocks == 10;
    fake.sda_free_after_clocks = clocks;
    TEST_ASSERT_EQUAL_INT(FT_OK, recover());
    TEST_ASSERT_EQUAL_UINT(9, fake.clocks);
    TEST_ASSERT_EQUAL_UINT(clocks < 10, fake.stops);
    expect_good_frame();
  }
}

/* Frames and recoveries as scan makes them; returns how many of the frames failed. */
static int run_for(uint64_t duration_us, sensor_map *sensors) {
  int failed = 0;
  const uint64_t until_us = fake.now_us + duration_us;
  while (fake.now_us < until_us) {
    if (frame() == FT_OK) {
      *sensors = result.acknowledged;
      expect_readings(result.acknowledged);
    } else {
      failed++;
      TEST_ASSERT_EQUAL_INT(FT_OK, recover());
    }
  }
  return failed;
}

TEST(test_a_line_tied_low_costs_its_multiplexer_only) {
  for (unsigned k = 0; k < BOARD_SENSOR_COUNT; k++) {
    next_case();
    const uint32_t rest = ALL_SENSORS & ~STRIP(k / BOARD_SENSORS_OF_STRIP);
    sensor_map sensors = 0;
    expect_good_frame();
    fake.tied_low = 1u << k;
    const uint64_t start_us = fake.now_us;
    int failed = 0;
    while (sensors == 0) {
      failed += run_for(1, &sensors);
      TEST_ASSERT_LESS_THAN_INT(4, failed);
    }
    TEST_ASSERT_EQUAL_HEX32(rest, sensors);
    TEST_ASSERT_LESS_THAN_UINT64(start_us + 15000, fake.now_us);
    /* Tried again ever more rarely: after 1, 2, 4, 8 and 16 s, and then every 16 s. */
    TEST_ASSERT_EQUAL_INT(5, run_for(32000000, &sensors));
    TEST_ASSERT_EQUAL_INT(3, run_for(48000000, &sensors));
    TEST_ASSERT_EQUAL_HEX32(rest, sensors);
    fake.tied_low = 0;
    TEST_ASSERT_EQUAL_INT(0, run_for(17000000, &sensors));
    TEST_ASSERT_EQUAL_HEX32(ALL_SENSORS, sensors);
    /* All went well: the next time it is shut for a second again. */
    fake.tied_low = 1u << k;
    TEST_ASSERT_LESS_THAN_INT(4, run_for(100000, &sensors));
    fake.tied_low = 0;
    TEST_ASSERT_EQUAL_INT(0, run_for(1100000, &sensors));
    TEST_ASSERT_EQUAL_HEX32(ALL_SENSORS, sensors);
  }
}

TEST(test_lines_tied_low_behind_all_multiplexers_leave_nobody) {
  sensor_map sensors = ALL_SENSORS;
  fake.tied_low = 1u << 0 | 1u << 7 | 1u << 14;
  TEST_ASSERT_LESS_THAN_INT(60, run_for(10000000, &sensors));
  TEST_ASSERT_EQUAL_HEX32(0, sensors);
  fake.tied_low = 1u << 7;
  run_for(40000000, &sensors);
  TEST_ASSERT_EQUAL_HEX32(ALL_SENSORS & ~STRIP(1), sensors);
}

/* What stands still once, or at another place each time, is no held line. */
TEST(test_single_standstills_shut_nobody) {
  for (unsigned at = 1; at <= FRAME_TRANSACTIONS; at++) {
    next_case();
    for (int n = 0; n < 3; n++) {
      fake.hang_at = fake.transactions + at;
      TEST_ASSERT_EQUAL_INT(FT_ERR_TIMEOUT, frame());
      TEST_ASSERT_EQUAL_INT(FT_OK, recover());
      expect_good_frame();
    }
  }
}

TEST(test_a_line_held_for_good_is_reported_and_asked_again) {
  for (int line = 0; line < 2; line++) {
    next_case();
    *(line == 0 ? &fake.sda_held : &fake.scl_held) = true;
    for (int n = 0; n < 3; n++) {
      TEST_ASSERT_EQUAL_INT(FT_ERR_STUCK, recover());
      TEST_ASSERT_EQUAL_INT(FT_ERR_TIMEOUT, command(CONVERT));
    }
    fake.sda_held = fake.scl_held = false;
    TEST_ASSERT_EQUAL_INT(FT_OK, recover());
    expect_good_frame();
  }
}

TEST(test_recovery_abandons_whatever_is_under_way) {
  for (uint64_t after_us = 0; after_us < 2100; after_us += 77) {
    next_case();
    TEST_ASSERT_EQUAL_INT(FT_OK, bus.start_read(bus.context, READ_ADC, 3, fake.now_us));
    const uint64_t until_us = fake.now_us + after_us;
    while (fake.now_us < until_us) {
      uint64_t wake_us = 0;
      TEST_ASSERT_EQUAL_INT(FT_PENDING, bus.poll(bus.context, fake.now_us, &result, &wake_us));
      sleep_until(earlier(wake_us, until_us));
    }
    TEST_ASSERT_EQUAL_INT(FT_OK, recover());
    expect_good_frame();
  }
}

TEST(test_start_resets_every_multiplexer) { TEST_ASSERT_EQUAL_HEX8((1u << BOARD_MUX_COUNT) - 1u, fake.driven); }

/* SDA may be high because a sensor is sending a one: it needs its clocks all the same. Half periods of 5 us: nine
 * clocks of two, and six of the STOP and the resets. */
TEST(test_recovery_of_a_free_bus) {
  expect_good_frame();
  const uint64_t begun_us = fake.now_us;
  TEST_ASSERT_EQUAL_INT(FT_OK, recover());
  TEST_ASSERT_EQUAL_UINT64(RECOVERY_us, fake.now_us - begun_us);
  TEST_ASSERT_EQUAL_UINT(9, fake.clocks);
  TEST_ASSERT_EQUAL_UINT(1, fake.stops);
  const unsigned before = fake.transactions;
  expect_good_frame();
  TEST_ASSERT_EQUAL_UINT(FRAME_TRANSACTIONS, fake.transactions - before);
}
