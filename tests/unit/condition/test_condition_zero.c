#include "condition_bench.h"

TEST(test_tare_is_the_mean_without_the_extremes) {
  struct random random = {41};
  int64_t sum[SENSORS] = {0};
  for (int i = 0; i < ZERO_TARE_FRAMES; i++) {
    for (int k = 0; k < SENSORS; k++) {
      bool extreme = i == k || i == (k + 5) % ZERO_TARE_FRAMES;
      int32_t reading = AMBIENT + 5000 * k + (int32_t)random_below(&random, 20000);
      frame.pressure_Pa_q10[k] = !extreme ? reading : i == k ? INT32_MAX : INT32_MIN;
      sum[k] += extreme ? 0 : reading;
    }
    run(1);
    TEST_ASSERT_FALSE(conditioned.tared);
    TEST_ASSERT_EQUAL_HEX32(0, conditioned.usable);
    TEST_ASSERT_FALSE(conditioned.contact);
  }
  for (int k = 0; k < SENSORS; k++) {
    TEST_ASSERT_EQUAL_INT32(sum[k] / 14, condition.zero_Pa_q10[k]);
    frame.pressure_Pa_q10[k] = (int32_t)(sum[k] / 14) + 100 * k;
  }
  run(1);
  TEST_ASSERT_TRUE(conditioned.tared);
  TEST_ASSERT_EQUAL_HEX32(ALL, conditioned.usable);
  TEST_ASSERT_EQUAL_INT32(1400, conditioned.peak_Pa_q10);
  for (int k = 0; k < SENSORS; k++) {
    TEST_ASSERT_EQUAL_INT32(100 * k, conditioned.pressure_Pa_q10[k]);
  }
}

TEST(test_slow_frames_need_fewer_readings_for_a_tare) {
  static const struct {
    uint32_t period_us;
    int frames;
  } cases[] = {{10000000, 3}, {1000000, 3}, {300000, 5}, {62500, 16}, {765, 16}};
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    begin(cases[i].period_us);
    run(cases[i].frames);
    TEST_ASSERT_FALSE(conditioned.tared);
    run(1);
    TEST_ASSERT_TRUE(conditioned.tared);
    TEST_ASSERT_EQUAL_INT32(AMBIENT, condition.zero_Pa_q10[7]);
  }
}

/* By the first readings after a tare nothing is known but the noise; later the zero is right. */
TEST(test_zero_improves_after_the_tare) {
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    begin(periods_us[i]);
    fill(AMBIENT);
    run(16);
    fill(AMBIENT + 40 * Pa);
    run_s(4);
    TEST_ASSERT_INT32_WITHIN(2 * Pa, AMBIENT + 40 * Pa, condition.zero_Pa_q10[7]);
    TEST_ASSERT_FALSE(conditioned.zero_doubtful);
  }
}

/* Sensors rise by 130 Pa in the first seconds after power-up; that is no contact. */
TEST(test_warming_up_is_no_contact) {
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    begin(periods_us[i]);
    run(16);
    watch_s(5, 26, 1u << 3);
    TEST_ASSERT_EQUAL_FLOAT(0, contact_s);
    run_s(10);
    TEST_ASSERT_INT32_WITHIN(40 * Pa, 0, conditioned.pressure_Pa_q10[3]);
  }
}

/* Most of it comes in the first second: as much as real sensors rise after power-up. */
TEST(test_what_a_cold_sensor_rises_is_no_contact) {
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    begin(periods_us[i]);
    float fast = 300, slow = 250, certain_s = 0;
    for (int j = frames_in(20); j > 0; j--) {
      fast -= fast * (float)period_us / 250000;
      slow -= slow * (float)period_us / 1500000;
      frame.pressure_Pa_q10[3] = AMBIENT - (int32_t)((fast + slow) * Pa);
      run(1);
      certain_s += conditioned.contact && !conditioned.zero_doubtful ? 1 : 0;
    }
    TEST_ASSERT_EQUAL_FLOAT(0, certain_s);
    TEST_ASSERT_FALSE(conditioned.contact);
    TEST_ASSERT_FALSE(conditioned.zero_doubtful);
    TEST_ASSERT_INT32_WITHIN(20 * Pa, AMBIENT, condition.zero_Pa_q10[3]);
  }
}

static void assert_touch_of_is_seen(int32_t peak) {
  press(peak);
  run(2);
  TEST_ASSERT_TRUE(conditioned.contact);
  run_s(0.5f);
  TEST_ASSERT_TRUE(conditioned.contact);
  TEST_ASSERT_FALSE(conditioned.zero_doubtful);
  TEST_ASSERT_INT32_WITHIN(20 * Pa, peak, conditioned.peak_Pa_q10);
}

/* Of a pad that was off its zeros settle first; of one that was steady they are known at once. */
TEST(test_a_light_touch_is_seen_once_zeros_have_settled) {
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    begin(periods_us[i]);
    run_s(2.5f);
    assert_touch_of_is_seen(300 * Pa);
    hold(0, 3);
    condition_tare(&condition);
    run(ZERO_TARE_FRAMES + 1);
    TEST_ASSERT_TRUE(conditioned.tared);
    assert_touch_of_is_seen(300 * Pa);
  }
}

/* A force that rises with the start is followed for no longer than a sensor warms. */
TEST(test_a_ramp_from_the_start_is_a_contact) {
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    begin(periods_us[i]);
    run(ZERO_TARE_FRAMES);
    watch_s(60, 24, 1u << 7);
    TEST_ASSERT_TRUE(conditioned.contact);
    TEST_ASSERT_GREATER_THAN_INT32(1000 * Pa, conditioned.pressure_Pa_q10[7]);
  }
}

/* A flipped bit must not become a false touch that lasts, nor be remembered as a pressure. */
TEST(test_one_disturbed_reading_moves_no_zero) {
  static const int32_t readings[] = {INT32_MIN, 0, AMBIENT - 300 * Pa, AMBIENT + 300 * Pa, INT32_MAX};
  for (size_t i = 0; i < sizeof readings / sizeof readings[0]; i++) {
    for (int at = 0; at < 14; at++) { /* when the sensor is tracked, too */
      begin_idle(4854);
      run(at);
      frame.pressure_Pa_q10[7] = readings[i];
      run(1);
      TEST_ASSERT_EQUAL(readings[i] > AMBIENT, conditioned.contact);
      TEST_ASSERT_INT32_WITHIN(Pa / 8, AMBIENT, condition.zero_Pa_q10[7]);
      fill(AMBIENT);
      run(1);
      TEST_ASSERT_FALSE(conditioned.contact);
      run(30);
      TEST_ASSERT_FALSE(conditioned.contact);
      TEST_ASSERT_FALSE(conditioned.zero_doubtful);
      TEST_ASSERT_TRUE(conditioned.tared);
      TEST_ASSERT_INT32_WITHIN(Pa / 4, AMBIENT, condition.zero_Pa_q10[7]);
      TEST_ASSERT_LESS_THAN_INT32(Pa, condition.margin_Pa_q10[7]);
    }
  }
}

TEST(test_zero_follows_any_drift_of_a_barometer) {
  for (size_t i = 0; i < 2 * PERIODS; i++) {
    const int sign = i % 2 ? 1 : -1;
    begin_idle(periods_us[i / 2]);
    watch_s(900, 0.22f * (float)sign, 0x1249);
    TEST_ASSERT_EQUAL_FLOAT(0, contact_s);
    TEST_ASSERT_TRUE(conditioned.tared);
    TEST_ASSERT_FALSE(conditioned.zero_doubtful);
    TEST_ASSERT_INT32_WITHIN(5 * Pa, 0, conditioned.pressure_Pa_q10[3]);
  }
}

/* The flanks of the press are below too, by less; what its peak comes back by is none of theirs. */
TEST(test_a_tare_under_a_press_is_mended_for_all_sensors) {
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    begin(periods_us[i]);
    hold(5000 * Pa, 40);
    fill(AMBIENT);
    run_s(3);
    for (int t = 3; t < 60; t++) {
      run_s(1);
      for (int k = 0; k < SENSORS; k++) {
        TEST_ASSERT_INT32_WITHIN(5 * Pa, AMBIENT, condition.zero_Pa_q10[k]);
      }
    }
  }
}

/* 0.005 N/s above one sensor and between four, and a fifth of it: what it lost is about 0.02 N.
 * Below 3.9 kPa it cannot be told from the drift of some sensors. */
TEST(test_no_slow_force_is_taken_for_a_drift) {
  static const float slopes_Pa_s[] = {22, 12, 2.4f};
  for (size_t i = 0; i < PERIODS; i++) {
    for (size_t s = 0; s < 3; s++) {
      begin_idle(periods_us[i]);
      watch_s(4000 / slopes_Pa_s[s], slopes_Pa_s[s], 1u << 7);
      TEST_ASSERT_TRUE(conditioned.contact);
      TEST_ASSERT_TRUE(contact_s > 0.85f * 4000 / slopes_Pa_s[s] - 20);
      TEST_ASSERT_INT32_WITHIN(110 * Pa, 4000 * Pa, conditioned.pressure_Pa_q10[7]);
      watch_s(500 / slopes_Pa_s[s], slopes_Pa_s[s], 1u << 7);
      TEST_ASSERT_FALSE(conditioned.zero_doubtful);
    }
  }
}

/* 60 Pa where the compensation changes its branch, and up to 48 Pa between two temperatures. */
TEST(test_what_compensation_costs_is_no_contact) {
  for (size_t i = 0; i < 2 * FAST_PERIODS; i++) {
    const int sign = i % 2 ? 1 : -1;
    begin_idle(periods_us[i / 2]);
    for (int half_second = 0; half_second < 60; half_second++) {
      fill(AMBIENT + (half_second < 30 ? 0 : sign * 60 * Pa));
      watch_s(0.5f, 96, ALL);
      TEST_ASSERT_EQUAL_FLOAT(0, contact_s);
    }
  }
}

/* A drift seen before goes on in the contact, for an hour; what is no drift does not. */
TEST(test_drift_goes_on_during_contact) {
  for (size_t i = 0; i < PERIODS; i++) {
    begin(periods_us[i]);
    watch_s(200, 0.2f, 1u << 3);
    int32_t began = condition.zero_Pa_q10[3];
    frame.pressure_Pa_q10[7] += 10000 * Pa;
    watch_s(3500, 0.2f, 1u << 3);
    TEST_ASSERT_INT32_WITHIN(40 * Pa, 700 * Pa, condition.zero_Pa_q10[3] - began);
    TEST_ASSERT_INT32_WITHIN(10 * Pa, AMBIENT, condition.zero_Pa_q10[4]);
    watch_s(7200, 0.0f, 1u << 3);
    TEST_ASSERT_INT32_WITHIN(70 * Pa, 720 * Pa, condition.zero_Pa_q10[3] - began);
  }
}

/* Nor is warming up a drift, or what rubber still gives back. */
TEST(test_other_changes_are_learnt_as_no_drift) {
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    begin(periods_us[i]);
    watch_s(25, 1, 1u << 7);
    int32_t began = condition.zero_Pa_q10[7];
    frame.pressure_Pa_q10[7] += 10000 * Pa;
    run_s(3000);
    TEST_ASSERT_INT32_WITHIN(10 * Pa, began, condition.zero_Pa_q10[7]);

    begin_idle(periods_us[i]);
    hold(20000 * Pa, 5);
    release(0.03f, 10, 58);
    began = condition.zero_Pa_q10[7];
    hold(10000 * Pa, 3000);
    TEST_ASSERT_INT32_WITHIN(10 * Pa, began, condition.zero_Pa_q10[7]);
  }
  begin_idle(4854); /* nor a slow press */
  watch_s(300, 12, 1u << 7);
  int32_t began = condition.zero_Pa_q10[7];
  run_s(3000);
  TEST_ASSERT_INT32_WITHIN(30 * Pa, began, condition.zero_Pa_q10[7]);
}

/* The press becomes the zero; after it the pad reads negative, says so, and is tared again. */
TEST(test_tare_during_contact) {
  begin_idle(4854);
  frame.pressure_Pa_q10[7] += 20000 * Pa;
  run(50);
  TEST_ASSERT_TRUE(conditioned.contact);
  condition_tare(&condition);
  run(17);
  TEST_ASSERT_TRUE(conditioned.tared);
  TEST_ASSERT_FALSE(conditioned.contact);
  TEST_ASSERT_EQUAL_INT32(0, conditioned.peak_Pa_q10);
  run_s(10);
  fill(AMBIENT);
  run_s(0.2f);
  TEST_ASSERT_INT32_WITHIN(100 * Pa, -20000 * Pa, conditioned.pressure_Pa_q10[7]);
  TEST_ASSERT_FALSE(conditioned.contact);
  TEST_ASSERT_FALSE(conditioned.tared);
  run_s(0.8f);
  TEST_ASSERT_TRUE(conditioned.tared);
  TEST_ASSERT_EQUAL_INT32(AMBIENT, condition.zero_Pa_q10[7]);
}

/* A dip that rubber makes is waited for; one that stays is the zero, and may come back in doubt. */
TEST(test_reading_below_zero_is_tared_anew_when_it_stays) {
  static const int32_t depths_Pa[] = {400, 900};
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    for (size_t j = 0; j < 2; j++) {
      begin_idle(periods_us[i]);
      fill(AMBIENT - depths_Pa[j] * Pa);
      run_s(8);
      TEST_ASSERT_FALSE(conditioned.tared);
      fill(AMBIENT);
      run_s(0.2f);
      TEST_ASSERT_TRUE(conditioned.tared);
      TEST_ASSERT_INT32_WITHIN(10 * Pa, 0, conditioned.peak_Pa_q10);
      fill(AMBIENT - depths_Pa[j] * Pa);
      run_s(12);
      TEST_ASSERT_TRUE(conditioned.tared);
      TEST_ASSERT_INT32_WITHIN(2 * Pa, AMBIENT - depths_Pa[j] * Pa, condition.zero_Pa_q10[7]);
      fill(AMBIENT);
      watch_s(10, 0, 0);
      TEST_ASSERT_EQUAL_FLOAT(0, unflagged_s);
    }
  }
}

/* Its supply dipped while the zero was taken, which is found out when it has been reset. A zero from long before is its own. */
TEST(test_zero_of_a_sensor_that_had_lost_its_state_is_taken_anew) {
  for (int late = 0; late <= 1; late++) {
    begin(4854);
    frame.pressure_Pa_q10[4] -= 17000 * 1024;
    run_s(late ? 6 : 1);
    TEST_ASSERT_TRUE(conditioned.tared);
    frame.pressure_Pa_q10[4] += 17000 * 1024;
    frame.restored = 1u << 4;
    run(1);
    frame.restored = 0;
    run(ZERO_TARE_FRAMES);
    TEST_ASSERT_TRUE(conditioned.tared);
    TEST_ASSERT_EQUAL_INT(late, conditioned.contact);
  }
}

/* Rubber that bulges beside a press is above its zero once that press, under which it was taken, is over. */
TEST(test_a_release_of_what_was_tared_is_no_contact) {
  for (float bulge = 0.0f; bulge < 0.05f; bulge += 0.015f) {
    begin(4854);
    press(30000 * Pa);
    for (int k = 0; k < SENSORS; k++) {
      frame.pressure_Pa_q10[k] -= bump(k) < 0.01f ? (int32_t)(bulge * 30000.0f) * Pa : 0;
    }
    run_s(10);
    fill(AMBIENT);
    run_s(1);
    TEST_ASSERT_TRUE(conditioned.tared && !conditioned.contact);
    run_s(60);
    TEST_ASSERT_FALSE(conditioned.zero_doubtful);
    /* A press that has moved on is one, in doubt: a sensor is far below. */
    begin(4854);
    press(30000 * Pa);
    run_s(10);
    fill(AMBIENT);
    frame.pressure_Pa_q10[0] += 10000 * Pa;
    run_s(5);
    TEST_ASSERT_TRUE(conditioned.contact && conditioned.zero_doubtful);
  }
}

TEST(test_a_pause_changes_no_zero_in_a_contact) {
  begin_idle(4854);
  hold(20000 * Pa, 3);
  condition_resume(&condition, 3600000);
  run_s(1);
  TEST_ASSERT_TRUE(conditioned.contact && conditioned.tared);
  TEST_ASSERT_INT32_WITHIN(100 * Pa, 20000 * Pa, conditioned.peak_Pa_q10);
  hold(500 * Pa, 1); /* less than a zero may have drifted meanwhile */
  TEST_ASSERT_TRUE(!conditioned.contact || conditioned.zero_doubtful);
  hold(0, 10);
  condition_resume(&condition, 3600000);
  run(1);
  TEST_ASSERT_FALSE(conditioned.tared);
}

/* What is known of the rubber outlives a tare, and a sensor that comes back later waits for the contact's end. */
TEST(test_a_tare_keeps_what_is_known) {
  begin_idle(4854);
  condition.sensor[3].hysteresis_q16 = 8000;
  frame.valid = ALL & ~(1u << 14);
  condition_tare(&condition);
  run_s(2);
  TEST_ASSERT_EQUAL_INT32(8000, condition.sensor[3].hysteresis_q16);
  hold(20000 * Pa, 1);
  frame.valid = ALL;
  run_s(1);
  TEST_ASSERT_FALSE(conditioned.zero_doubtful || condition.guessed);
}
