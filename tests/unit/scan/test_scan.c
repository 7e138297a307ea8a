#include "fake_bus.h"
#include "scan/scan.h"
#include "support/random.h"

#include <string.h>
#include <unity.h>

enum { SENSORS = 15, PROM_READS = MS58XX_PROM_WORDS };
#define ALL 0x7FFFu
#define LONGEST_INTERVAL_us (SCAN_TEMPERATURE_INTERVAL_MAX_ms * 1000u)
#define DISTURBED 3
#define DISTURBED_BIT (1u << DISTURBED)

static struct fake_bus fake;
static struct array_bus bus;
static struct scan scan;
static uint64_t now_us;
static struct frame frame;
static bool taking; /* the main context keeps up */
static int frames;
static uint32_t lateness_us; /* at most, of every wake-up */
static struct random lateness;

static void power_up(uint8_t sensor_count, const struct scan_settings *settings) {
  now_us = 0;
  taking = true;
  frames = 0;
  lateness_us = 0;
  lateness.state = 30;
  fake_bus_init(&fake, &bus, sensor_count);
  TEST_ASSERT_EQUAL_INT(FT_OK, scan_init(&scan, &bus, settings));
}

static const struct scan_settings usual = {.sensor_count = SENSORS, .osr = 1024, .rate_mHz = 0};

void setUp(void) {
  power_up(SENSORS, &usual);
}

void tearDown(void) {
  TEST_ASSERT_EQUAL_INT_MESSAGE(0, fake.misuses, fake.misuse ? fake.misuse : "");
}

static void next_case(const struct scan_settings *settings) {
  tearDown();
  power_up(settings->sensor_count, settings);
}

/* One wake-up of the event context, then the main context. True: a frame was taken. A wake time in
 * the past would be an interrupt storm. */
static bool step(void) {
  uint64_t wake_us = now_us;
  for (int calls = 0; wake_us <= now_us; calls++) {
    TEST_ASSERT_LESS_THAN_INT_MESSAGE(4, calls, "asks again and again for the present");
    wake_us = scan_step(&scan, now_us);
  }
  bool taken = taking && scan_take(&scan, &frame);
  frames += taken;
  now_us = wake_us + random_below(&lateness, lateness_us + 1);
  return taken;
}

static void run_until(uint64_t end_us) {
  while (now_us < end_us) {
    step();
  }
}

static void next_frame(void) {
  for (int steps = 0; !step(); steps++) {
    TEST_ASSERT_LESS_THAN_INT_MESSAGE(2000, steps, "no frame comes");
  }
}

static void skip_frames(int count) {
  for (int i = 0; i < count; i++) {
    next_frame();
  }
}

static uint32_t value_of(const _Atomic uint32_t *value) {
  return atomic_load(value);
}

static void assert_entry(int at, enum fake_operation operation, uint8_t command) {
  TEST_ASSERT_LESS_THAN_INT(fake.logged, at);
  TEST_ASSERT_EQUAL_INT(operation, fake.log[at].operation);
  TEST_ASSERT_EQUAL_HEX8(command, fake.log[at].command);
}

/* Asserts a reset and this many PROM passes from an entry on; returns the entry after them. */
static int assert_admission(int at, int passes) {
  assert_entry(at++, FAKE_COMMAND, 0x1E);
  for (int pass = 0; pass < passes; pass++) {
    for (uint8_t word = 0; word < PROM_READS; word++) {
      TEST_ASSERT_EQUAL_UINT8(2, fake.log[at].byte_count);
      assert_entry(at++, FAKE_READ, (uint8_t)(0xA0 + 2 * word));
    }
  }
  return at;
}

static int count_entries(uint8_t command, enum fake_operation operation) {
  int found = 0;
  for (int i = 0; i < fake.logged; i++) {
    found += fake.log[i].operation == operation && fake.log[i].command == command;
  }
  return found;
}

static int find_entry(int from, uint8_t command, enum fake_operation operation) {
  while (from < fake.logged &&
         !(fake.log[from].operation == operation && fake.log[from].command == command)) {
    from++;
  }
  TEST_ASSERT_LESS_THAN_INT_MESSAGE(fake.logged, from, "the operation never came");
  return from;
}

static int32_t expected_Pa_q10(uint8_t k) {
  struct ms58xx_thermal thermal;
  ms58xx_compensate_temperature(&fake.prom[k], fake.d2[k], MS58XX_BRANCH_UNKNOWN, &thermal);
  return ms58xx_compensate_pressure(&thermal, fake.d1[k]);
}

static void assert_good_frame(uint32_t valid) {
  TEST_ASSERT_EQUAL_HEX32(valid, frame.valid);
  for (uint8_t k = 0; k < SENSORS; k++) {
    TEST_ASSERT_EQUAL_INT32(valid >> k & 1u ? expected_Pa_q10(k) : 0, frame.pressure_Pa_q10[k]);
  }
}

static void test_settings_outside_their_range(void) {
  struct scan_settings settings = usual;
  settings.sensor_count = 0;
  TEST_ASSERT_EQUAL_INT(FT_ERR_ARGUMENT, scan_init(&scan, &bus, &settings));
  settings.sensor_count = FT_MAX_SENSORS + 1;
  TEST_ASSERT_EQUAL_INT(FT_ERR_ARGUMENT, scan_init(&scan, &bus, &settings));
  settings = usual;
  settings.osr = 1000;
  TEST_ASSERT_EQUAL_INT(FT_ERR_ARGUMENT, scan_init(&scan, &bus, &settings));
}

/* To the middle of the next conversion of the temperature. */
static void skip_to_temperature(void) {
  for (int steps = 0; scan.state != SCAN_WAIT_CONVERSION || !scan.conversion->is_temperature;
       steps++) {
    TEST_ASSERT_LESS_THAN_INT_MESSAGE(20000, steps, "no temperature comes");
    step();
  }
}

static void test_start_up_sequence(void) {
  next_frame();
  next_frame();
  TEST_ASSERT_GREATER_OR_EQUAL_UINT64(10000, fake.log[0].start_us);
  int at = assert_admission(0, 1);
  assert_entry(at++, FAKE_COMMAND, 0x54);
  assert_entry(at++, FAKE_READ, 0x00);
  assert_entry(at++, FAKE_COMMAND, 0x44);
  assert_entry(at++, FAKE_READ, 0x00);
  assert_entry(at++, FAKE_COMMAND, 0x44);
  assert_entry(at++, FAKE_READ, 0x00);
  TEST_ASSERT_EQUAL_HEX32(ALL, value_of(&scan.present));
  TEST_ASSERT_EQUAL_HEX32(ALL, value_of(&scan.admitted));
  TEST_ASSERT_EQUAL_HEX32(0, value_of(&scan.prom_bad));
}

static void test_frame_contents(void) {
  next_frame();
  const struct fake_entry *convert = &fake.log[find_entry(0, 0x44, FAKE_COMMAND)];
  const struct fake_entry *read = convert + 1;
  TEST_ASSERT_EQUAL_UINT32(0, frame.number);
  TEST_ASSERT_EQUAL_UINT8(SENSORS, frame.sensor_count);
  assert_good_frame(ALL);
  TEST_ASSERT_EQUAL_HEX32(0, frame.saturated);
  TEST_ASSERT_EQUAL_UINT64(convert->start_us, frame.t_begin_us);
  TEST_ASSERT_EQUAL_UINT64(read->start_us, frame.t_converted_us);
  TEST_ASSERT_EQUAL_UINT64(read->end_us, frame.t_read_us);
  TEST_ASSERT_EQUAL_UINT64(convert->end_us + 2278 / 2, frame.t_us); /* 2170 and 5 % */
  TEST_ASSERT_EQUAL_INT32(ms58xx_find_osr(1024)->noise_Pa_q10, frame.noise_Pa_q10);
  int32_t sum_cC = 0;
  for (uint8_t k = 0; k < SENSORS; k++) {
    struct ms58xx_thermal thermal;
    ms58xx_compensate_temperature(&fake.prom[k], fake.d2[k], MS58XX_BRANCH_UNKNOWN, &thermal);
    sum_cC += thermal.temperature_cC;
  }
  TEST_ASSERT_EQUAL_INT16(sum_cC / SENSORS, frame.temperature_cC);
  for (uint32_t number = 1; number < 200; number++) {
    next_frame();
    TEST_ASSERT_EQUAL_UINT32(number, frame.number);
    assert_good_frame(ALL);
  }
  TEST_ASSERT_EQUAL_UINT32(0, value_of(&scan.counters.frames_skipped));
  TEST_ASSERT_EQUAL_UINT32(200, value_of(&scan.counters.frames));
  TEST_ASSERT_EQUAL_UINT32(0, value_of(&scan.counters.frames_incomplete));
  TEST_ASSERT_EQUAL_UINT32(0, value_of(&scan.counters.bus_nacks));
}

static void test_saturation_is_reported_at_the_end_of_the_range(void) {
  next_frame();
  uint32_t low = 0;
  uint32_t high = 0xFFFFFF;
  while (high - low > 1) { /* the greatest code that passes */
    fake.d1[DISTURBED] = (low + high) / 2;
    *(expected_Pa_q10(DISTURBED) > MS58XX_MAX_PRESSURE_Pa * 1024 ? &high : &low) =
        fake.d1[DISTURBED];
  }
  fake.d1[DISTURBED] = low;
  skip_frames(2);
  TEST_ASSERT_EQUAL_HEX32(0, frame.saturated);
  fake.d1[DISTURBED] = high;
  skip_frames(2);
  TEST_ASSERT_EQUAL_HEX32(DISTURBED_BIT, frame.saturated);
  assert_good_frame(ALL);
}

/* The fake counts as misuse what comes before the datasheet's longest times; here: not much later.
 */
static void test_waits_at_every_osr(void) {
  static const uint16_t osrs[] = {256, 512, 1024, 2048, 4096, 8192};
  for (size_t i = 0; i < 6; i++) {
    struct scan_settings settings = usual;
    settings.osr = osrs[i];
    next_case(&settings);
    run_until(1200000);
    TEST_ASSERT_EQUAL_INT(3, count_entries((uint8_t)(0x50 + 2 * i), FAKE_COMMAND));
    for (int at = 0; at + 1 < fake.logged; at++) {
      const struct fake_entry *entry = &fake.log[at];
      uint64_t wait_us = fake.log[at + 1].start_us - entry->end_us;
      if (entry->operation == FAKE_COMMAND && entry->command != 0x1E) {
        uint32_t longest_us = fake_conversion_us(entry->command);
        TEST_ASSERT_EQUAL_HEX8(2 * i, entry->command & 0x0F);
        TEST_ASSERT_GREATER_OR_EQUAL_UINT64(longest_us, wait_us);
        TEST_ASSERT_GREATER_OR_EQUAL_UINT64(longest_us + longest_us / 20 - FAKE_READ_LEAD_us,
                                            wait_us);
        TEST_ASSERT_LESS_OR_EQUAL_UINT64(longest_us + longest_us / 10, wait_us);
      } else if (entry->command == 0x1E) {
        TEST_ASSERT_GREATER_OR_EQUAL_UINT64(2800, wait_us);
        TEST_ASSERT_LESS_OR_EQUAL_UINT64(6000, wait_us);
      }
    }
  }
}

static void test_prom_misread_once_is_read_again(void) {
  fake.misread_prom = DISTURBED_BIT;
  fake.misread_passes = 1;
  next_frame();
  assert_entry(assert_admission(0, 2), FAKE_COMMAND, 0x54);
  TEST_ASSERT_EQUAL_HEX32(0, value_of(&scan.prom_bad));
  assert_good_frame(ALL);
}

/* It is used once it has been seen to read like the others, and doubtful. */
static void test_prom_with_differing_crc_is_used_and_reported(void) {
  fake.prom[DISTURBED].word[0] ^= 0x3000;
  skip_frames(2);
  assert_entry(assert_admission(0, 3), FAKE_COMMAND, 0x54);
  TEST_ASSERT_EQUAL_HEX32(DISTURBED_BIT, value_of(&scan.prom_bad));
  TEST_ASSERT_EQUAL_HEX32(ALL, value_of(&scan.admitted));
  assert_good_frame(ALL & ~DISTURBED_BIT);
  TEST_ASSERT_EQUAL_HEX32(0, frame.doubtful);
  run_until(1700000);
  assert_good_frame(ALL);
  TEST_ASSERT_EQUAL_HEX32(DISTURBED_BIT, frame.doubtful);
  TEST_ASSERT_EQUAL_HEX32(0, frame.renewed);
  run_until(60000000);
  TEST_ASSERT_EQUAL_INT(1 + BRING_UP_RECHECKS, count_entries(0x1E, FAKE_COMMAND)); /* no more */
}

/* It may not be what it was to be cured of. */
static void test_who_did_not_hear_the_reset_is_not_admitted(void) {
  fake.answering = ALL & ~DISTURBED_BIT;
  while (count_entries(0x1E, FAKE_COMMAND) == 0 || fake.running) {
    step();
    if (count_entries(0xA0, FAKE_READ) > 0) {
      break;
    }
  }
  fake.answering = ALL;
  skip_frames(2);
  TEST_ASSERT_EQUAL_HEX32(ALL & ~DISTURBED_BIT, value_of(&scan.admitted));
  run_until(2000000);
  TEST_ASSERT_EQUAL_HEX32(ALL, value_of(&scan.admitted));
  TEST_ASSERT_EQUAL_INT(2, count_entries(0x1E, FAKE_COMMAND));
}

static void test_temperature_that_is_asked_for_comes_soon(void) {
  run_until(10000000); /* the interval has grown to its longest */
  const int before = count_entries(0x54, FAKE_COMMAND);
  run_until(now_us + 300000);
  const int without = count_entries(0x54, FAKE_COMMAND) - before;
  scan_ask_temperature(&scan);
  run_until(now_us + 130000);
  TEST_ASSERT_LESS_OR_EQUAL_INT(1, without);
  TEST_ASSERT_EQUAL_INT(before + without + 1, count_entries(0x54, FAKE_COMMAND));
}

/* As where the line was disturbed in all of the first admission. */
static void test_prom_misread_in_a_whole_admission_is_read_again(void) {
  fake.misread_prom = DISTURBED_BIT;
  fake.misread_passes = 3;
  skip_frames(2);
  TEST_ASSERT_EQUAL_HEX32(DISTURBED_BIT, value_of(&scan.prom_bad));
  run_until(3000000);
  TEST_ASSERT_EQUAL_HEX32(0, value_of(&scan.prom_bad));
  TEST_ASSERT_EQUAL_INT(2, count_entries(0x1E, FAKE_COMMAND));
  assert_good_frame(ALL);
  TEST_ASSERT_EQUAL_HEX32(0, frame.doubtful);
}

/* One bit of C1, and the sensor reads 28 kPa more than the others: its gain is off by 10 %. */
static void test_prom_that_makes_a_sensor_stand_apart_is_not_used(void) {
  fake.prom[DISTURBED].word[1] ^= 0x1000;
  run_until(8000000);
  TEST_ASSERT_EQUAL_HEX32(DISTURBED_BIT, value_of(&scan.prom_bad));
  assert_good_frame(ALL & ~DISTURBED_BIT);
  TEST_ASSERT_EQUAL_HEX32(0, frame.doubtful);
}

static void test_blank_prom_is_not_admitted_and_asked_ever_more_rarely(void) {
  memset(&fake.prom[DISTURBED], 0, sizeof fake.prom[DISTURBED]);
  run_until(32000000);
  TEST_ASSERT_EQUAL_HEX32(DISTURBED_BIT, value_of(&scan.prom_bad));
  TEST_ASSERT_EQUAL_HEX32(ALL & ~DISTURBED_BIT, value_of(&scan.admitted));
  assert_good_frame(ALL & ~DISTURBED_BIT);
  static const uint64_t intervals_s[] = {1, 2, 4, 8, 8};
  int at = 0;
  assert_admission(at, 3);
  for (size_t i = 0; i < 5; i++) {
    int next = find_entry(at + 1, 0x1E, FAKE_COMMAND);
    assert_admission(next, 3);
    /* At the end of the frame during which the time came. */
    TEST_ASSERT_UINT64_WITHIN(10000, intervals_s[i] * 1000000 + 5000,
                              fake.log[next].start_us - fake.log[at].start_us);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT64(intervals_s[i] * 1000000,
                                        fake.log[next].start_us - fake.log[at].start_us);
    at = next;
  }
  /* Once all are admitted, the next loss is answered after a second again. */
  fake.prom[DISTURBED] = fake.prom[DISTURBED + 1];
  run_until(45000000);
  TEST_ASSERT_EQUAL_HEX32(ALL, value_of(&scan.admitted));
  TEST_ASSERT_EQUAL_HEX32(0, value_of(&scan.prom_bad));
  assert_good_frame(ALL);
  fake.answering = ALL & ~DISTURBED_BIT;
  skip_frames(2);
  fake.answering = ALL;
  uint64_t back_us = now_us;
  run_until(back_us + 1100000);
  assert_good_frame(ALL);
}

static void test_nobody_answers(void) {
  fake.answering = 0;
  run_until(25000000);
  TEST_ASSERT_EQUAL_HEX32(0, value_of(&scan.present));
  TEST_ASSERT_EQUAL_HEX32(0, frame.valid);
  TEST_ASSERT_EQUAL_INT16(0, frame.temperature_cC);
  TEST_ASSERT_GREATER_THAN_UINT32(0, value_of(&scan.counters.bus_nacks));
  TEST_ASSERT_EQUAL_UINT32(value_of(&scan.counters.frames),
                           value_of(&scan.counters.frames_incomplete));
  TEST_ASSERT_EQUAL_INT(6, count_entries(0x1E, FAKE_COMMAND)); /* at 0, 1, 3, 7, 15, 23 s */
  fake.answering = ALL;
  run_until(34000000);
  assert_good_frame(ALL);
}

static void test_zero_reading_voids_the_next_one_too(void) {
  skip_frames(5);
  fake.zero_next = DISTURBED_BIT; /* of the conversion that runs now */
  skip_frames(1);
  assert_good_frame(ALL & ~DISTURBED_BIT);
  skip_frames(1);
  assert_good_frame(ALL & ~DISTURBED_BIT);
  skip_frames(1);
  assert_good_frame(ALL);
  TEST_ASSERT_EQUAL_UINT32(2, value_of(&scan.counters.zero_readings));
  TEST_ASSERT_EQUAL_UINT32(2, value_of(&scan.counters.frames_incomplete));
  TEST_ASSERT_EQUAL_INT(1, count_entries(0x1E, FAKE_COMMAND)); /* no reason for a reset */
}

static void test_zeros_for_ever_do_not_wedge(void) {
  skip_frames(3);
  for (int i = 0; i < 1000; i++) {
    fake.zero_next = ALL;
    next_frame();
    TEST_ASSERT_EQUAL_HEX32(0, frame.valid);
  }
  run_until(now_us + 1100000);
  assert_good_frame(ALL);
}

/* A sensor that lost its reset answers 0 for ever: the second 0 in a row costs its admission, and
 * it is reset within a second. */
static void test_two_zeros_in_a_row_lead_to_a_reset(void) {
  run_until(3000000);
  for (int i = 0; i < 2; i++) {
    TEST_ASSERT_EQUAL_HEX32(ALL, value_of(&scan.admitted));
    fake.zero_next = DISTURBED_BIT;
    next_frame();
  }
  TEST_ASSERT_EQUAL_HEX32(ALL & ~DISTURBED_BIT, value_of(&scan.admitted));
  TEST_ASSERT_EQUAL_HEX32(ALL, value_of(&scan.present));
  next_frame(); /* its conversion has already begun */
  assert_good_frame(ALL & ~DISTURBED_BIT);
  next_frame();
  TEST_ASSERT_EQUAL_INT(2, count_entries(0x1E, FAKE_COMMAND));
  assert_good_frame(ALL);
}

/* A sensor that missed two reads before all were reset restarts: one more does not cost its
 * admission, as the third in a row would. */
static void test_what_was_missed_before_a_reset_does_not_count_after_it(void) {
  const uint32_t other = 1u << (SENSORS - 1);
  run_until(3000000);
  fake.zero_next = other;
  next_frame();
  fake.answering = ALL & ~DISTURBED_BIT;
  fake.zero_next = other;
  next_frame();
  next_frame(); /* the last one before the reset */
  TEST_ASSERT_EQUAL_HEX32(ALL & ~other, value_of(&scan.admitted));
  fake.answering = ALL;
  while (count_entries(0x1E, FAKE_COMMAND) < 2 || scan.state != SCAN_WAIT_CONVERSION) {
    step();
  }
  TEST_ASSERT_EQUAL_HEX32(ALL, value_of(&scan.admitted));
  fake.answering = ALL & ~DISTURBED_BIT;
  next_frame();
  TEST_ASSERT_EQUAL_HEX32(ALL, value_of(&scan.admitted));
  fake.answering = ALL;
  skip_frames(5);
  TEST_ASSERT_EQUAL_INT(2, count_entries(0x1E, FAKE_COMMAND));
}

static void test_temperature_of_all_ones_is_no_reading(void) {
  next_frame();
  skip_to_temperature();
  uint32_t d2 = fake.d2[DISTURBED];
  fake.d2[DISTURBED] = 0xFFFFFF;
  skip_frames(3);
  TEST_ASSERT_EQUAL_INT(2, count_entries(0x54, FAKE_COMMAND));
  fake.d2[DISTURBED] = d2;
  assert_good_frame(ALL);
}

static void test_zero_temperature_keeps_the_last_and_is_repeated_soon(void) {
  next_frame();
  skip_to_temperature();
  uint32_t d2 = fake.d2[DISTURBED];
  fake.zero_next = DISTURBED_BIT;
  fake.d2[DISTURBED] += 20000; /* must not show before a good reading of it */
  next_frame();
  TEST_ASSERT_TRUE(frame.held);
  TEST_ASSERT_EQUAL_HEX32(ALL, frame.valid);
  next_frame();
  TEST_ASSERT_EQUAL_HEX32(ALL & ~DISTURBED_BIT, frame.valid);
  next_frame();
  uint32_t next_d2 = fake.d2[DISTURBED];
  fake.d2[DISTURBED] = d2;
  assert_good_frame(ALL);
  fake.d2[DISTURBED] = next_d2;
  uint64_t asked_us = now_us;
  skip_to_temperature();
  TEST_ASSERT_LESS_THAN_UINT64(asked_us + 110000, now_us);
  skip_frames(2);
  assert_good_frame(ALL);
}

/* A flipped bit: the pressures keep the temperature before it. A jump that stays is believed. */
static void test_jump_of_the_temperature_must_be_confirmed(void) {
  next_frame();
  skip_to_temperature();
  uint32_t d2 = fake.d2[DISTURBED];
  fake.d2[DISTURBED] = d2 ^ 0x80000;
  skip_frames(2);
  fake.d2[DISTURBED] = d2;
  assert_good_frame(ALL);
  TEST_ASSERT_EQUAL_HEX32(DISTURBED_BIT, frame.doubtful);
  uint64_t asked_us = now_us;
  skip_to_temperature(); /* asked again soon */
  TEST_ASSERT_LESS_THAN_UINT64(asked_us + 110000, now_us);
  skip_frames(2);
  assert_good_frame(ALL);
  asked_us = now_us;
  skip_to_temperature(); /* and then as ever */
  TEST_ASSERT_UINT64_WITHIN(15000, asked_us + 490000, now_us);
  skip_frames(2);
  assert_good_frame(ALL);

  skip_to_temperature();
  fake.d2[DISTURBED] = d2 + 60000; /* 2 degC: may be */
  skip_frames(2);
  fake.d2[DISTURBED] = d2;
  assert_good_frame(ALL);
  fake.d2[DISTURBED] = d2 + 60000;
  TEST_ASSERT_EQUAL_HEX32(DISTURBED_BIT, frame.doubtful);
  skip_to_temperature();
  skip_frames(2);
  assert_good_frame(ALL);
  TEST_ASSERT_EQUAL_HEX32(0, frame.doubtful);
}

/* Two temperatures that agree with each other and with no other sensor: it has lost its state. Its
 * reset makes it the sensor it was. */
static void test_sensor_that_tells_another_temperature_is_reset(void) {
  run_until(3000000);
  skip_to_temperature();
  uint32_t d1 = fake.d1[DISTURBED];
  uint32_t d2 = fake.d2[DISTURBED];
  fake.d2[DISTURBED] = d2 ^ 0x80000;
  next_frame();
  TEST_ASSERT_TRUE(frame.held);
  TEST_ASSERT_EQUAL_HEX32(DISTURBED_BIT, frame.doubtful); /* which goes out with the held frame */
  next_frame();
  TEST_ASSERT_EQUAL_HEX32(DISTURBED_BIT, frame.doubtful);
  skip_to_temperature();
  fake.d1[DISTURBED] = d1 / 8 * 9;
  while (count_entries(0x1E, FAKE_COMMAND) == 1) {
    next_frame();
    TEST_ASSERT_TRUE(frame.held || frame.valid == (ALL & ~DISTURBED_BIT));
  }
  fake.d1[DISTURBED] = d1;
  fake.d2[DISTURBED] = d2;
  skip_frames(3);
  assert_good_frame(ALL);
  TEST_ASSERT_EQUAL_HEX32(0, frame.doubtful);
  TEST_ASSERT_EQUAL_HEX32(0, frame.renewed); /* its zero still holds */
  run_until(now_us + 10000000);
  TEST_ASSERT_EQUAL_INT(2, count_entries(0x1E, FAKE_COMMAND));
}

/* A supply that dips once does so twice: what it says amid a reset is not what it says for good. */
static void test_sensor_that_loses_its_state_again_amid_a_reset_is_reset_again(void) {
  run_until(3000000);
  const uint32_t d1 = fake.d1[DISTURBED];
  const uint32_t d2 = fake.d2[DISTURBED];
  fake.d2[DISTURBED] = d2 / 16 * 15;
  skip_to_temperature();
  fake.d1[DISTURBED] = d1 / 16 * 15;
  while (count_entries(0x1E, FAKE_COMMAND) < 3) {
    next_frame();
    TEST_ASSERT_TRUE(frame.held || !(frame.valid & ~frame.doubtful & DISTURBED_BIT));
  }
  fake.d1[DISTURBED] = d1;
  fake.d2[DISTURBED] = d2;
  skip_frames(3);
  assert_good_frame(ALL);
  TEST_ASSERT_EQUAL_HEX32(0, frame.doubtful);
}

/* One that comes back wrong again and again is reset ever more rarely. */
static void test_incurable_sensor_is_reset_ever_more_rarely(void) {
  run_until(3000000);
  fake.d1[DISTURBED] = 1000000; /* below zero */
  run_until(now_us + 32000000);
  TEST_ASSERT_EQUAL_HEX32(ALL & ~DISTURBED_BIT, frame.valid);
  TEST_ASSERT_EQUAL_INT32(0, frame.pressure_Pa_q10[DISTURBED]);
  TEST_ASSERT_INT_WITHIN(1, 1 + 7, count_entries(0x1E, FAKE_COMMAND)); /* 0 1 3 7 15 23 31 s */
  TEST_ASSERT_EQUAL_UINT32(2 * (uint32_t)(count_entries(0x1E, FAKE_COMMAND) - 1) + 2,
                           value_of(&scan.counters.implausible_readings));
  fake.d1[DISTURBED] = fake.d1[DISTURBED + 1];
  run_until(now_us + 9000000);
  assert_good_frame(ALL);
}

/* At most one frame in twenty: that frame comes in its turn, at its time, with the pressures of the
 * one before. */
static void test_temperature_takes_the_place_of_a_frame(void) {
  static const uint16_t osrs[] = {256, 512, 1024, 2048, 4096, 8192};
  for (size_t i = 0; i < 6; i++) {
    struct scan_settings settings = usual;
    settings.osr = osrs[i];
    next_case(&settings);
    skip_frames(2);
    struct frame last = frame;
    uint64_t begun_us = now_us;
    int held = 0;
    int all = 0;
    uint64_t period_us = 0;
    for (; now_us < begun_us + 5000000; all++) {
      fake.d1[DISTURBED] += 10;
      next_frame();
      TEST_ASSERT_EQUAL_UINT32(last.number + 1, frame.number);
      if (period_us == 0) {
        period_us = frame.t_us - last.t_us;
      }
      TEST_ASSERT_EQUAL_UINT64(period_us, frame.t_us - last.t_us);
      TEST_ASSERT_EQUAL_UINT64(period_us, frame.t_begin_us - last.t_begin_us);
      TEST_ASSERT_EQUAL_INT32(ms58xx_find_osr(osrs[i])->noise_Pa_q10, frame.noise_Pa_q10);
      if (frame.held) {
        held++;
        TEST_ASSERT_EQUAL_HEX32(last.valid, frame.valid);
        TEST_ASSERT_EQUAL_INT32_ARRAY(last.pressure_Pa_q10, frame.pressure_Pa_q10, FT_MAX_SENSORS);
      } else {
        TEST_ASSERT_EQUAL_HEX32(ALL, frame.valid);
        TEST_ASSERT_NOT_EQUAL(last.pressure_Pa_q10[DISTURBED], frame.pressure_Pa_q10[DISTURBED]);
      }
      last = frame;
    }
    TEST_ASSERT_GREATER_OR_EQUAL_INT(3, held);
    TEST_ASSERT_LESS_OR_EQUAL_INT(5, held);
    TEST_ASSERT_LESS_OR_EQUAL_INT(all, 20 * held);
    TEST_ASSERT_EQUAL_UINT32(0, value_of(&scan.counters.frames_skipped));
  }
}

static uint64_t to_next_temperature_us(void) {
  uint64_t from_us = now_us;
  skip_frames(2);
  skip_to_temperature();
  return now_us - from_us;
}

/* 0.2 degC/s on one sensor alone. */
static void warm_up(uint64_t until_us) {
  while (now_us < until_us) {
    uint64_t from_us = now_us;
    next_frame();
    fake.d2[DISTURBED] += (uint32_t)((now_us - from_us) * 6 / 1000);
  }
}

static void test_temperature_is_read_less_often_while_it_stands_still(void) {
  run_until(6000000);
  skip_to_temperature();
  TEST_ASSERT_UINT64_WITHIN(10000, LONGEST_INTERVAL_us, to_next_temperature_us());
  TEST_ASSERT_UINT64_WITHIN(10000, LONGEST_INTERVAL_us, to_next_temperature_us());

  uint64_t begun_us = now_us;
  warm_up(begun_us + LONGEST_INTERVAL_us + 2000000);
  int before = count_entries(0x54, FAKE_COMMAND);
  warm_up(now_us + 3000000);
  TEST_ASSERT_INT_WITHIN(1, 6, count_entries(0x54, FAKE_COMMAND) - before);

  skip_to_temperature();
  to_next_temperature_us();
  to_next_temperature_us();
  TEST_ASSERT_GREATER_THAN_UINT64(950000, to_next_temperature_us());
}

/* A requested rate leaves pauses: there no frame is held, and the temperature is fresh. */
static void test_temperature_fits_into_the_pauses(void) {
  static const uint32_t rates_mHz[] = {75000, 20000, 1000, 100};
  for (size_t i = 0; i < sizeof rates_mHz / sizeof rates_mHz[0]; i++) {
    struct scan_settings settings = usual;
    settings.rate_mHz = rates_mHz[i];
    next_case(&settings);
    const uint64_t period_us = 1000000000u / rates_mHz[i];
    skip_frames(2);
    uint64_t last_us = frame.t_begin_us;
    while (now_us < 31000000) {
      next_frame();
      TEST_ASSERT_FALSE(frame.held);
      TEST_ASSERT_EQUAL_UINT64(period_us, frame.t_begin_us - last_us);
      last_us = frame.t_begin_us;
    }
    int at = 0;
    int temperatures = count_entries(0x54, FAKE_COMMAND);
    for (int n = 0; n < temperatures; n++) {
      int next = find_entry(at, 0x54, FAKE_COMMAND);
      TEST_ASSERT_LESS_THAN_UINT64(7000, fake.log[next + 2].start_us - fake.log[next].start_us);
      if (n > 4) {
        uint64_t interval_us = fake.log[next].start_us - fake.log[at - 1].start_us;
        TEST_ASSERT_UINT64_WITHIN(period_us + 10000,
                                  (LONGEST_INTERVAL_us + period_us - 1) / period_us * period_us,
                                  interval_us);
      }
      at = next + 1;
    }
    TEST_ASSERT_GREATER_THAN_INT(3, temperatures);
  }
}

static void test_sensor_stops_and_comes_back(void) {
  skip_frames(10);
  fake.answering = ALL & ~DISTURBED_BIT;
  skip_frames(2);
  assert_good_frame(ALL & ~DISTURBED_BIT);
  TEST_ASSERT_EQUAL_HEX32(ALL & ~DISTURBED_BIT, value_of(&scan.present));
  run_until(now_us + 5000000);
  TEST_ASSERT_EQUAL_INT(1, count_entries(0x1E, FAKE_COMMAND)); /* the others run undisturbed */
  assert_good_frame(ALL & ~DISTURBED_BIT);

  /* Another part takes its place: its PROM is read before its readings count. */
  fake.prom[DISTURBED].word[1] = 40000;
  fake.prom[DISTURBED].word[0] &= 0x0FFF;
  fake.prom[DISTURBED].word[0] |= (uint16_t)(ms58xx_prom_crc4(&fake.prom[DISTURBED]) << 12);
  fake.answering = ALL;
  for (int i = 0; i < 50; i++) {
    next_frame();
    uint32_t valid = frame.valid;
    TEST_ASSERT_TRUE(valid == ALL || valid == (ALL & ~DISTURBED_BIT));
    assert_good_frame(valid);
  }
  TEST_ASSERT_EQUAL_HEX32(ALL, frame.valid);
  TEST_ASSERT_EQUAL_INT(2, count_entries(0x1E, FAKE_COMMAND));
}

/* A part that took another's place has no temperature yet when its first one reads 0: until the
 * next one its pressures are invalid, not computed with what belonged to the other. */
static void test_replaced_sensor_waits_for_its_own_temperature(void) {
  run_until(3000000);
  fake.answering = ALL & ~DISTURBED_BIT;
  skip_frames(3);
  fake.prom[DISTURBED] = fake.prom[SENSORS - 1];
  fake.d2[DISTURBED] += 500000;
  fake.answering = ALL;
  while (count_entries(0x1E, FAKE_COMMAND) < 2 || !scan.conversion->is_temperature ||
         scan.state != SCAN_WAIT_CONVERSION) {
    step();
  }
  fake.zero_next = DISTURBED_BIT;
  uint64_t asked_us = now_us;
  for (int i = 0; value_of(&scan.counters.zero_readings) < 3 && now_us < asked_us + 90000; i++) {
    next_frame();
    assert_good_frame(ALL & ~DISTURBED_BIT);
    TEST_ASSERT_EQUAL_HEX32(i == 0 ? DISTURBED_BIT : 0, frame.renewed);
  }
  skip_to_temperature();
  TEST_ASSERT_LESS_THAN_UINT64(asked_us + 120000, now_us);
  skip_frames(2);
  assert_good_frame(ALL & ~DISTURBED_BIT); /* it is 17 degC warmer than all others, and so again */
  run_until(now_us + 4000000);
  TEST_ASSERT_EQUAL_INT(4, count_entries(0x1E, FAKE_COMMAND));
  assert_good_frame(ALL);
  TEST_ASSERT_EQUAL_HEX32(DISTURBED_BIT, frame.doubtful);
}

/* Minutes may have passed, and the pad be warmer: no frame is computed with what was before. */
static void test_sensor_that_was_away_gets_a_new_temperature(void) {
  run_until(3000000);
  skip_to_temperature();
  skip_frames(2);
  int16_t mean_cC = frame.temperature_cC;
  fake.answering = ALL & ~DISTURBED_BIT;
  skip_frames(2);
  fake.d2[DISTURBED] += 200000; /* some 7 degC */
  skip_to_temperature();
  skip_frames(2);
  TEST_ASSERT_INT16_WITHIN(1, mean_cC, frame.temperature_cC); /* of those that are here */
  fake.answering = ALL;
  do {
    next_frame();
    assert_good_frame(frame.valid);
  } while (frame.valid != ALL);
  TEST_ASSERT_GREATER_THAN_INT16(mean_cC + 30, frame.temperature_cC);
  TEST_ASSERT_EQUAL_INT(0, (int)value_of(&scan.counters.bus_recoveries));

  fake.recovery_is = FT_ERR_STUCK;
  fake.fail_at = 0;
  run_until(now_us + 1000000);
  for (uint8_t k = 0; k < SENSORS; k++) {
    fake.d2[k] -= 200000;
  }
  fake.recovery_is = FT_OK;
  uint64_t freed_us = now_us;
  do {
    next_frame();
    assert_good_frame(frame.valid);
  } while (frame.valid != ALL);
  TEST_ASSERT_LESS_THAN_UINT64(freed_us + 2500000, now_us);
}

/* A sensor with a loose contact, silent for 20 ms ten times a second, must not cost the others more
 * than 5 % of the time for its admissions. */
static void test_flickering_sensor_costs_the_others_little(void) {
  while (now_us < 10000000) {
    fake.answering = now_us % 100000 < 20000 ? ALL & ~DISTURBED_BIT : ALL;
    step();
  }
  const int without = 10000000 / (FAKE_COMMAND_us + FAKE_READ_us + 2278);
  TEST_ASSERT_GREATER_THAN_INT(10, count_entries(0x1E, FAKE_COMMAND));
  TEST_ASSERT_GREATER_THAN_INT(without * 94 / 100, frames);
}

/* Where only a branch acknowledges a command, the reading after one that is missing may be old. */
static void test_single_nacks_cost_the_frames_they_touch(void) {
  for (int single = 0; single < 2; single++) {
    next_case(&usual);
    bus.answers_are_single = single != 0;
    skip_frames(3);
    for (uint32_t n = 1; n < 30; n++) {
      skip_frames(2);
      uint32_t before = value_of(&scan.counters.frames_incomplete);
      fake.answering = ALL & ~DISTURBED_BIT;
      next_frame();
      TEST_ASSERT_EQUAL_HEX32(ALL & ~DISTURBED_BIT, frame.valid);
      fake.answering = ALL;
      skip_frames(4);
      assert_good_frame(ALL);
      TEST_ASSERT_LESS_OR_EQUAL_UINT32(before + (single ? 1 : 2),
                                       value_of(&scan.counters.frames_incomplete));
    }
    TEST_ASSERT_EQUAL_INT(1, count_entries(0x1E, FAKE_COMMAND));
  }
}

/* Three in a row cost the admission, and it comes back at once. */
static void test_silence_for_three_readings_leads_to_a_reset(void) {
  run_until(1000000);
  fake.answering = ALL & ~DISTURBED_BIT;
  skip_frames(2);
  TEST_ASSERT_EQUAL_HEX32(ALL, value_of(&scan.admitted));
  next_frame();
  TEST_ASSERT_EQUAL_HEX32(ALL & ~DISTURBED_BIT, value_of(&scan.admitted));
  fake.answering = ALL;
  skip_frames(2);
  next_frame();
  assert_good_frame(ALL);
  TEST_ASSERT_EQUAL_INT(2, count_entries(0x1E, FAKE_COMMAND));
}

/* It acknowledged the command and has nothing to tell: its supply has failed. */
static void test_zero_after_an_acknowledged_command_leads_to_a_reset(void) {
  bus.answers_are_single = true;
  run_until(1000000);
  fake.zero_next = DISTURBED_BIT;
  next_frame();
  TEST_ASSERT_EQUAL_HEX32(ALL & ~DISTURBED_BIT, value_of(&scan.admitted));
  skip_frames(2);
  TEST_ASSERT_EQUAL_INT(2, count_entries(0x1E, FAKE_COMMAND));
  assert_good_frame(ALL);
}

static void test_timeout_leads_to_recovery_and_admission(void) {
  skip_frames(10);
  int before = fake.logged;
  fake.fail_at = 0;
  skip_frames(3);
  int at = before;
  while (fake.log[at].operation != FAKE_RECOVERY) {
    TEST_ASSERT_LESS_THAN_INT(fake.logged, ++at);
  }
  TEST_ASSERT_EQUAL_INT(FT_ERR_TIMEOUT, fake.log[at - 1].status);
  TEST_ASSERT_GREATER_OR_EQUAL_UINT64(fake.log[at].end_us + fake_conversion_us(0x44),
                                      fake.log[at + 1].start_us);
  assert_entry(assert_admission(at + 1, 1), FAKE_COMMAND, 0x54);
  assert_good_frame(ALL);
  TEST_ASSERT_EQUAL_UINT32(1, value_of(&scan.counters.bus_timeouts));
  TEST_ASSERT_EQUAL_UINT32(1, value_of(&scan.counters.bus_recoveries));
}

static void test_failure_at_any_operation_is_survived(void) {
  static const enum ft_status failures[] = {FT_ERR_TIMEOUT, FT_ERR_STUCK, FT_ERR_ARGUMENT};
  for (int which = 0; which < 3; which++) {
    for (int at = 0; at < 60; at++) {
      next_case(&usual);
      fake.fail_at = at;
      fake.fail_with = failures[which];
      run_until(400000);
      TEST_ASSERT_EQUAL_INT(-1, fake.fail_at);
      assert_good_frame(ALL);
      TEST_ASSERT_EQUAL_INT(2, count_entries(0x1E, FAKE_COMMAND));
      TEST_ASSERT_EQUAL_INT(1, count_entries(0, FAKE_RECOVERY));
    }
  }
}

static void test_stuck_bus_is_tried_ever_more_rarely(void) {
  skip_frames(3);
  fake.recovery_is = FT_ERR_STUCK;
  fake.fail_at = 0;
  run_until(now_us + 5000000);
  TEST_ASSERT_EQUAL_HEX32(0, value_of(&scan.present));
  static const uint64_t delays_ms[] = {10, 20, 40, 80, 160, 320, 640, 1000, 1000};
  int at = find_entry(0, 0, FAKE_RECOVERY);
  for (size_t i = 0; i < sizeof delays_ms / sizeof delays_ms[0]; i++, at++) {
    assert_entry(at + 1, FAKE_RECOVERY, 0);
    TEST_ASSERT_EQUAL_UINT64(delays_ms[i] * 1000, fake.log[at + 1].start_us - fake.log[at].end_us);
  }
  fake.recovery_is = FT_OK;
  run_until(now_us + 1100000);
  assert_good_frame(ALL);
  TEST_ASSERT_EQUAL_HEX32(ALL, value_of(&scan.present));
  /* Freed once, the next time begins with the short delay. */
  fake.recovery_is = FT_ERR_STUCK;
  fake.fail_at = 0;
  at = fake.logged;
  run_until(now_us + 50000);
  at = find_entry(at, 0, FAKE_RECOVERY);
  TEST_ASSERT_EQUAL_UINT64(10000, fake.log[at + 1].start_us - fake.log[at].end_us);
}

/* Recovery itself may run into a timeout: not for the bus to spin on. */
static void test_failing_recoveries_are_bounded(void) {
  skip_frames(3);
  fake.recovery_is = FT_ERR_TIMEOUT;
  fake.fail_at = 0;
  run_until(now_us + 1000000);
  fake.recovery_is = FT_OK;
  run_until(now_us + 1100000);
  assert_good_frame(ALL);
}

static void test_refused_starts_are_survived(void) {
  skip_frames(3);
  fake.refuse_starts = true;
  run_until(now_us + 1000000);
  fake.refuse_starts = false;
  run_until(now_us + 200000);
  assert_good_frame(ALL);
}

static void test_twenty_hertz_without_drift(void) {
  struct scan_settings settings = usual;
  settings.rate_mHz = 20000;
  next_case(&settings);
  skip_frames(2); /* the first comes as soon as the sensors are up */
  uint64_t first_us = frame.t_begin_us;
  for (uint64_t i = 1; i < 2000; i++) {
    next_frame();
    TEST_ASSERT_EQUAL_UINT64(first_us + 50000 * i, frame.t_begin_us);
    TEST_ASSERT_EQUAL_UINT32(1 + i, frame.number);
  }
}

/* Wake-ups that come late delay their own frame and no other. */
static void test_late_wake_ups_do_not_add_up(void) {
  struct scan_settings settings = usual;
  settings.rate_mHz = 20000;
  next_case(&settings);
  lateness_us = 300;
  for (uint64_t i = 1; i < 2000; i++) {
    next_frame();
    if (i > 1) {
      TEST_ASSERT_UINT64_WITHIN(150, 50000 * (i - 1) + 150, frame.t_begin_us);
    }
  }
}

/* Beyond what the sensors can do the rate is theirs, and a pause is not made up for afterwards. */
static void test_rate_beyond_the_sensors(void) {
  struct scan_settings settings = usual;
  settings.osr = 8192;
  settings.rate_mHz = 2000000;
  next_case(&settings);
  run_until(1000000);
  TEST_ASSERT_INT_WITHIN(3, 45, frames); /* 21.05 ms each, some for the start and temperatures */

  settings = usual;
  settings.rate_mHz = 20000;
  next_case(&settings);
  skip_frames(3);
  taking = false;
  run_until(now_us + 1000000);
  taking = true;
  skip_frames(2);
  uint64_t last_us = frame.t_begin_us;
  for (int i = 0; i < 10; i++) {
    next_frame();
    TEST_ASSERT_EQUAL_UINT64(50000, frame.t_begin_us - last_us);
    last_us = frame.t_begin_us;
  }
}

static void test_rate_changes(void) {
  skip_frames(3);
  scan_set_rate_mHz(&scan, 100000);
  skip_frames(3);
  uint64_t last_us = frame.t_begin_us;
  next_frame();
  TEST_ASSERT_EQUAL_UINT64(10000, frame.t_begin_us - last_us);
  scan_set_rate_mHz(&scan, 0);
  skip_frames(3);
  last_us = frame.t_begin_us;
  next_frame();
  TEST_ASSERT_LESS_THAN_UINT64(6000, frame.t_begin_us - last_us);
}

/* One frame in ten seconds must not keep a new rate waiting for ten seconds. */
static void test_raised_rate_does_not_wait_for_the_old_period(void) {
  struct scan_settings settings = usual;
  settings.rate_mHz = 100;
  next_case(&settings);
  skip_frames(1);
  run_until(1000000);
  scan_set_rate_mHz(&scan, 20000);
  uint64_t asked_us = 1000000;
  next_frame();
  TEST_ASSERT_LESS_THAN_UINT64(asked_us + 20000, frame.t_begin_us);
  uint64_t last_us = frame.t_begin_us;
  next_frame();
  TEST_ASSERT_EQUAL_UINT64(50000, frame.t_begin_us - last_us);
}

static void test_osr_changes_between_frames(void) {
  TEST_ASSERT_EQUAL_INT(FT_ERR_ARGUMENT, scan_set_osr(&scan, 1023));
  skip_frames(3);
  while (scan.state != SCAN_WAIT_CONVERSION || scan.conversion->is_temperature) {
    step();
  }
  /* During a conversion: it ends as it began, and the frame says so. */
  TEST_ASSERT_EQUAL_INT(FT_OK, scan_set_osr(&scan, 8192));
  next_frame();
  TEST_ASSERT_EQUAL_INT32(ms58xx_find_osr(1024)->noise_Pa_q10, frame.noise_Pa_q10);
  next_frame();
  TEST_ASSERT_EQUAL_INT32(ms58xx_find_osr(8192)->noise_Pa_q10, frame.noise_Pa_q10);
  TEST_ASSERT_EQUAL_INT(FT_OK, scan_set_osr(&scan, 256));
  skip_frames(2);
  TEST_ASSERT_EQUAL_INT32(ms58xx_find_osr(256)->noise_Pa_q10, frame.noise_Pa_q10);
  assert_good_frame(ALL);
}

/* A processor that falls behind gets the newest frame, each one it missed is counted, and the
 * conversions keep their time. */
static void test_frames_that_nobody_takes_are_counted(void) {
  skip_frames(3);
  uint64_t first_us = frame.t_us;
  uint32_t first = frame.number;
  next_frame();
  uint64_t period_us = frame.t_us - first_us;
  taking = false;
  run_until(now_us + 300000);
  taking = true;
  next_frame();
  TEST_ASSERT_GREATER_THAN_UINT32(first + 50, frame.number);
  TEST_ASSERT_EQUAL_UINT64(first_us + (frame.number - first) * period_us, frame.t_us);
  TEST_ASSERT_EQUAL_UINT32(frame.number - first - 2, value_of(&scan.counters.frames_skipped));
  TEST_ASSERT_LESS_THAN_UINT64(2 * period_us, now_us - frame.t_us);
  TEST_ASSERT_FALSE(scan_take(&scan, &frame));
  uint32_t skipped = value_of(&scan.counters.frames_skipped);
  skip_frames(20);
  TEST_ASSERT_EQUAL_UINT32(skipped, value_of(&scan.counters.frames_skipped));
}

/* Frames and temperatures that wait are taken in the order in which they were measured, and no PROM
 * changes under a temperature that waits. */
static void test_a_temperature_waits_for_the_processor(void) {
  skip_frames(3);
  uint32_t frames_before = frame.number + 1;
  taking = false;
  skip_to_temperature();
  fake.d2[DISTURBED] += 20000;
  run_until(now_us + 3000);
  fake.d2[DISTURBED] -= 20000;
  run_until(now_us + 600000); /* the next temperature finds its slot full */
  fake.answering = ALL & ~DISTURBED_BIT;
  run_until(now_us + 20000);
  fake.answering = ALL;
  run_until(now_us + 3000000);
  TEST_ASSERT_EQUAL_INT(1, count_entries(0x1E, FAKE_COMMAND));
  taking = true;
  next_frame();
  TEST_ASSERT_TRUE(frame.held);
  uint32_t number = frame.number;
  next_frame();
  TEST_ASSERT_FALSE(frame.held);
  TEST_ASSERT_GREATER_THAN_UINT32(number, frame.number);
  TEST_ASSERT_EQUAL_UINT32(frame.number + 1 - frames_before - 2,
                           value_of(&scan.counters.frames_skipped));
  run_until(now_us + 2000000);
  TEST_ASSERT_EQUAL_INT(2, count_entries(0x1E, FAKE_COMMAND));
  assert_good_frame(ALL);
}

/* What a sensor that lost count of the clocks sends ends in ones. A pressure of all ones that comes
 * again is beyond what the sensor can say, which is a measurement. */
static void test_readings_that_break_off_are_invalid(void) {
  bus.answers_are_single = true;
  skip_frames(3);
  uint32_t d1[SENSORS];
  memcpy(d1, fake.d1, sizeof d1);
  fake.d1[DISTURBED] = (d1[DISTURBED] & 0xFF0000) | 0xFFFF;
  next_frame();
  TEST_ASSERT_EQUAL_HEX32(ALL & ~DISTURBED_BIT, frame.valid);
  TEST_ASSERT_EQUAL_UINT32(1, value_of(&scan.counters.bus_nacks));
  next_frame();
  TEST_ASSERT_EQUAL_HEX32(ALL & ~DISTURBED_BIT, frame.valid);
  TEST_ASSERT_EQUAL_UINT32(2, value_of(&scan.counters.bus_nacks));
  fake.d1[DISTURBED] -= 1000;
  next_frame();
  assert_good_frame(ALL);
  fake.d1[DISTURBED] += 1000; /* by chance */
  next_frame();
  assert_good_frame(ALL);
  fake.d1[DISTURBED] = d1[DISTURBED];
  for (int k = 0; k < 3; k++) {
    fake.d1[k] |= 0xFF; /* by chance */
  }
  next_frame();
  assert_good_frame(ALL);
  fake.d1[10] |= 0xFF;
  next_frame();
  TEST_ASSERT_EQUAL_HEX32(ALL & ~0x407u, frame.valid);
  TEST_ASSERT_EQUAL_UINT32(6, value_of(&scan.counters.bus_nacks));
  for (int k = 0; k < SENSORS; k++) {
    fake.d1[k] = 0xFFFFFF;
  }
  next_frame();
  TEST_ASSERT_EQUAL_HEX32(0, frame.valid);
  next_frame();
  TEST_ASSERT_EQUAL_HEX32(ALL, frame.valid);
  TEST_ASSERT_EQUAL_HEX32(ALL, frame.saturated);
}

/* A sensor that hears no command to read sends ones, and has its result still: the next one may be
 * that. */
static void test_ones_of_a_branch_void_the_next_reading_too(void) {
  skip_frames(3);
  uint32_t d1 = fake.d1[DISTURBED];
  fake.d1[DISTURBED] = 0xFFFFFF;
  next_frame();
  assert_good_frame(ALL & ~DISTURBED_BIT);
  fake.d1[DISTURBED] = d1;
  next_frame();
  assert_good_frame(ALL & ~DISTURBED_BIT);
  next_frame();
  assert_good_frame(ALL);
}

/* Events that come early or for nothing change nothing. */
static void test_spurious_calls_change_nothing(void) {
  struct random random = {32};
  while (now_us < 500000) {
    uint64_t wake_us = scan_step(&scan, now_us);
    if (scan_take(&scan, &frame)) {
      frames++;
      assert_good_frame(ALL);
    }
    now_us += 1 + random_below(&random, 100);
    now_us = now_us > wake_us + 30 ? wake_us + 30 : now_us;
  }
  TEST_ASSERT_GREATER_THAN_INT(80, frames);
  TEST_ASSERT_EQUAL_INT(1, count_entries(0x1E, FAKE_COMMAND));
}

static void test_random_faults_are_survived(void) {
  for (uint64_t seed = 1; seed <= 20; seed++) {
    next_case(&usual);
    struct random random = {seed};
    int steps = 0;
    while (now_us < 5000000) {
      switch (random_below(&random, 400)) {
      case 0:
        fake.answering = random_u32(&random) & ALL;
        break;
      case 1:
        fake.zero_next = random_u32(&random) & ALL;
        break;
      case 2:
        fake.fail_at = (int)random_below(&random, 10);
        fake.fail_with = random_below(&random, 2) ? FT_ERR_TIMEOUT : FT_ERR_STUCK;
        break;
      case 3:
        fake.recovery_is = random_below(&random, 2) ? FT_OK : FT_ERR_STUCK;
        break;
      case 4:
        taking = random_below(&random, 2);
        break;
      case 5:
        scan_set_rate_mHz(&scan, random_below(&random, 2000001));
        break;
      case 6:
        TEST_ASSERT_EQUAL_INT(FT_OK,
                              scan_set_osr(&scan, (uint16_t)(256u << random_below(&random, 6))));
        break;
      case 7:
        fake.misread_prom = random_u32(&random) & ALL;
        fake.misread_passes = (int)random_below(&random, 4);
        break;
      default:
        break;
      }
      step();
      steps++;
    }
    TEST_ASSERT_LESS_THAN_INT(5 * 20000 + 1000, steps); /* at most one call in 50 us */
    fake.answering = ALL;
    fake.fail_at = -1;
    fake.recovery_is = FT_OK;
    fake.misread_passes = 0;
    taking = true;
    scan_set_rate_mHz(&scan, 0);
    run_until(now_us + 20000000);
    assert_good_frame(ALL);
  }
}

static void test_one_and_thirty_two_sensors(void) {
  struct scan_settings settings = usual;
  settings.sensor_count = 1;
  next_case(&settings);
  skip_frames(3);
  TEST_ASSERT_EQUAL_HEX32(1, frame.valid);
  settings.sensor_count = 32;
  next_case(&settings);
  skip_frames(3);
  TEST_ASSERT_EQUAL_HEX32(UINT32_MAX, frame.valid);
  TEST_ASSERT_EQUAL_INT32(expected_Pa_q10(31), frame.pressure_Pa_q10[31]);
}

/* What is under way ends first; nothing begins before the end of the rest is noticed. */
static void test_a_scan_that_rests_leaves_the_bus_alone(void) {
  skip_frames(3);
  TEST_ASSERT_FALSE(scan_rests(&scan));
  scan_rest(&scan, true);
  for (int steps = 0; !scan_rests(&scan); steps++) {
    TEST_ASSERT_LESS_THAN(20, steps);
    step();
  }
  TEST_ASSERT_FALSE(fake.running);
  const int logged = fake.logged;
  run_until(now_us + 500000);
  TEST_ASSERT_TRUE(scan_rests(&scan));
  TEST_ASSERT_EQUAL(logged, fake.logged);
  scan_rest(&scan, false);
  const uint64_t until_us = now_us + 10000;
  while (scan_rests(&scan)) {
    TEST_ASSERT_LESS_OR_EQUAL_UINT64(until_us, now_us);
    step();
  }
  skip_frames(3);
}

static void test_a_scan_that_rests_from_its_start_resets_nobody(void) {
  scan_rest(&scan, true);
  run_until(500000);
  TEST_ASSERT_TRUE(scan_rests(&scan));
  TEST_ASSERT_EQUAL(0, fake.logged);
  scan_rest(&scan, false);
  skip_frames(3);
}

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(test_settings_outside_their_range);
  RUN_TEST(test_start_up_sequence);
  RUN_TEST(test_frame_contents);
  RUN_TEST(test_saturation_is_reported_at_the_end_of_the_range);
  RUN_TEST(test_waits_at_every_osr);
  RUN_TEST(test_prom_misread_once_is_read_again);
  RUN_TEST(test_prom_with_differing_crc_is_used_and_reported);
  RUN_TEST(test_prom_misread_in_a_whole_admission_is_read_again);
  RUN_TEST(test_who_did_not_hear_the_reset_is_not_admitted);
  RUN_TEST(test_temperature_that_is_asked_for_comes_soon);
  RUN_TEST(test_prom_that_makes_a_sensor_stand_apart_is_not_used);
  RUN_TEST(test_blank_prom_is_not_admitted_and_asked_ever_more_rarely);
  RUN_TEST(test_nobody_answers);
  RUN_TEST(test_zero_reading_voids_the_next_one_too);
  RUN_TEST(test_zeros_for_ever_do_not_wedge);
  RUN_TEST(test_two_zeros_in_a_row_lead_to_a_reset);
  RUN_TEST(test_what_was_missed_before_a_reset_does_not_count_after_it);
  RUN_TEST(test_temperature_of_all_ones_is_no_reading);
  RUN_TEST(test_zero_temperature_keeps_the_last_and_is_repeated_soon);
  RUN_TEST(test_jump_of_the_temperature_must_be_confirmed);
  RUN_TEST(test_sensor_that_tells_another_temperature_is_reset);
  RUN_TEST(test_sensor_that_loses_its_state_again_amid_a_reset_is_reset_again);
  RUN_TEST(test_incurable_sensor_is_reset_ever_more_rarely);
  RUN_TEST(test_temperature_takes_the_place_of_a_frame);
  RUN_TEST(test_temperature_is_read_less_often_while_it_stands_still);
  RUN_TEST(test_temperature_fits_into_the_pauses);
  RUN_TEST(test_sensor_stops_and_comes_back);
  RUN_TEST(test_replaced_sensor_waits_for_its_own_temperature);
  RUN_TEST(test_sensor_that_was_away_gets_a_new_temperature);
  RUN_TEST(test_flickering_sensor_costs_the_others_little);
  RUN_TEST(test_single_nacks_cost_the_frames_they_touch);
  RUN_TEST(test_silence_for_three_readings_leads_to_a_reset);
  RUN_TEST(test_zero_after_an_acknowledged_command_leads_to_a_reset);
  RUN_TEST(test_timeout_leads_to_recovery_and_admission);
  RUN_TEST(test_failure_at_any_operation_is_survived);
  RUN_TEST(test_stuck_bus_is_tried_ever_more_rarely);
  RUN_TEST(test_failing_recoveries_are_bounded);
  RUN_TEST(test_refused_starts_are_survived);
  RUN_TEST(test_twenty_hertz_without_drift);
  RUN_TEST(test_late_wake_ups_do_not_add_up);
  RUN_TEST(test_rate_beyond_the_sensors);
  RUN_TEST(test_rate_changes);
  RUN_TEST(test_raised_rate_does_not_wait_for_the_old_period);
  RUN_TEST(test_osr_changes_between_frames);
  RUN_TEST(test_frames_that_nobody_takes_are_counted);
  RUN_TEST(test_a_temperature_waits_for_the_processor);
  RUN_TEST(test_readings_that_break_off_are_invalid);
  RUN_TEST(test_ones_of_a_branch_void_the_next_reading_too);
  RUN_TEST(test_spurious_calls_change_nothing);
  RUN_TEST(test_random_faults_are_survived);
  RUN_TEST(test_one_and_thirty_two_sensors);
  RUN_TEST(test_a_scan_that_rests_leaves_the_bus_alone);
  RUN_TEST(test_a_scan_that_rests_from_its_start_resets_nobody);
  return UNITY_END();
}
