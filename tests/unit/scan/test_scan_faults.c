#include "scan_bench.h"

#include <string.h>

/* A sensor that hears no command to read sends ones, and has its result still: the next one may be that. One that hears none to
 * convert has none. */
TEST(test_zeros_and_ones_void_the_next_reading_too) {
  for (int ones = 0; ones < 2; ones++) {
    next_case(&usual);
    skip_frames(5);
    const uint32_t d1 = fake.d1[DISTURBED];
    fake.d1[DISTURBED] = ones ? 0xFFFFFF : d1;
    fake.zero_next = ones ? 0 : DISTURBED_BIT;
    next_frame();
    assert_good_frame(ALL & ~DISTURBED_BIT);
    TEST_ASSERT_EQUAL_HEX32(ones ? 0 : ALL & ~DISTURBED_BIT, frame.doubtful);
    fake.d1[DISTURBED] = d1;
    next_frame();
    assert_good_frame(ALL & ~DISTURBED_BIT);
    skip_frames(ones ? 1 : 2); /* after a zero, a temperature */
    assert_good_frame(ALL);
    TEST_ASSERT_EQUAL_HEX32(0, frame.doubtful);
    TEST_ASSERT_EQUAL_INT(1, count_entries(0x1E, FAKE_COMMAND)); /* no reason for a reset */
  }
}

/* The frame that has the zero gives way to the next one. */
TEST(test_a_zero_in_a_frame_that_was_not_taken_asks_for_a_temperature) {
  skip_frames(5);
  taking = false;
  fake.zero_next = DISTURBED_BIT;
  run_until(now_us + 11000);
  taking = true;
  skip_frames(3); /* the last one, the one that runs, and the temperature */
  TEST_ASSERT_TRUE(frame.held);
}

/* Some have lost a conversion, or have had the same code six times. */
TEST(test_sensors_that_read_zero_or_never_change_are_reset_at_once) {
  for (int i = 0; i < 4; i++) {
    const uint32_t struck = i < 2 ? DISTURBED_BIT | 1u : DISTURBED_BIT, frozen = i % 2 != 0;
    next_case(&usual);
    bus.answers_are_single = i >= 2;
    skip_frames(5);
    fake.frozen = frozen ? struck : 0;
    skip_frames(frozen ? 5 : 0);
    assert_good_frame(ALL);
    TEST_ASSERT_EQUAL_INT(1, count_entries(0x1E, FAKE_COMMAND));
    fake.zero_next = frozen ? 0 : struck;
    next_frame();
    assert_good_frame(ALL & ~struck);
    TEST_ASSERT_EQUAL_HEX32(ALL & ~struck, frame.doubtful); /* the others may share their supply */
    fake.frozen = 0;
    skip_frames(2); /* the first ran already */
    assert_good_frame(ALL);
    TEST_ASSERT_EQUAL_HEX32(0, frame.doubtful);
    TEST_ASSERT_EQUAL_INT(2, count_entries(0x1E, FAKE_COMMAND));
  }
}

/* A sensor that missed two reads before all were reset restarts: one more does not cost its admission, as the third in a row would. */
TEST(test_what_was_missed_before_a_reset_does_not_count_after_it) {
  const uint32_t others = 3u << (SENSORS - 2);
  run_until(3000000);
  fake.answering = ALL & ~DISTURBED_BIT;
  next_frame();
  fake.zero_next = others;
  next_frame();
  TEST_ASSERT_EQUAL_HEX32(ALL & ~others, scan_read_map(&scan.admitted));
  fake.answering = ALL;
  while (count_entries(0x1E, FAKE_COMMAND) < 2 || scan.state != SCAN_WAIT_CONVERSION) {
    step();
  }
  TEST_ASSERT_EQUAL_HEX32(ALL, scan_read_map(&scan.admitted));
  fake.answering = ALL & ~DISTURBED_BIT;
  next_frame();
  TEST_ASSERT_EQUAL_HEX32(ALL, scan_read_map(&scan.admitted));
}

/* Minutes may have passed, and the pad be warmer: no frame is computed with what was before. */
TEST(test_sensor_that_was_away_gets_a_new_temperature) {
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
TEST(test_flickering_sensor_costs_the_others_little) {
  while (now_us < 10000000) {
    fake.answering = now_us % 100000 < 20000 ? ALL & ~DISTURBED_BIT : ALL;
    step();
  }
  const int without = 10000000 / (FAKE_COMMAND_us + FAKE_READ_us + 2278);
  TEST_ASSERT_GREATER_THAN_INT(9, count_entries(0x1E, FAKE_COMMAND));
  TEST_ASSERT_GREATER_THAN_INT(without * 94 / 100, frames);
}

/* Where only a branch acknowledges a command, the reading after one that is missing may be old. */
TEST(test_single_nacks_cost_the_frames_they_touch) {
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
      TEST_ASSERT_LESS_OR_EQUAL_UINT32(before + (single ? 1 : 2), value_of(&scan.counters.frames_incomplete));
    }
    TEST_ASSERT_EQUAL_INT(1, count_entries(0x1E, FAKE_COMMAND));
  }
}

TEST(test_timeout_leads_to_recovery_and_admission) {
  skip_frames(10);
  int before = fake.logged;
  fake.fail_at = 0;
  skip_frames(3);
  int at = before;
  while (fake.log[at].operation != FAKE_RECOVERY) {
    TEST_ASSERT_LESS_THAN_INT(fake.logged, ++at);
  }
  TEST_ASSERT_EQUAL_INT(FT_ERR_TIMEOUT, fake.log[at - 1].status);
  TEST_ASSERT_GREATER_OR_EQUAL_UINT64(fake.log[at].end_us + fake_conversion_us(0x44), fake.log[at + 1].start_us);
  assert_entry(assert_admission(at + 1, 1), FAKE_COMMAND, 0x54);
  assert_good_frame(ALL);
  TEST_ASSERT_EQUAL_UINT32(1, value_of(&scan.counters.bus_timeouts));
  TEST_ASSERT_EQUAL_UINT32(1, value_of(&scan.counters.bus_recoveries));
}

TEST(test_stuck_bus_is_tried_ever_more_rarely) {
  skip_frames(3);
  fake.recovery_is = FT_ERR_STUCK;
  fake.fail_at = 0;
  run_until(now_us + 5000000);
  TEST_ASSERT_EQUAL_HEX32(0, scan_read_map(&scan.present));
  static const uint64_t delays_ms[] = {10, 20, 40, 80, 160, 320, 640, 1000, 1000};
  int at = find_entry(0, 0, FAKE_RECOVERY);
  for (size_t i = 0; i < sizeof delays_ms / sizeof delays_ms[0]; i++, at++) {
    assert_entry(at + 1, FAKE_RECOVERY, 0);
    TEST_ASSERT_EQUAL_UINT64(delays_ms[i] * 1000, fake.log[at + 1].start_us - fake.log[at].end_us);
  }
  fake.recovery_is = FT_OK;
  run_until(now_us + 1100000);
  assert_good_frame(ALL);
  TEST_ASSERT_EQUAL_HEX32(ALL, scan_read_map(&scan.present));
  /* Freed once, the next time begins with the short delay. */
  fake.recovery_is = FT_ERR_STUCK;
  fake.fail_at = 0;
  at = fake.logged;
  run_until(now_us + 50000);
  at = find_entry(at, 0, FAKE_RECOVERY);
  TEST_ASSERT_EQUAL_UINT64(10000, fake.log[at + 1].start_us - fake.log[at].end_us);
}

/* Zeros, failing recoveries (not for the bus to spin on), refused starts: for a while, all the time. */
TEST(test_faults_that_last_do_not_wedge) {
  for (int kind = 0; kind < 3; kind++) {
    next_case(&usual);
    skip_frames(3);
    for (int i = 0; kind == 0 && i < 1000; i++) {
      fake.zero_next = ALL;
      next_frame();
      TEST_ASSERT_EQUAL_HEX32(0, frame.valid);
    }
    fake.recovery_is = kind == 1 ? FT_ERR_TIMEOUT : FT_OK;
    fake.fail_at = kind == 1 ? 0 : -1;
    fake.refuse_starts = kind == 2;
    run_until(now_us + (kind == 0 ? 0 : 1000000));
    fake.recovery_is = FT_OK;
    fake.refuse_starts = false;
    run_until(now_us + 1100000);
    assert_good_frame(ALL);
  }
}

/* What a sensor that lost count of the clocks sends ends in ones. A pressure of all ones that comes
 * again is beyond what the sensor can say, which is a measurement. */
TEST(test_readings_that_break_off_are_invalid) {
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

/* Events that come early or for nothing change nothing. */
TEST(test_spurious_calls_change_nothing) {
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

TEST(test_random_faults_are_survived) {
  for (uint64_t seed = 1; seed <= 20; seed++) {
    next_case(&usual);
    struct random random = {seed};
    int steps = 0;
    while (now_us < 5000000) {
      switch (random_below(&random, 400)) {
      case 0: fake.answering = random_u32(&random) & ALL; break;
      case 1: fake.zero_next = random_u32(&random) & ALL; break;
      case 2:
        fake.fail_at = (int)random_below(&random, 10);
        fake.fail_with = random_below(&random, 2) ? FT_ERR_TIMEOUT : FT_ERR_STUCK;
        break;
      case 3: fake.recovery_is = random_below(&random, 2) ? FT_OK : FT_ERR_STUCK; break;
      case 4: taking = random_below(&random, 2); break;
      case 5: scan_set_rate_mHz(&scan, random_below(&random, 2000001)); break;
      case 6: TEST_ASSERT_EQUAL_INT(FT_OK, scan_set_osr(&scan, (uint16_t)(256u << random_below(&random, 6)))); break;
      case 7:
        fake.misread_prom = random_u32(&random) & ALL;
        fake.misread_passes = (int)random_below(&random, 4);
        break;
      default: break;
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
