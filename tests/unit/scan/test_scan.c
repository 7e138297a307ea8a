#include "scan_bench.h"

TEST(test_settings_outside_their_range) {
  struct scan_settings settings = usual;
  settings.sensor_count = 0;
  TEST_ASSERT_EQUAL_INT(FT_ERR_ARGUMENT, scan_init(&scan, &bus, &settings));
  settings.sensor_count = FT_MAX_SENSORS + 1;
  TEST_ASSERT_EQUAL_INT(FT_ERR_ARGUMENT, scan_init(&scan, &bus, &settings));
  settings = usual;
  settings.osr = 1000;
  TEST_ASSERT_EQUAL_INT(FT_ERR_ARGUMENT, scan_init(&scan, &bus, &settings));
}

TEST(test_frame_contents) {
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

TEST(test_saturation_is_reported_at_the_end_of_the_range) {
  next_frame();
  fake.frozen = DISTURBED_BIT;
  uint32_t low = 0;
  uint32_t high = 0xFFFFFF;
  while (high - low > 1) { /* the greatest code that passes */
    fake.d1[DISTURBED] = (low + high) / 2;
    *(expected_Pa_q10(DISTURBED) > MS58XX_MAX_PRESSURE_Pa * 1024 ? &high : &low) = fake.d1[DISTURBED];
  }
  fake.d1[DISTURBED] = low;
  skip_frames(2);
  TEST_ASSERT_EQUAL_HEX32(0, frame.saturated);
  fake.d1[DISTURBED] = high;
  skip_frames(2);
  TEST_ASSERT_EQUAL_HEX32(DISTURBED_BIT, frame.saturated);
  assert_good_frame(ALL);
}

/* The fake counts as misuse what comes before the datasheet's longest times; here: not much later. */
TEST(test_waits_at_every_osr) {
  for (int i = 0; i < 6; i++) {
    next_case_of((uint16_t)(256 << i), 0);
    run_until(1200000);
    TEST_ASSERT_EQUAL_INT(3, count_entries((uint8_t)(0x50 + 2 * i), FAKE_COMMAND));
    for (int at = 0; at + 1 < fake.logged; at++) {
      const struct fake_entry *entry = &fake.log[at];
      uint64_t wait_us = fake.log[at + 1].start_us - entry->end_us;
      if (entry->operation == FAKE_COMMAND && entry->command != 0x1E) {
        uint32_t longest_us = fake_conversion_us(entry->command);
        TEST_ASSERT_EQUAL_HEX8(2 * i, entry->command & 0x0F);
        TEST_ASSERT_GREATER_OR_EQUAL_UINT64(longest_us, wait_us);
        TEST_ASSERT_GREATER_OR_EQUAL_UINT64(longest_us + longest_us / 20 - FAKE_READ_LEAD_us, wait_us);
        TEST_ASSERT_LESS_OR_EQUAL_UINT64(longest_us + longest_us / 10, wait_us);
      } else if (entry->command == 0x1E) {
        TEST_ASSERT_GREATER_OR_EQUAL_UINT64(2800, wait_us);
        TEST_ASSERT_LESS_OR_EQUAL_UINT64(6000, wait_us);
      }
    }
  }
}

/* Without drift; wake-ups that come late delay their own frame and no other. The first comes as soon as the sensors are up. */
TEST(test_twenty_hertz) {
  for (int late = 0; late < 2; late++) {
    next_case_of(1024, 20000);
    lateness_us = late ? 300 : 0;
    skip_frames(2);
    const uint64_t first_us = late ? 0 : frame.t_begin_us, within_us = late ? 150 : 0;
    for (uint64_t i = 1; i < 2000; i++) {
      next_frame();
      TEST_ASSERT_UINT64_WITHIN(within_us, first_us + 50000 * (i + (uint64_t)late) + within_us, frame.t_begin_us);
      TEST_ASSERT_EQUAL_UINT32(1 + i, frame.number);
    }
  }
}

/* Beyond what the sensors can do the rate is theirs, and a pause is not made up for afterwards. */
TEST(test_rate_beyond_the_sensors) {
  next_case_of(8192, 2000000);
  run_until(1000000);
  TEST_ASSERT_INT_WITHIN(3, 45, frames); /* 21.05 ms each, some for the start and temperatures */

  next_case_of(1024, 20000);
  skip_frames(3);
  taking = false;
  run_until(now_us + 1000000);
  taking = true;
  skip_frames(2);
  for (int i = 0; i < 10; i++) {
    TEST_ASSERT_EQUAL_UINT64(50000, next_period_us());
  }
}

/* One frame in ten seconds must not keep a new rate waiting for ten seconds. */
TEST(test_rate_changes) {
  next_case_of(1024, 100);
  skip_frames(1);
  run_until(1000000);
  scan_set_rate_mHz(&scan, 20000);
  next_frame();
  TEST_ASSERT_LESS_THAN_UINT64(1020000, frame.t_begin_us);
  TEST_ASSERT_EQUAL_UINT64(50000, next_period_us());
  scan_set_rate_mHz(&scan, 0);
  skip_frames(3);
  TEST_ASSERT_LESS_THAN_UINT64(6000, next_period_us());
}

TEST(test_osr_changes_between_frames) {
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

/* A processor that falls behind gets the newest frame, each one it missed is counted, and the conversions keep their time. */
TEST(test_frames_that_nobody_takes_are_counted) {
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
TEST(test_a_temperature_waits_for_the_processor) {
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
  TEST_ASSERT_EQUAL_UINT32(frame.number + 1 - frames_before - 2, value_of(&scan.counters.frames_skipped));
  run_until(now_us + 2000000);
  TEST_ASSERT_EQUAL_INT(2, count_entries(0x1E, FAKE_COMMAND));
  assert_good_frame(ALL);
}

TEST(test_one_and_most_sensors) {
  struct scan_settings settings = usual;
  settings.sensor_count = 1;
  next_case(&settings);
  skip_frames(3);
  TEST_ASSERT_EQUAL_HEX32(1, frame.valid);
  settings.sensor_count = FT_MAX_SENSORS;
  next_case(&settings);
  skip_frames(3);
  TEST_ASSERT_EQUAL_HEX64(first_sensors(FT_MAX_SENSORS), frame.valid);
  TEST_ASSERT_EQUAL_HEX64(frame.valid, scan_read_map(&scan.present));
  TEST_ASSERT_EQUAL_INT32(expected_Pa_q10(35), frame.pressure_Pa_q10[35]);
}

/* What is under way ends first; nothing begins before the end of the rest is noticed. */
TEST(test_a_scan_that_rests_leaves_the_bus_alone) {
  scan_rest(&scan, true); /* from the start: it resets nobody */
  run_until(500000);
  TEST_ASSERT_TRUE(scan_rests(&scan));
  TEST_ASSERT_EQUAL(0, fake.logged);
  scan_rest(&scan, false);
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
