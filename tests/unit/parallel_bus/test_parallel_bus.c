#include "fake_lines.h"
#include "pico_parallel/parallel_bus.h"
#define NOW_us fake.now_us
#include "support/bus_bench.h"

#include <string.h>

#define ALL ((1u << 15) - 1u)
#define CONVERT 0x44
#define READ_ADC 0x00

static struct parallel_bus parallel_bus;

static void power_up(void) {
  fake_lines_power_up();
  memset(&result, 0xA5, sizeof result);
  TEST_ASSERT_EQUAL_INT(FT_OK, parallel_bus_init(&parallel_bus, &bus));
}

/* After the first command, which all lines get their clocks before. */
void setUp(void) {
  power_up();
  TEST_ASSERT_EQUAL_INT(FT_OK, command(READ_ADC));
  fake.now_us = 0;
  fake.opened = fake.waves = 0;
  memset(fake.received, 0, sizeof fake.received);
  memset(&result, 0xA5, sizeof result);
}

void tearDown(void) { TEST_ASSERT_EQUAL_UINT_MESSAGE(0, fake.misuses, fake.misuse ? fake.misuse : ""); }

static void next_case(void) {
  tearDown();
  setUp();
}

static void sleep_until(uint64_t wake_us) {
  const uint64_t event_us = fake_lines_next_event_us();
  fake.now_us = event_us < wake_us ? event_us : wake_us;
}

static void expect_bytes_of(uint32_t sensors, uint8_t byte, uint8_t count) {
  TEST_ASSERT_EQUAL_HEX32(sensors, sensors & result.acknowledged);
  for (unsigned k = 0; k < BOARD_SENSOR_COUNT; k++) {
    for (unsigned i = 0; (sensors >> k & 1) != 0 && i < count; i++) {
      TEST_ASSERT_EQUAL_HEX8(fake_byte(k, byte, i), result.bytes[k][i]);
    }
  }
}

static void expect_bytes(uint32_t acknowledged, uint8_t byte, uint8_t count) {
  TEST_ASSERT_EQUAL_HEX32(acknowledged, result.acknowledged);
  expect_bytes_of(acknowledged, byte, count);
}

static void expect_good_frame(void) {
  TEST_ASSERT_EQUAL_INT(FT_OK, command(CONVERT));
  TEST_ASSERT_EQUAL_HEX32(ALL, result.acknowledged);
  TEST_ASSERT_EQUAL_INT(FT_OK, read_back(READ_ADC, 3));
  expect_bytes(ALL, READ_ADC, 3);
}

TEST(test_sensors_that_an_earlier_life_left_in_mid_byte) {
  power_up();
  for (unsigned k = 0; k < BOARD_SENSOR_COUNT; k += 2) {
    fake_lose_its_place(k);
  }
  expect_good_frame();
}

TEST(test_every_command_reaches_every_sensor) {
  for (unsigned byte = 0; byte < 256; byte++) {
    TEST_ASSERT_EQUAL_INT(FT_OK, command((uint8_t)byte));
    TEST_ASSERT_EQUAL_HEX32(ALL, result.acknowledged);
    TEST_ASSERT_EQUAL_UINT32(0, result.nacks);
    TEST_ASSERT_EQUAL_HEX16(ALL, fake.starts);
    TEST_ASSERT_EQUAL_HEX16(ALL, fake.stops);
    TEST_ASSERT_EQUAL_UINT(19, fake.clocks); /* the last one is the rise before the STOP */
    for (unsigned k = 0; k < BOARD_SENSOR_COUNT; k++) {
      TEST_ASSERT_EQUAL_HEX8(byte, fake.commands[k]);
      TEST_ASSERT_EQUAL_UINT(byte + 1, fake.received[k]);
    }
  }
}

TEST(test_reads_of_every_length_and_command) {
  for (unsigned byte = 0; byte < 256; byte++) {
    for (uint8_t count = 1; count <= ARRAY_BUS_MAX_READ_BYTES; count++) {
      TEST_ASSERT_EQUAL_INT(FT_OK, read_back((uint8_t)byte, count));
      expect_bytes(ALL, (uint8_t)byte, count);
      TEST_ASSERT_EQUAL_UINT32(0, result.nacks);
      for (unsigned k = 0; k < BOARD_SENSOR_COUNT; k++) {
        for (unsigned i = count; i < ARRAY_BUS_MAX_READ_BYTES; i++) {
          TEST_ASSERT_EQUAL_HEX8(0xA5, result.bytes[k][i]);
        }
      }
      memset(&result, 0xA5, sizeof result);
    }
  }
}

TEST(test_time_on_the_bus) {
  TEST_ASSERT_EQUAL_INT(FT_OK, command(CONVERT));
  TEST_ASSERT_EQUAL_UINT64(50, fake.now_us);
  TEST_ASSERT_EQUAL_INT(FT_OK, read_back(READ_ADC, 3));
  TEST_ASSERT_EQUAL_UINT64(50 + 146 + 5 * FT_READ_STOPS, fake.now_us);
  TEST_ASSERT_EQUAL_UINT(1 + FT_READ_STOPS, fake.stops_of_first);
}

TEST(test_a_chip_that_does_not_start) {
  fake.opens = false;
  TEST_ASSERT_EQUAL_INT(FT_ERR_TIMEOUT, parallel_bus_init(&parallel_bus, &bus));
  fake.opens = true;
  TEST_ASSERT_EQUAL_INT(FT_OK, parallel_bus_init(&parallel_bus, &bus));
  fake.opens = false;
  const unsigned before = fake.waves;
  const uint64_t at_us = fake.now_us;
  TEST_ASSERT_EQUAL_INT(FT_ERR_STUCK, recover());
  TEST_ASSERT_EQUAL_INT(FT_ERR_TIMEOUT, command(CONVERT));
  TEST_ASSERT_EQUAL_INT(FT_ERR_TIMEOUT, read_back(READ_ADC, 3));
  TEST_ASSERT_EQUAL_UINT(before, fake.waves);   /* nothing is played on blocks in reset ... */
  TEST_ASSERT_EQUAL_UINT64(at_us, fake.now_us); /* ... or waited for */
  fake.opens = true;
  TEST_ASSERT_EQUAL_INT(FT_OK, recover());
  expect_good_frame();
}

TEST(test_missing_sensors_in_every_place) {
  for (unsigned k = 0; k < BOARD_SENSOR_COUNT; k++) {
    next_case();
    fake.missing = (uint16_t)(1u << k | 1u << (4 * k + 1) % BOARD_SENSOR_COUNT);
    const uint32_t there = ALL & ~(uint32_t)fake.missing;
    const uint32_t absent = k == (4 * k + 1) % BOARD_SENSOR_COUNT ? 1 : 2;
    TEST_ASSERT_EQUAL_INT(FT_OK, command(CONVERT));
    TEST_ASSERT_EQUAL_HEX32(there, result.acknowledged);
    TEST_ASSERT_EQUAL_UINT32(absent, result.nacks);
    TEST_ASSERT_EQUAL_INT(FT_OK, read_back(READ_ADC, 3));
    expect_bytes(there, READ_ADC, 3);
    TEST_ASSERT_EQUAL_UINT32(absent, result.nacks);
    fake.missing = 0;
    expect_good_frame();
  }
}

TEST(test_a_refused_command_is_not_acknowledged) {
  fake.deaf = 1u << 6;
  TEST_ASSERT_EQUAL_INT(FT_OK, command(CONVERT));
  TEST_ASSERT_EQUAL_HEX32(ALL & ~(1u << 6), result.acknowledged);
  TEST_ASSERT_EQUAL_INT(FT_OK, read_back(READ_ADC, 3));
  expect_bytes(ALL & ~(1u << 6), READ_ADC, 3);
}

TEST(test_a_line_held_low_costs_its_own_sensor_only) {
  for (unsigned k = 0; k < BOARD_SENSOR_COUNT; k++) {
    next_case();
    fake.held_low = (uint16_t)(1u << k);
    for (int n = 0; n < 5; n++) {
      TEST_ASSERT_EQUAL_INT(FT_OK, command(CONVERT));
      TEST_ASSERT_EQUAL_HEX32(ALL & ~(1u << k), result.acknowledged);
      TEST_ASSERT_EQUAL_INT(FT_OK, read_back(READ_ADC, 3));
      expect_bytes(ALL & ~(1u << k), READ_ADC, 3);
      TEST_ASSERT_EQUAL_UINT32(1, result.nacks);
    }
    fake.held_low = 0;
    expect_good_frame();
  }
}

TEST(test_a_sensor_that_lost_its_place_is_clocked_free_alone) {
  for (unsigned k = 0; k < BOARD_SENSOR_COUNT; k++) {
    next_case();
    expect_good_frame();
    fake_lose_its_place(k);
    TEST_ASSERT_EQUAL_INT(FT_OK, read_back(READ_ADC, 3));
    expect_bytes(ALL & ~(1u << k), READ_ADC, 3);
    /* Still held at the last address: the nine clocks go before the next command. */
    fake_lose_its_place(k);
    TEST_ASSERT_EQUAL_INT(FT_OK, bus.start_command(bus.context, CONVERT, fake.now_us));
    TEST_ASSERT_EQUAL_UINT(10, fake.clocks);
    TEST_ASSERT_EQUAL_HEX16(0, fake.starts);
    TEST_ASSERT_EQUAL_HEX16(1u << k, fake.stops);
    TEST_ASSERT_EQUAL_INT(FT_OK, finish());
    TEST_ASSERT_EQUAL_HEX32(ALL, result.acknowledged);
    expect_good_frame();
  }
}

TEST(test_a_line_held_for_good_is_clocked_ever_more_rarely) {
  fake.held_low = 1u << 3;
  unsigned attempts = 0;
  for (int n = 0; n < 5000; n++) {
    const unsigned before = fake.waves;
    TEST_ASSERT_EQUAL_INT(FT_OK, command(CONVERT));
    attempts += fake.waves - before - 1;
  }
  /* After 1, 2, 4 .. 1024, and then each 1024 commands */
  TEST_ASSERT_GREATER_OR_EQUAL_UINT(11, attempts);
  TEST_ASSERT_LESS_OR_EQUAL_UINT(15, attempts);
  fake.held_low = 0;
  TEST_ASSERT_EQUAL_INT(FT_OK, command(CONVERT));
  fake.held_low = 1u << 9; /* another one is answered at once */
  TEST_ASSERT_EQUAL_INT(FT_OK, command(CONVERT));
  TEST_ASSERT_EQUAL_INT(FT_OK, command(CONVERT));
  const unsigned before = fake.waves;
  TEST_ASSERT_EQUAL_INT(FT_OK, command(CONVERT));
  TEST_ASSERT_LESS_OR_EQUAL_UINT(2, fake.waves - before);
}

/* A sensor that misses a clock, or sees one too many, at every place of a read: it is left out, or wrong in the last
 * byte only, or it has seen no acknowledgement and the last byte is all ones. It is back two commands later. */
TEST(test_a_disturbed_clock_at_every_place) {
  for (int doubles = 0; doubles < 2; doubles++) {
    for (unsigned at = 1; at <= 57; at++) {
      next_case();
      expect_good_frame();
      fake.slips = 1u << 5;
      fake.slip_clock = at;
      fake.slip_doubles = doubles;
      TEST_ASSERT_EQUAL_INT(FT_OK, read_back(READ_ADC, 3));
      expect_bytes_of(ALL & ~(1u << 5), READ_ADC, 3);
      const bool acknowledged = (result.acknowledged >> 5 & 1) != 0;
      const uint8_t *bytes = result.bytes[5];
      const bool high_bytes_right = bytes[0] == fake_byte(5, READ_ADC, 0) && bytes[1] == fake_byte(5, READ_ADC, 1);
      TEST_ASSERT_TRUE(!acknowledged || high_bytes_right || bytes[2] == 0xFF);
      TEST_ASSERT_EQUAL_INT(FT_OK, command(CONVERT));
      TEST_ASSERT_EQUAL_INT(FT_OK, command(CONVERT));
      expect_good_frame();
    }
  }
}

TEST(test_scl_held_low_is_a_failure_of_the_bus) {
  expect_good_frame();
  fake.held_low = BOARD_SCL_LINE;
  TEST_ASSERT_EQUAL_INT(FT_ERR_TIMEOUT, command(CONVERT));
  TEST_ASSERT_EQUAL_INT(FT_ERR_STUCK, recover());
  TEST_ASSERT_EQUAL_INT(FT_ERR_STUCK, recover());
  const unsigned before = fake.waves;
  TEST_ASSERT_EQUAL_INT(FT_ERR_TIMEOUT, command(CONVERT));
  TEST_ASSERT_EQUAL_INT(FT_ERR_TIMEOUT, read_back(READ_ADC, 3));
  TEST_ASSERT_EQUAL_UINT(before, fake.waves);
  fake.held_low = 0;
  TEST_ASSERT_EQUAL_INT(FT_OK, recover());
  expect_good_frame();
}

TEST(test_without_clocks_nobody_acknowledges) {
  fake.held_high = BOARD_SCL_LINE;
  TEST_ASSERT_EQUAL_INT(FT_OK, command(CONVERT));
  TEST_ASSERT_EQUAL_HEX32(0, result.acknowledged);
  fake.misuses = 0; /* edges of SDA alone look like START and STOP to the fake */
  fake.held_high = 0;
  expect_good_frame();
}

TEST(test_a_wave_that_never_ends) {
  expect_good_frame();
  fake.hangs = true;
  const uint64_t start_us = fake.now_us;
  TEST_ASSERT_EQUAL_INT(FT_ERR_TIMEOUT, read_back(READ_ADC, 3));
  TEST_ASSERT_LESS_THAN_UINT64(start_us + 900, fake.now_us);
  TEST_ASSERT_EQUAL_INT(FT_ERR_STUCK, recover());
  fake.hangs = false;
  TEST_ASSERT_EQUAL_INT(FT_OK, recover());
  expect_good_frame();
}

TEST(test_recovery_gives_nine_clocks_and_a_stop_to_all) {
  fake_lose_its_place(2);
  fake_lose_its_place(11);
  TEST_ASSERT_EQUAL_INT(FT_OK, recover());
  TEST_ASSERT_EQUAL_UINT(10, fake.clocks);
  TEST_ASSERT_EQUAL_HEX16(0, fake.starts);
  TEST_ASSERT_EQUAL_HEX16(ALL, fake.stops);
  expect_good_frame();
}

TEST(test_recovery_abandons_whatever_is_under_way) {
  for (uint64_t after_us = 0; after_us < 150; after_us += 7) {
    next_case();
    TEST_ASSERT_EQUAL_INT(FT_OK, bus.start_read(bus.context, READ_ADC, 3, fake.now_us));
    fake.now_us += after_us;
    TEST_ASSERT_EQUAL_INT(FT_OK, recover());
    expect_good_frame();
  }
}

/* All bytes but the last, while that is on its way; before the last cells nothing else is due. */
TEST(test_bytes_are_taken_while_the_last_one_comes) {
  uint64_t look_us = 0, end_us = 0;
  TEST_ASSERT_EQUAL_INT(FT_OK, bus.start_read(bus.context, READ_ADC, 3, fake.now_us));
  TEST_ASSERT_EQUAL_INT(FT_PENDING, bus.poll(bus.context, fake.now_us, &result, &look_us));
  fake.now_us = look_us;
  TEST_ASSERT_TRUE(look_us < fake_lines_next_event_us());
  TEST_ASSERT_EQUAL_INT(FT_PENDING, bus.poll(bus.context, fake.now_us, &result, &end_us));
  TEST_ASSERT_EQUAL_UINT(2, parallel_bus.bytes_taken);
  TEST_ASSERT_EQUAL_HEX8(fake_byte(7, READ_ADC, 1), result.bytes[7][1]);
  TEST_ASSERT_TRUE(end_us > fake_lines_next_event_us());
  TEST_ASSERT_EQUAL_INT(FT_OK, finish());
}
