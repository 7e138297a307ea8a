#include "scan_bench.h"

#include <string.h>

TEST(test_a_temperature_of_zero_or_ones_keeps_the_last) {
  for (int ones = 0; ones < 2; ones++) {
    next_case(&usual);
    next_frame();
    skip_to_temperature();
    const uint32_t d2 = fake.d2[DISTURBED];
    fake.zero_next = ones ? 0 : DISTURBED_BIT;
    fake.d2[DISTURBED] = ones ? 0xFFFFFF : d2;
    next_frame();
    TEST_ASSERT_TRUE(frame.held);
    fake.d2[DISTURBED] = d2;
    next_frame();
    TEST_ASSERT_EQUAL_HEX32(ALL & ~DISTURBED_BIT, frame.valid);
    next_frame();
    assert_good_frame(ALL);
    TEST_ASSERT_EQUAL_INT(1, count_entries(0x1E, FAKE_COMMAND));
  }
}

/* At 0.1 Hz the pad may warm by more than a degree from one temperature to the next. */
TEST(test_all_sensors_may_be_warmer_after_long) {
  next_case_of(1024, 100);
  run_until(25000000);
  for (uint8_t k = 0; k < SENSORS; k++) {
    fake.d2[k] += 60000; /* 2 degC */
  }
  run_until(now_us + 25000000);
  assert_good_frame(ALL);
  TEST_ASSERT_EQUAL_INT(1, count_entries(0x1E, FAKE_COMMAND));
}

/* With a data line for each sensor, a temperature that a move asks for comes 24 ms after the last one, and before any frame is in doubt. */
TEST(test_a_pad_that_warms_while_pressures_move_is_neither_reset_nor_doubted) {
  next_case_of(256, 0);
  fake.read_us = 100;
  const uint32_t d2 = fake.d2[0];
  int doubtful = 0, held = 0;
  while (now_us < 10000000) {
    next_frame();
    doubtful += frame.doubtful != 0;
    held += frame.held;
    for (uint8_t k = 0; k < SENSORS; k++) {
      fake.d1[k] += frame.number / 128 % 2 ? 1000u : -1000u;
      fake.d2[k] = d2 + (uint32_t)(now_us * 3 / 1000); /* 0.1 degC/s */
    }
  }
  TEST_ASSERT_EQUAL_INT(0, doubtful);
  TEST_ASSERT_GREATER_THAN_INT(300, held);
  TEST_ASSERT_EQUAL_INT(1, count_entries(0x1E, FAKE_COMMAND));
}

/* Where a branch acknowledges as one, it is no reason for a reset. Where each sensor does, resets that do not help get rare. */
TEST(test_a_temperature_that_is_always_zero_costs_few_frames) {
  for (int single = 0; single < 2; single++) {
    next_case(&usual);
    bus.answers_are_single = single != 0;
    run_until(1000000);
    fake.d2[DISTURBED] = 0;
    int all = 0, good = 0;
    for (; now_us < 20000000; all++) {
      next_frame();
      good += (frame.valid & ~frame.doubtful & ~DISTURBED_BIT) == (ALL & ~DISTURBED_BIT);
    }
    TEST_ASSERT_GREATER_THAN_INT(all * 98 / 100, good);
  }
}

/* Two temperatures that agree with each other and with no other sensor: it has lost its state. Its reset makes it the sensor it was. */
TEST(test_sensor_that_tells_another_temperature_is_reset) {
  run_until(3000000);
  skip_to_temperature();
  fake.d2[DISTURBED] ^= 0x80000;
  next_frame();
  TEST_ASSERT_TRUE(frame.held);
  while (count_entries(0x1E, FAKE_COMMAND) == 1) {
    TEST_ASSERT_FALSE(frame.valid & ~frame.doubtful & DISTURBED_BIT); /* also of the held frame */
    next_frame();
  }
  fake.d2[DISTURBED] ^= 0x80000;
  skip_frames(3);
  assert_good_frame(ALL);
  TEST_ASSERT_EQUAL_HEX32(0, frame.doubtful);
  TEST_ASSERT_EQUAL_HEX32(0, frame.renewed); /* its zero still holds */
  run_until(now_us + 10000000);
  TEST_ASSERT_EQUAL_INT(2, count_entries(0x1E, FAKE_COMMAND));
}

/* A supply that dips once does so twice: what all say amid a reset is not what they say for good. */
TEST(test_sensors_that_lose_their_state_again_amid_a_reset_are_reset_again) {
  run_until(3000000);
  fake.zero_next = ALL;
  next_frame();
  uint32_t d2[SENSORS];
  memcpy(d2, fake.d2, sizeof d2);
  for (int k = 0; k < SENSORS; k++) {
    fake.d2[k] = d2[k] / 16 * 15;
  }
  while (count_entries(0x1E, FAKE_COMMAND) < 3) {
    step();
  }
  TEST_ASSERT_EQUAL_HEX32(0, frame.valid);
  memcpy(fake.d2, d2, sizeof d2);
  skip_frames(2);
  assert_good_frame(ALL);
}

/* One that comes back wrong again and again is reset ever more rarely. */
TEST(test_incurable_sensor_is_reset_ever_more_rarely) {
  run_until(3000000);
  fake.d1[DISTURBED] = 1000000; /* below zero */
  run_until(now_us + 32000000);
  TEST_ASSERT_EQUAL_HEX32(ALL & ~DISTURBED_BIT, frame.valid);
  TEST_ASSERT_EQUAL_INT32(0, frame.pressure_Pa_q10[DISTURBED]);
  TEST_ASSERT_INT_WITHIN(1, 1 + 12, count_entries(0x1E, FAKE_COMMAND)); /* 0 .02 .05 .11 .24 .5 1 2 4 8 16 24 32 s */
  TEST_ASSERT_EQUAL_UINT32(2 * (uint32_t)(count_entries(0x1E, FAKE_COMMAND) - 1) + 2, value_of(&scan.counters.implausible_readings));
  fake.d1[DISTURBED] = fake.d1[DISTURBED + 1];
  run_until(now_us + 9000000);
  assert_good_frame(ALL);
}

/* At most one frame in twenty: that frame comes in its turn, at its time, with the pressures of the one before. */
TEST(test_temperature_takes_the_place_of_a_frame) {
  for (int i = 0; i < 6; i++) {
    const uint16_t osr = (uint16_t)(256 << i);
    next_case_of(osr, 0);
    skip_frames(2);
    struct frame last = frame;
    uint64_t begun_us = now_us;
    int held = 0, all = 0;
    uint64_t period_us = 0;
    for (; now_us < begun_us + 5000000; all++) {
      fake.d1[DISTURBED] += 10;
      next_frame();
      TEST_ASSERT_EQUAL_UINT32(last.number + 1, frame.number);
      period_us = period_us ? period_us : frame.t_us - last.t_us;
      TEST_ASSERT_EQUAL_UINT64(period_us, frame.t_us - last.t_us);
      TEST_ASSERT_EQUAL_UINT64(period_us, frame.t_begin_us - last.t_begin_us);
      TEST_ASSERT_EQUAL_INT32(ms58xx_find_osr(osr)->noise_Pa_q10, frame.noise_Pa_q10);
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
    TEST_ASSERT_INT_WITHIN(1, 4, held);
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

TEST(test_temperature_is_read_less_often_while_it_stands_still) {
  run_until(6000000);
  skip_to_temperature();
  TEST_ASSERT_UINT64_WITHIN(10000, LONGEST_INTERVAL_us, to_next_temperature_us());
  TEST_ASSERT_UINT64_WITHIN(10000, LONGEST_INTERVAL_us, to_next_temperature_us());

  warm_up(now_us + LONGEST_INTERVAL_us + 2000000);
  int before = count_entries(0x54, FAKE_COMMAND);
  warm_up(now_us + 3000000);
  TEST_ASSERT_INT_WITHIN(1, 6, count_entries(0x54, FAKE_COMMAND) - before);

  skip_to_temperature();
  to_next_temperature_us();
  to_next_temperature_us();
  TEST_ASSERT_GREATER_THAN_UINT64(950000, to_next_temperature_us());
}

/* A requested rate leaves pauses: there no frame is held, and the temperature is fresh. */
TEST(test_temperature_fits_into_the_pauses) {
  static const uint32_t rates_mHz[] = {75000, 20000, 1000, 100};
  for (size_t i = 0; i < sizeof rates_mHz / sizeof rates_mHz[0]; i++) {
    next_case_of(1024, rates_mHz[i]);
    const uint64_t period_us = 1000000000u / rates_mHz[i];
    skip_frames(2);
    while (now_us < 31000000) {
      TEST_ASSERT_EQUAL_UINT64(period_us, next_period_us());
      TEST_ASSERT_FALSE(frame.held);
    }
    int at = 0;
    int temperatures = count_entries(0x54, FAKE_COMMAND);
    for (int n = 0; n < temperatures; n++) {
      int next = find_entry(at, 0x54, FAKE_COMMAND);
      TEST_ASSERT_LESS_THAN_UINT64(7000, fake.log[next + 2].start_us - fake.log[next].start_us);
      if (n > 4) {
        uint64_t interval_us = fake.log[next].start_us - fake.log[at - 1].start_us;
        TEST_ASSERT_UINT64_WITHIN(period_us + 10000, (LONGEST_INTERVAL_us + period_us - 1) / period_us * period_us, interval_us);
      }
      at = next + 1;
    }
    TEST_ASSERT_GREATER_THAN_INT(3, temperatures);
  }
}
