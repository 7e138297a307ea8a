#include "condition_bench.h"

/* Ten minutes with drift: five seconds later the zero is right, and there was no phantom. */
TEST(test_zero_recovers_after_a_long_contact) {
  for (size_t i = 0; i < 2 * FAST_PERIODS; i++) {
    const int sign = i % 2 ? 1 : -1;
    begin(periods_us[i / 2]);
    run_s(1);
    press(1000 * Pa);
    watch_s(600, 0.22f * (float)sign, ALL);
    for (int k = 0; k < SENSORS; k++) {
      frame.pressure_Pa_q10[k] -= (int32_t)(bump(k) * 1000.0f * Pa);
    }
    watch_s(5, 0.22f * (float)sign, ALL);
    TEST_ASSERT_TRUE(unflagged_s < 0.1f);
    TEST_ASSERT_FALSE(conditioned.contact);
    for (int k = 0; k < SENSORS; k++) {
      TEST_ASSERT_INT32_WITHIN(30 * Pa, 0, conditioned.pressure_Pa_q10[k]);
    }
  }
}

TEST(test_what_rubber_does_after_a_release_is_no_contact) {
  static const float shares[] = {-0.15f, -0.09f, -0.03f, 0.004f, 0.03f, 0.08f};
  static const float times_s[] = {0.5f, 2, 10};
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    for (size_t s = 0; s < sizeof shares / sizeof shares[0]; s++) {
      for (size_t t = 0; t < 3; t++) {
        begin_idle(periods_us[i]);
        hold(20000 * Pa, 5);
        release(shares[s], times_s[t], 40);
        TEST_ASSERT_EQUAL_FLOAT(0, unflagged_s);
        TEST_ASSERT_TRUE(contact_s < 6);
        int32_t left = conditioned.pressure_Pa_q10[7];
        TEST_ASSERT_INT32_WITHIN(60 * Pa, 0, left);
        /* The next press is what it is. */
        fill(AMBIENT);
        frame.pressure_Pa_q10[7] += (int32_t)(shares[s] * 400) * Pa; /* nothing of it is left */
        frame.pressure_Pa_q10[7] += 8000 * Pa;
        run_s(0.5f);
        TEST_ASSERT_TRUE(conditioned.contact);
        TEST_ASSERT_FALSE(conditioned.zero_doubtful);
        TEST_ASSERT_INT32_WITHIN(400 * Pa, 8000 * Pa, conditioned.peak_Pa_q10);
      }
    }
  }
}

/* What stays for good is taken up, and said to be. */
TEST(test_a_force_left_after_a_release_is_flagged) {
  static const float shares[] = {0.03f, 0.06f, 0.1f};
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    for (size_t s = 0; s < 3; s++) {
      begin_idle(periods_us[i]);
      hold(20000 * Pa, 5);
      float flagged_s = 0;
      hold((int32_t)(shares[s] * 20000) * Pa, 0.2f);
      for (int j = 0; j < 59; j++) {
        run_s(1);
        flagged_s += conditioned.zero_doubtful ? 1 : 0;
      }
      TEST_ASSERT_EQUAL_FLOAT(59, flagged_s);
    }
    /* More than an eighth is a contact without doubt. */
    begin_idle(periods_us[i]);
    hold(20000 * Pa, 5);
    press(3000 * Pa);
    watch_s(60, 0, 0);
    TEST_ASSERT_FLOAT_WITHIN(0.1f, 60, unflagged_s);
    TEST_ASSERT_INT32_WITHIN(700 * Pa, 3000 * Pa, conditioned.peak_Pa_q10);
  }
}

TEST(test_press_after_a_release_is_not_taken_for_a_remainder) {
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    begin_idle(periods_us[i]);
    hold(20000 * Pa, 5);
    hold(0, 3);
    TEST_ASSERT_FALSE(conditioned.contact);
    press(800 * Pa); /* within the band: in doubt, but not eaten */
    watch_s(2, 0, 0);
    TEST_ASSERT_TRUE(conditioned.contact);
    TEST_ASSERT_TRUE(conditioned.zero_doubtful);
    TEST_ASSERT_INT32_WITHIN(100 * Pa, 800 * Pa, conditioned.peak_Pa_q10);
    hold(0, 1);
    press(2000 * Pa);
    watch_s(5, 0, 0);
    TEST_ASSERT_FLOAT_WITHIN(0.1f, 5, unflagged_s);
    TEST_ASSERT_INT32_WITHIN(100 * Pa, 2000 * Pa, conditioned.peak_Pa_q10);
  }
}

/* What the zero comes back to after a certain press, within what opens the gate, is the zero: no force is left there twice. */
TEST(test_a_press_proves_the_zero_that_it_leaves) {
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    for (int more = 0; more <= 1; more++) {
      begin_idle(periods_us[i]);
      hold(20000 * Pa, 5);
      hold(600 * Pa, 10);
      TEST_ASSERT_TRUE(conditioned.zero_doubtful);
      TEST_ASSERT_FALSE(conditioned.contact);
      hold(20000 * Pa, 5);
      TEST_ASSERT_FALSE(conditioned.zero_doubtful);
      hold((more ? 1200 : 750) * Pa, 3);
      TEST_ASSERT_FALSE(conditioned.contact);
      TEST_ASSERT_EQUAL(more, conditioned.zero_doubtful);
    }
    begin_idle(periods_us[i]); /* A press that is in doubt itself proves nothing. */
    hold(20000 * Pa, 5);
    hold(600 * Pa, 10);
    press(2000 * Pa);
    watch_s(5, 0, 0);
    TEST_ASSERT_TRUE(conditioned.contact);
    TEST_ASSERT_EQUAL_FLOAT(0, unflagged_s);
    hold(600 * Pa, 3);
    TEST_ASSERT_TRUE(conditioned.zero_doubtful);
  }
}

/* Presses of 20 kPa, after each of which sensor 7 alone keeps this. */
static void keep(int presses, float share, float time_constant_s, float seconds) {
  for (; presses > 0; presses--) {
    hold(20000 * Pa, 3);
    contact_s = unflagged_s = 0;
    fill(AMBIENT);
    for (int i = 0; i < frames_in(seconds); i++) {
      const float t_s = 1e-6f * (float)period_us * (float)i;
      frame.pressure_Pa_q10[7] = AMBIENT + (int32_t)(20000.0f * share * expf(-t_s / time_constant_s)) * Pa;
      watch_frame();
    }
  }
}

/* It keeps a fifth, more than the band of others: a contact that goes on, unless it kept a lot before. */
TEST(test_a_sensor_that_keeps_much_has_a_band_of_its_own) {
  for (size_t i = 0; i < 2 * FAST_PERIODS; i++) {
    begin_idle(periods_us[i / 2]);
    keep(8, i % 2 ? 0.12f : 0.02f, 2, 10);
    keep(1, 0.2f, 60, 5);
    TEST_ASSERT_FLOAT_WITHIN(1, i % 2 ? 0 : 5, unflagged_s);
  }
}

/* A force that remains after presses, on all sensors, is not learnt as rubber's: a fifth of the next is a contact. */
TEST(test_a_force_that_is_left_again_and_again_stays_a_force) {
  for (size_t i = 0; i < 2 * FAST_PERIODS; i++) {
    begin_idle(periods_us[i / 2]);
    for (int n = 0; n < 10; n++) {
      hold(20000 * Pa, 5);
      hold((n > 0 || i % 2 ? 2000 : 0) * Pa, 3);
      frame.valid = i % 2 ? ALL : ALL & ~(1u << 6); /* which kept nothing before it failed */
      hold(0, 10);
    }
    hold(20000 * Pa, 5);
    hold(4000 * Pa, 1);
    watch_s(5, 0, 0);
    TEST_ASSERT_FLOAT_WITHIN(0.1f, 5, unflagged_s);
  }
}

/* What a press leaves in sensor 7 is taken back by the next one as far as that goes, and fades: the pressure is right all the time. */
TEST(test_what_a_press_leaves_is_taken_back_by_the_next_or_fades_in_it) {
  for (size_t i = 0; i < 2 * FAST_PERIODS; i++) {
    const int sign = i % 2 ? 1 : -1;
    begin_idle(periods_us[i / 2]);
    hold(20000 * Pa, 5);
    release(0.04f * (float)sign, 2, 1);
    const float left_Pa = 0.04f * (float)sign * (20000.0f * expf(-1.0f / 2.0f) - 8000.0f);
    for (int tenth = 0; tenth < 60; tenth++) {
      press(8000 * Pa);
      frame.pressure_Pa_q10[7] += (int32_t)(1024.0f * left_Pa * expf(-0.1f / 2.0f * (float)tenth));
      run_s(0.1f);
      TEST_ASSERT_INT32_WITHIN(150 * Pa, 8000 * Pa, conditioned.pressure_Pa_q10[7]);
    }
  }
}

/* Nor of what many presses left, which the baseline has followed. Where the contact moves on, what the sensor keeps is known. */
TEST(test_what_many_presses_leave_fades_in_the_next_one_and_is_known_as_it_moves_on) {
  for (size_t i = 0; i < 2 * FAST_PERIODS; i++) {
    const float share = i % 2 ? 0.04f : -0.04f;
    begin_idle(periods_us[i / 2]);
    for (int n = 0; n < 24; n++) {
      hold((n % 3 ? 3000 : 20000) * Pa, 0.5f);
      release(share * expf(-1.7f / 2 * (float)(n % 3)), 2, 1.2f);
    }
    hold(20000 * Pa, 12);
    TEST_ASSERT_INT32_WITHIN(60 * Pa, 20000 * Pa, conditioned.pressure_Pa_q10[7]);
    press(0);
    frame.pressure_Pa_q10[1] += 20000 * Pa;
    frame.pressure_Pa_q10[7] += (int32_t)(20000 * share * 0.9f) * Pa; /* after 0.2 s */
    run_s(0.2f);
    TEST_ASSERT_INT32_WITHIN(120 * Pa, 0, conditioned.pressure_Pa_q10[7]);
  }
}

/* A sensor that is tared, in a press or after it, rests where it settles, by then 200 Pa higher. */
TEST(test_a_sensor_that_settles_after_a_press_rests_there) {
  for (size_t i = 0; i < 2 * FAST_PERIODS; i++) {
    begin_idle(periods_us[i / 2]);
    hold(20000 * Pa, 1);
    frame.renewed = i % 2 ? 1u << 7 : 0;
    run(1);
    press(0);
    frame.renewed = 0;
    run_s(0.1f);
    frame.renewed = i % 2 ? 0 : 1u << 7;
    run(1);
    TEST_ASSERT_TRUE(i % 2 || conditioned.usable == (ALL & ~(1u << 7)));
    frame.renewed = 0;
    run_s(0.5f);
    watch_s(1, 200, 1u << 7);
    frame.pressure_Pa_q10[7] += 8000 * Pa;
    run_s(6);
    TEST_ASSERT_INT32_WITHIN(40 * Pa, 8000 * Pa, conditioned.pressure_Pa_q10[7]);
  }
}

/* One that was away, or has not settled, teaches nothing. */
TEST(test_what_a_sensor_keeps_shows_after_the_press_alone) {
  for (size_t i = 0; i < 2 * FAST_PERIODS; i++) {
    begin(periods_us[i / 2]);
    run_s(i % 2 ? 1 : 60);
    hold(20000 * Pa, 3);
    press(0);
    frame.valid = i % 2 ? ALL : ALL & ~(1u << 7);
    run_s(5);
    frame.valid = ALL;
    run_s(5);
    TEST_ASSERT_EQUAL(HYSTERESIS_SD, condition.sensor[7].hysteresis_q16);
  }
}

/* The sd of what rubber keeps: of a hold as it grows, of all that is let go, and then less in 2 and 3 s. A sensor that stood
 * off by a tenth counts for more from then on, one that did not for less. Where a contact moves on, its pressure is right. */
TEST(test_the_sd_of_what_rubber_keeps_is_learnt_from_what_stands_off) {
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    begin_idle(periods_us[i]);
    TEST_ASSERT_EQUAL(0, condition.hysteresis_sd_Pa_q10[7]);
    hold(20000 * Pa, 3);
    TEST_ASSERT_INT32_WITHIN(30 * Pa, (int32_t)(0.02f * 20000 * (1.0f - expf(-1.0f))) * Pa, condition.hysteresis_sd_Pa_q10[7]);
    press(0);
    frame.pressure_Pa_q10[1] += 20000 * Pa; /* the contact moves on */
    run_s(0.2f);
    TEST_ASSERT_INT32_WITHIN(40 * Pa, 700 * Pa, condition.hysteresis_sd_Pa_q10[7]);
    press(0);
    TEST_ASSERT_INT32_WITHIN(40 * Pa, 700 * Pa, condition.hysteresis_sd_Pa_q10[7]);
    run_s(30);
    TEST_ASSERT_INT32_WITHIN(Pa, 0, condition.hysteresis_sd_Pa_q10[7]);
    keep(12, -0.1f, 3, 5);
    hold(20000 * Pa, 1);
    press(0);
    frame.pressure_Pa_q10[1] += 20000 * Pa;
    frame.pressure_Pa_q10[7] -= 2000 * Pa;
    run_s(0.2f);
    TEST_ASSERT_INT32_WITHIN(300 * Pa, 0, conditioned.pressure_Pa_q10[7]);
    hold(0, 0.15f);
    TEST_ASSERT_INT32_WITHIN(200 * Pa, 1100 * Pa, condition.hysteresis_sd_Pa_q10[7]);
    TEST_ASSERT_TRUE(condition.hysteresis_sd_Pa_q10[4] * 5 < condition.hysteresis_sd_Pa_q10[7]);
  }
}
