#include "condition/condition.h"
#include "support/random.h"

#include <string.h>
#include <unity.h>

enum { SENSORS = 15 };
#define ALL 0x7FFFu
#define Pa 1024
#define AMBIENT (100000 * Pa)
#define NOISE (4 * Pa)
#define OPEN (GATE_OPEN_Pa * Pa + GATE_OPEN_SIGMA * NOISE)
#define CLOSE (GATE_CLOSE_Pa * Pa + GATE_CLOSE_SIGMA * NOISE)

static struct condition condition;
static struct conditioned conditioned;
static struct frame frame;
static uint32_t period_us;

static void fill(int32_t pressure_Pa_q10) {
  for (int k = 0; k < SENSORS; k++) {
    frame.pressure_Pa_q10[k] = pressure_Pa_q10;
  }
}

static void run(int count) {
  for (int i = 0; i < count; i++) {
    frame.t_us += period_us;
    condition_frame(&condition, &frame, NULL, &conditioned);
    condition_follow(&condition, &frame, &conditioned);
  }
}

static int frames_in(float seconds) {
  return (int)(seconds * 1e6f / (float)period_us + 0.5f);
}

static void run_s(float seconds) {
  run(frames_in(seconds));
}

/* Nothing else is asked for than at the frames' end. */
static float contact_s, unflagged_s;

static void watch_s(float seconds, float slope_Pa_s, uint32_t sensors) {
  contact_s = unflagged_s = 0;
  double moved = 0;
  for (int i = frames_in(seconds); i > 0; i--) {
    double before = moved;
    moved += 1024.0 * (double)slope_Pa_s * (double)period_us * 1e-6;
    int32_t step = (int32_t)moved - (int32_t)before;
    for (int k = 0; k < SENSORS; k++) {
      frame.pressure_Pa_q10[k] += sensors >> k & 1u ? step : 0;
    }
    run(1);
    contact_s += conditioned.contact ? 1e-6f * (float)period_us : 0;
    unflagged_s += conditioned.contact && !conditioned.zero_doubtful ? 1e-6f * (float)period_us : 0;
  }
}

/* A bump like that of a contact above sensor 7, up to 1. */
static float bump(int k) {
  static const float by_distance[3][3] = {{1, 0.29f, 0.007f}, {0.29f, 0.08f, 0.002f}};
  int across = k / 5 - 1, along = k % 5 - 2;
  return by_distance[across < 0 ? -across : across][along < 0 ? -along : along];
}

static void press(int32_t peak) {
  for (int k = 0; k < SENSORS; k++) {
    frame.pressure_Pa_q10[k] = AMBIENT + (int32_t)(bump(k) * (float)peak);
  }
}

static void begin(uint32_t frame_period_us) {
  condition_start(&condition);
  memset(&frame, 0, sizeof frame);
  period_us = frame_period_us;
  frame.t_us = 3000000;
  frame.sensor_count = SENSORS;
  frame.noise_Pa_q10 = NOISE;
  frame.valid = ALL;
  fill(AMBIENT);
}

/* Tared and warm. */
static void begin_calm(uint32_t frame_period_us) {
  begin(frame_period_us);
  run_s(60);
}

/* pico_mux at OSR 1024, pico_parallel at 256, either at 8192, a rate that was set, and the least */
static const uint32_t periods_us[] = {4854, 765, 17544, 1000000, 10000000};
enum { PERIODS = sizeof periods_us / sizeof periods_us[0], FAST_PERIODS = 3 };

void setUp(void) {
  begin(4854);
}

void tearDown(void) {}

static void test_tare_is_the_mean_without_the_extremes(void) {
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

static void test_slow_frames_need_fewer_readings_for_a_tare(void) {
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
static void test_zero_improves_after_the_tare(void) {
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
static void test_warming_up_is_no_contact(void) {
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
static void test_what_a_cold_sensor_rises_is_no_contact(void) {
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

/* Of a pad that was off its zeros settle first; of one that was calm they are known at once. */
static void test_a_light_touch_is_seen_once_zeros_have_settled(void) {
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    begin(periods_us[i]);
    run_s(2.5f);
    assert_touch_of_is_seen(300 * Pa);
    press(0);
    run_s(3);
    condition_tare(&condition);
    run(ZERO_TARE_FRAMES + 1);
    TEST_ASSERT_TRUE(conditioned.tared);
    assert_touch_of_is_seen(300 * Pa);
  }
}

/* A force that rises with the start is followed for no longer than a sensor warms. */
static void test_a_ramp_from_the_start_is_a_contact(void) {
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    begin(periods_us[i]);
    run(ZERO_TARE_FRAMES);
    watch_s(60, 24, 1u << 7);
    TEST_ASSERT_TRUE(conditioned.contact);
    TEST_ASSERT_GREATER_THAN_INT32(1000 * Pa, conditioned.pressure_Pa_q10[7]);
  }
}

static void test_gate_has_a_hysteresis_in_pascals_and_sigmas(void) {
  static const int32_t noises[] = {0, 16 * Pa / 10, 4 * Pa, 11 * Pa};
  for (size_t n = 0; n < sizeof noises / sizeof noises[0]; n++) {
    begin_calm(4854);
    frame.noise_Pa_q10 = noises[n];
    int32_t open = 132 * Pa + 6 * noises[n], close = 90 * Pa + 4 * noises[n];
    const struct {
      int32_t above;
      bool contact;
    } steps[] = {{open - 2 * Pa, false},  {open + 2 * Pa, true},
                 {close + 2 * Pa, true},  {close - 2 * Pa, false},
                 {close + 2 * Pa, false}, {open - 2 * Pa, false},
                 {2 * open, true},        {0, false}};
    for (size_t i = 0; i < sizeof steps / sizeof steps[0]; i++) {
      frame.pressure_Pa_q10[7] = condition.zero_Pa_q10[7] + steps[i].above;
      run(1);
      TEST_ASSERT_INT32_WITHIN(Pa, steps[i].above, conditioned.peak_Pa_q10);
      TEST_ASSERT_EQUAL(steps[i].contact, conditioned.contact);
      TEST_ASSERT_FALSE(conditioned.zero_doubtful && steps[i].above >= open);
    }
  }
}

/* A flipped bit must not become a false touch that lasts, nor be remembered as a pressure. */
static void test_one_disturbed_reading_moves_no_zero(void) {
  static const int32_t readings[] = {INT32_MIN, 0, AMBIENT - 300 * Pa, AMBIENT + 300 * Pa,
                                     INT32_MAX};
  for (size_t i = 0; i < sizeof readings / sizeof readings[0]; i++) {
    for (int at = 0; at < 14; at++) { /* when the sensor is tracked, too */
      begin_calm(4854);
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

static void test_zero_follows_any_drift_of_a_barometer(void) {
  for (size_t i = 0; i < PERIODS; i++) {
    for (int sign = -1; sign <= 1; sign += 2) {
      begin_calm(periods_us[i]);
      watch_s(900, 0.22f * (float)sign, 0x1249);
      TEST_ASSERT_EQUAL_FLOAT(0, contact_s);
      TEST_ASSERT_TRUE(conditioned.tared);
      TEST_ASSERT_FALSE(conditioned.zero_doubtful);
      TEST_ASSERT_INT32_WITHIN(5 * Pa, 0, conditioned.pressure_Pa_q10[3]);
    }
  }
}

/* The flanks of the press are below too, by less; what its peak comes back by is none of theirs. */
static void test_a_tare_under_a_press_is_mended_for_all_sensors(void) {
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    begin(periods_us[i]);
    press(5000 * Pa);
    run_s(40);
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

/* One whose PROM has a wrong CRC is used, and doubtful for good: its zero drifts like the others'.
 */
static void test_zero_follows_the_drift_of_a_doubtful_sensor(void) {
  for (size_t i = 0; i < PERIODS; i++) {
    begin(periods_us[i]);
    frame.doubtful = 1u << 3;
    run_s(60);
    watch_s(900, 0.22f, 0x1249);
    TEST_ASSERT_EQUAL_FLOAT(0, contact_s);
    TEST_ASSERT_INT32_WITHIN(5 * Pa, 0, conditioned.pressure_Pa_q10[3]);
  }
}

/* After a release: `share` of the press stays, and comes back with a time constant. */
static void release(float share, float time_constant_s, float seconds) {
  contact_s = unflagged_s = 0;
  float left = share, decay = 1.0f - 1e-6f * (float)period_us / time_constant_s;
  for (int i = frames_in(seconds); i > 0; i--) {
    press((int32_t)(left * 20000.0f) * Pa);
    left *= decay > 0 ? decay : 0;
    run(1);
    contact_s += conditioned.contact ? 1e-6f * (float)period_us : 0;
    unflagged_s += conditioned.contact && !conditioned.zero_doubtful ? 1e-6f * (float)period_us : 0;
  }
}

/* 0.005 N/s above one sensor and between four, and a fifth of it: what it lost is about 0.02 N.
 * Below 3.9 kPa it cannot be told from the drift of some sensors. */
static void test_no_slow_force_is_taken_for_a_drift(void) {
  static const float slopes_Pa_s[] = {22, 12, 2.4f};
  for (size_t i = 0; i < PERIODS; i++) {
    for (size_t s = 0; s < 3; s++) {
      begin_calm(periods_us[i]);
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
static void test_what_compensation_costs_is_no_contact(void) {
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    for (int sign = -1; sign <= 1; sign += 2) {
      begin_calm(periods_us[i]);
      for (int half_second = 0; half_second < 60; half_second++) {
        fill(AMBIENT + (half_second < 30 ? 0 : sign * 60 * Pa));
        watch_s(0.5f, 96, ALL);
        TEST_ASSERT_EQUAL_FLOAT(0, contact_s);
      }
    }
  }
}

static void test_zero_stands_still_during_contact(void) {
  begin_calm(4854);
  press(10000 * Pa);
  run_s(60);
  TEST_ASSERT_TRUE(conditioned.contact);
  TEST_ASSERT_FALSE(conditioned.zero_doubtful);
  for (int k = 0; k < SENSORS; k++) {
    TEST_ASSERT_INT32_WITHIN(Pa / 4, AMBIENT, condition.zero_Pa_q10[k]);
  }
}

/* A drift seen before goes on in the contact, for an hour; what is no drift does not. */
static void test_drift_goes_on_during_contact(void) {
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
static void test_other_changes_are_learnt_as_no_drift(void) {
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    begin(periods_us[i]);
    watch_s(25, 1, 1u << 7);
    int32_t began = condition.zero_Pa_q10[7];
    frame.pressure_Pa_q10[7] += 10000 * Pa;
    run_s(3000);
    TEST_ASSERT_INT32_WITHIN(10 * Pa, began, condition.zero_Pa_q10[7]);

    begin_calm(periods_us[i]);
    press(20000 * Pa);
    run_s(5);
    release(0.03f, 10, 58);
    began = condition.zero_Pa_q10[7];
    press(10000 * Pa);
    run_s(3000);
    TEST_ASSERT_INT32_WITHIN(10 * Pa, began, condition.zero_Pa_q10[7]);
  }
}

static void test_a_slow_press_is_learnt_as_no_drift(void) {
  begin_calm(4854);
  watch_s(300, 12, 1u << 7);
  int32_t began = condition.zero_Pa_q10[7];
  run_s(3000);
  TEST_ASSERT_INT32_WITHIN(30 * Pa, began, condition.zero_Pa_q10[7]);
}

/* Ten minutes with drift: five seconds later the zero is right, and there was no phantom. */
static void test_zero_recovers_after_a_long_contact(void) {
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    for (int sign = -1; sign <= 1; sign += 2) {
      begin(periods_us[i]);
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
}

static void test_what_rubber_does_after_a_release_is_no_contact(void) {
  static const float shares[] = {-0.15f, -0.09f, -0.03f, 0.004f, 0.03f, 0.08f};
  static const float times_s[] = {0.5f, 2, 10};
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    for (size_t s = 0; s < sizeof shares / sizeof shares[0]; s++) {
      for (size_t t = 0; t < 3; t++) {
        begin_calm(periods_us[i]);
        press(20000 * Pa);
        run_s(5);
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
static void test_a_force_left_after_a_release_is_flagged(void) {
  static const float shares[] = {0.03f, 0.06f, 0.1f};
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    for (size_t s = 0; s < 3; s++) {
      begin_calm(periods_us[i]);
      press(20000 * Pa);
      run_s(5);
      float flagged_s = 0;
      press((int32_t)(shares[s] * 20000) * Pa);
      run_s(0.2f);
      for (int j = 0; j < 59; j++) {
        run_s(1);
        flagged_s += conditioned.zero_doubtful ? 1 : 0;
      }
      TEST_ASSERT_EQUAL_FLOAT(59, flagged_s);
    }
    /* More than an eighth is a contact without doubt. */
    begin_calm(periods_us[i]);
    press(20000 * Pa);
    run_s(5);
    press(3000 * Pa);
    watch_s(60, 0, 0);
    TEST_ASSERT_FLOAT_WITHIN(0.1f, 60, unflagged_s);
    TEST_ASSERT_INT32_WITHIN(700 * Pa, 3000 * Pa, conditioned.peak_Pa_q10);
  }
}

static void test_press_after_a_release_is_not_taken_for_a_remainder(void) {
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    begin_calm(periods_us[i]);
    press(20000 * Pa);
    run_s(5);
    press(0);
    run_s(3);
    TEST_ASSERT_FALSE(conditioned.contact);
    press(800 * Pa); /* within the band: in doubt, but not eaten */
    watch_s(2, 0, 0);
    TEST_ASSERT_TRUE(conditioned.contact);
    TEST_ASSERT_TRUE(conditioned.zero_doubtful);
    TEST_ASSERT_INT32_WITHIN(100 * Pa, 800 * Pa, conditioned.peak_Pa_q10);
    press(0);
    run_s(1);
    press(2000 * Pa);
    watch_s(5, 0, 0);
    TEST_ASSERT_FLOAT_WITHIN(0.1f, 5, unflagged_s);
    TEST_ASSERT_INT32_WITHIN(100 * Pa, 2000 * Pa, conditioned.peak_Pa_q10);
  }
}

/* What the zero comes back to after a certain press is the zero: no force is left there twice. */
static void test_a_press_proves_the_zero_that_it_leaves(void) {
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    for (int more = 0; more <= 1; more++) {
      begin_calm(periods_us[i]);
      press(20000 * Pa);
      run_s(5);
      press(600 * Pa);
      run_s(10);
      TEST_ASSERT_TRUE(conditioned.zero_doubtful);
      TEST_ASSERT_FALSE(conditioned.contact);
      press(20000 * Pa);
      run_s(5);
      TEST_ASSERT_FALSE(conditioned.zero_doubtful);
      press((more ? 1200 : 600) * Pa);
      run_s(3);
      TEST_ASSERT_FALSE(conditioned.contact);
      TEST_ASSERT_EQUAL(more, conditioned.zero_doubtful);
    }
    begin_calm(periods_us[i]); /* A press that is in doubt itself proves nothing. */
    press(20000 * Pa);
    run_s(5);
    press(600 * Pa);
    run_s(10);
    press(2000 * Pa);
    watch_s(5, 0, 0);
    TEST_ASSERT_TRUE(conditioned.contact);
    TEST_ASSERT_EQUAL_FLOAT(0, unflagged_s);
    press(600 * Pa);
    run_s(3);
    TEST_ASSERT_TRUE(conditioned.zero_doubtful);
  }
}

/* Where a strong press was meanwhile, it may be what remains of that. */
static void test_a_weak_contact_that_outlasts_a_strong_one_is_in_doubt(void) {
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    begin_calm(periods_us[i]);
    frame.pressure_Pa_q10[3] += 3000 * Pa;
    watch_s(60, 0, 0);
    TEST_ASSERT_EQUAL_FLOAT(contact_s, unflagged_s);
    frame.pressure_Pa_q10[11] += 30000 * Pa;
    watch_s(5, 0, 0);
    TEST_ASSERT_EQUAL_FLOAT(contact_s, unflagged_s);
    frame.pressure_Pa_q10[11] -= 30000 * Pa;
    watch_s(120, 0, 0);
    TEST_ASSERT_FLOAT_WITHIN(0.5f, 120, contact_s);
    TEST_ASSERT_EQUAL_FLOAT(0, unflagged_s);
    frame.pressure_Pa_q10[3] += 3000 * Pa;
    watch_s(5, 0, 0);
    TEST_ASSERT_EQUAL_FLOAT(contact_s, unflagged_s);
  }
}

static void press_in_steps(int32_t from, int32_t to, float seconds) {
  int count = frames_in(seconds);
  for (int i = 1; i <= count; i++) {
    press(from + (to - from) / count * i);
    run(1);
  }
}

/* Held, a touch that the band lets in part into the zero comes out of the band: what the zero took
 * stays in doubt, and a strong press on it is none. */
static void test_a_touch_that_a_zero_took_part_of_stays_in_doubt(void) {
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    begin_calm(periods_us[i]);
    press_in_steps(0, 47000 * Pa, 0.2f);
    run_s(4);
    press_in_steps(47000 * Pa, 0, 0.1f);
    run_s(1.2f);
    press_in_steps(0, 5100 * Pa, 0.15f);
    watch_s(0.7f, 0, 0);
    TEST_ASSERT_EQUAL_FLOAT(0, unflagged_s);
    watch_s(6, 0, 0);
    TEST_ASSERT_TRUE(conditioned.contact);
    TEST_ASSERT_LESS_THAN_INT32(4000 * Pa, conditioned.peak_Pa_q10);
    TEST_ASSERT_EQUAL_FLOAT(0, unflagged_s);
    press_in_steps(5100 * Pa, 15000 * Pa, 0.2f);
    run_s(1);
    TEST_ASSERT_TRUE(conditioned.zero_doubtful);
    press_in_steps(15000 * Pa, 47000 * Pa, 0.2f);
    run_s(1);
    TEST_ASSERT_FALSE(conditioned.zero_doubtful);
    press_in_steps(47000 * Pa, 5100 * Pa, 0.2f);
    run_s(0.1f);
    TEST_ASSERT_TRUE(conditioned.zero_doubtful);
    press(0);
    run_s(5);
    press_in_steps(0, 20000 * Pa, 0.1f);
    run_s(1);
    TEST_ASSERT_FALSE(conditioned.zero_doubtful);
  }
}

/* What the end of a release feels is no remainder. */
static void test_presses_in_quick_succession_move_no_zero(void) {
  static const float falls_s[] = {0.05f, 0.1f, 0.2f, 0.4f};
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    for (size_t j = 0; j < sizeof falls_s / sizeof falls_s[0]; j++) {
      begin_calm(periods_us[i]);
      int32_t worst = 0;
      for (int touches = 0; touches < 10; touches++) {
        press_in_steps(0, 20000 * Pa, 0.1f);
        run_s(0.2f);
        press_in_steps(20000 * Pa, 0, falls_s[j]);
        run_s(0.1f);
        int32_t off = condition.zero_Pa_q10[7] - AMBIENT;
        worst = off > worst ? off : worst;
      }
      TEST_ASSERT_LESS_THAN_INT32(20 * Pa, worst);
    }
  }
}

/* Sensors that felt nothing stand off by a share of what others felt. */
static void test_far_sensors_stand_off_too(void) {
  begin_calm(4854);
  frame.pressure_Pa_q10[7] = AMBIENT + 20000 * Pa;
  run_s(5);
  fill(AMBIENT);
  frame.pressure_Pa_q10[12] = AMBIENT + 500 * Pa;
  watch_s(60, 0, 0);
  TEST_ASSERT_EQUAL_FLOAT(0, unflagged_s);
  TEST_ASSERT_FALSE(conditioned.contact);
}

/* A contact that is no stronger than the drift of its time is in doubt, and followed slowly. */
static void test_weak_contact_for_long_is_in_doubt(void) {
  begin_calm(17544);
  frame.pressure_Pa_q10[7] += 300 * Pa;
  watch_s(600, 0, 0);
  TEST_ASSERT_EQUAL_FLOAT(contact_s, unflagged_s);
  run_s(900);
  TEST_ASSERT_TRUE(conditioned.contact);
  TEST_ASSERT_TRUE(conditioned.zero_doubtful);
  run_s(1000);
  TEST_ASSERT_FALSE(conditioned.contact);
  TEST_ASSERT_INT32_WITHIN(Pa, AMBIENT + 300 * Pa, condition.zero_Pa_q10[7]);
}

/* A zero that wanders makes a weak contact on it doubtful. */
static void test_contact_on_a_wandering_zero_is_in_doubt(void) {
  for (int wanders = 0; wanders <= 1; wanders++) {
    begin_calm(17544);
    for (int i = 0; i < 3; i++) {
      frame.pressure_Pa_q10[7] += 20000 * Pa;
      run_s(5);
      frame.pressure_Pa_q10[7] -= (wanders ? 19700 : 20000) * Pa;
      run_s(15);
    }
    run_s(60);
    frame.pressure_Pa_q10[7] += 350 * Pa;
    run(1);
    TEST_ASSERT_TRUE(conditioned.contact);
    TEST_ASSERT_EQUAL(wanders, conditioned.zero_doubtful);
    run_s(1);
    TEST_ASSERT_TRUE(conditioned.contact);
    TEST_ASSERT_EQUAL(wanders, conditioned.zero_doubtful);
  }
}

/* Some real sensors creep by 10 Pa/s for minutes: more than the zero may follow. */
static void test_what_crept_up_is_in_doubt_and_what_is_sudden_is_not(void) {
  for (int p = 0; p < FAST_PERIODS; p++) {
    begin_calm(periods_us[p]);
    watch_s(60, 10.0f, 1 << 3);
    TEST_ASSERT_GREATER_THAN(30.0f, contact_s);
    TEST_ASSERT_FLOAT_WITHIN(0.5f, 0.0f, unflagged_s);
    watch_s(60, 0.0f, 0);
    TEST_ASSERT_TRUE(conditioned.contact);
    TEST_ASSERT_FLOAT_WITHIN(0.5f, 0.0f, unflagged_s);
    int32_t crept = frame.pressure_Pa_q10[3];
    press(3000 * 1024);
    frame.pressure_Pa_q10[3] += crept - AMBIENT;
    run_s(0.2f);
    TEST_ASSERT_TRUE(conditioned.contact);
    run_s((float)SENSORS * 0.064f);
    TEST_ASSERT_FALSE(conditioned.zero_doubtful);

    begin_calm(periods_us[p]);
    watch_s(30, 100.0f, 1 << 7); /* 0.02 N/s on 12 mm of rubber */
    TEST_ASSERT_GREATER_THAN(25.0f, contact_s);
    TEST_ASSERT_FLOAT_WITHIN(1.5f, 0.0f, unflagged_s - contact_s);
    TEST_ASSERT_FALSE(conditioned.zero_doubtful);
  }
}

static void test_invalid_sensors_are_left_out(void) {
  frame.valid = ALL & ~4u;
  frame.pressure_Pa_q10[2] = 0;
  run(17);
  TEST_ASSERT_TRUE(conditioned.tared);
  TEST_ASSERT_EQUAL_HEX32(ALL & ~4u, conditioned.usable);
  TEST_ASSERT_EQUAL_INT32(0, conditioned.pressure_Pa_q10[2]);
  /* It comes late: its own sixteen readings, while the others go on. */
  fill(AMBIENT);
  frame.valid = ALL;
  frame.pressure_Pa_q10[2] = AMBIENT + 777;
  for (int i = 0; i < 16; i++) {
    run(1);
    TEST_ASSERT_FALSE(conditioned.tared);
    TEST_ASSERT_EQUAL_HEX32(ALL & ~4u, conditioned.usable);
  }
  run(1);
  TEST_ASSERT_TRUE(conditioned.tared);
  TEST_ASSERT_EQUAL_HEX32(ALL, conditioned.usable);
  TEST_ASSERT_EQUAL_INT32(0, conditioned.pressure_Pa_q10[2]);
  /* A gap later on changes nothing of its zero. */
  frame.valid = ALL & ~4u;
  frame.pressure_Pa_q10[2] = 0;
  run(1000);
  frame.valid = ALL;
  frame.pressure_Pa_q10[2] = AMBIENT + 777;
  run(1);
  TEST_ASSERT_EQUAL_INT32(AMBIENT + 777, condition.zero_Pa_q10[2]);
}

static void test_unsettled_readings_move_no_zero(void) {
  begin_calm(4854);
  frame.doubtful = frame.unsettled = 1u << 7;
  frame.pressure_Pa_q10[7] += 100 * Pa;
  run_s(60);
  TEST_ASSERT_INT32_WITHIN(Pa, AMBIENT, condition.zero_Pa_q10[7]);
  frame.doubtful = frame.unsettled = 0;
  run_s(400);
  TEST_ASSERT_INT32_WITHIN(Pa, AMBIENT + 100 * Pa, condition.zero_Pa_q10[7]);
}

static void test_saturated_sensor_means_contact_and_is_left_out(void) {
  begin_calm(4854);
  frame.saturated = 8;
  frame.pressure_Pa_q10[3] = INT32_MAX;
  run(1);
  TEST_ASSERT_TRUE(conditioned.contact);
  TEST_ASSERT_EQUAL_HEX32(ALL & ~8u, conditioned.usable);
  TEST_ASSERT_EQUAL_INT32(0, conditioned.pressure_Pa_q10[3]);
  TEST_ASSERT_EQUAL_INT32(0, conditioned.peak_Pa_q10);
  run_s(2);
  TEST_ASSERT_INT32_WITHIN(Pa, AMBIENT, condition.zero_Pa_q10[3]);
  /* What remains of it is that of a strong press. */
  frame.saturated = 0;
  fill(AMBIENT);
  frame.pressure_Pa_q10[3] = AMBIENT + 8000 * Pa;
  run_s(0.1f);
  TEST_ASSERT_TRUE(conditioned.zero_doubtful);
  /* Nor does it enter a tare. */
  condition_tare(&condition);
  frame.saturated = 8;
  run(17);
  TEST_ASSERT_EQUAL_HEX32(ALL & ~8u, conditioned.usable);
  frame.saturated = 0;
  fill(AMBIENT);
  run(17);
  TEST_ASSERT_EQUAL_INT32(AMBIENT, condition.zero_Pa_q10[3]);
}

/* The press becomes the zero; after it the pad reads negative, says so, and is tared again. */
static void test_tare_during_contact(void) {
  begin_calm(4854);
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
static void test_reading_below_zero_is_tared_anew_when_it_stays(void) {
  static const int32_t depths_Pa[] = {400, 900};
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    for (size_t j = 0; j < 2; j++) {
      begin_calm(periods_us[i]);
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

static void test_gains_act_on_what_is_above_zero(void) {
  struct condition_gains gains;
  static const uint32_t inverses_q16[] = {16384, 50000, 65535, 65536, 65537, 80000, 131072, 262144};
  for (size_t i = 0; i < sizeof inverses_q16 / sizeof inverses_q16[0]; i++) {
    for (int k = 0; k < FT_MAX_SENSORS; k++) {
      gains.inverse_q16[k] = k == 7 ? inverses_q16[i] : 65536;
    }
    static const int32_t above[] = {0,        1,         -1,          1023,        -1025,
                                    12345678, -98765432, 200000 * Pa, -90000 * Pa, 524288 * Pa - 1};
    for (size_t j = 0; j < sizeof above / sizeof above[0]; j++) {
      setUp();
      run(17);
      frame.pressure_Pa_q10[7] = AMBIENT + above[j];
      frame.pressure_Pa_q10[8] = AMBIENT + above[j];
      condition_frame(&condition, &frame, &gains, &conditioned);
      condition_follow(&condition, &frame, &conditioned);
      int64_t wanted = (int64_t)above[j] * inverses_q16[i];
      wanted = (wanted - (wanted & 0xFFFF)) / 65536;
      TEST_ASSERT_INT32_WITHIN(1, (int32_t)wanted, conditioned.pressure_Pa_q10[7]);
      TEST_ASSERT_EQUAL_INT32(above[j], conditioned.pressure_Pa_q10[8]);
      TEST_ASSERT_EQUAL_INT32(AMBIENT, condition.zero_Pa_q10[7]);
    }
    /* More is as much. */
    frame.pressure_Pa_q10[7] = INT32_MAX;
    int32_t most = conditioned.pressure_Pa_q10[7];
    condition_frame(&condition, &frame, &gains, &conditioned);
    TEST_ASSERT_EQUAL_INT32(most, conditioned.pressure_Pa_q10[7]);
  }
}

static void assert_condition_is(const struct condition *expected) {
  TEST_ASSERT_EQUAL_MEMORY(expected, &condition, sizeof condition);
}

/* The zeros that an answer is sent with are those it was measured from. */
static void test_what_the_answer_does_not_need_can_wait(void) {
  struct condition before;
  begin_calm(1000);
  memcpy(&before, &condition, sizeof before);
  condition_follow(&condition, &frame, &conditioned);
  assert_condition_is(&before);
  press(20000 * Pa);
  int32_t reached = 0;
  for (int i = 0; i < 200; i++) {
    memcpy(&before, &condition, sizeof before);
    frame.t_us += period_us;
    condition_frame(&condition, &frame, NULL, &conditioned);
    TEST_ASSERT_TRUE(conditioned.contact && !conditioned.zero_doubtful);
    TEST_ASSERT_EQUAL_INT32_ARRAY(before.zero_Pa_q10, condition.zero_Pa_q10, SENSORS);
    TEST_ASSERT_EQUAL_MEMORY(before.sensor, condition.sensor, sizeof condition.sensor);
    condition_follow(&condition, &frame, &conditioned);
    if (condition.sensor[7].after.memory_Pa_q10 > reached) {
      reached = condition.sensor[7].after.memory_Pa_q10;
    }
    memcpy(&before, &condition, sizeof before);
    condition_follow(&condition, &frame, &conditioned);
    assert_condition_is(&before);
  }
  TEST_ASSERT_INT32_WITHIN(500 * Pa, 20000 * Pa, reached);
  for (int k = 0; k < SENSORS; k++) {
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(70, condition.now_ms - condition.sensor[k].looked_ms);
  }
}

static void test_extremes(void) {
  static const int32_t extremes[] = {INT32_MIN, INT32_MIN + 1, -1, 0, 1, INT32_MAX - 1, INT32_MAX};
  static const int32_t megapascal = 1 << 30;
  for (size_t tare = 0; tare < 7; tare++) {
    for (size_t now = 0; now < 7; now++) {
      setUp();
      fill(extremes[tare]);
      run(16);
      int32_t zero = extremes[tare] > megapascal    ? megapascal
                     : extremes[tare] < -megapascal ? -megapascal
                                                    : extremes[tare];
      TEST_ASSERT_EQUAL_INT32(zero, condition.zero_Pa_q10[0]);
      fill(extremes[now]);
      run(1);
      int64_t above = (int64_t)extremes[now] - zero;
      above = above > INT32_MAX ? INT32_MAX : above < INT32_MIN ? INT32_MIN : above;
      TEST_ASSERT_EQUAL_INT32((int32_t)above, conditioned.pressure_Pa_q10[0]);
      TEST_ASSERT_EQUAL(above > OPEN, conditioned.contact);
      run_s(40);
      if (above < OPEN && extremes[now] > -megapascal) {
        TEST_ASSERT_INT32_WITHIN(Pa, 0, conditioned.pressure_Pa_q10[0]);
      }
    }
  }
}

static void test_random_frames(void) {
  struct random random = {42};
  for (int i = 0; i < 200000; i++) {
    if (random_below(&random, 200) == 0) {
      condition_tare(&condition);
    }
    if (random_below(&random, 50) == 0) {
      period_us = random_u32(&random) >> random_below(&random, 32);
    }
    frame.sensor_count = (uint8_t)(1 + random_below(&random, 32));
    uint32_t all = UINT32_MAX >> (32 - frame.sensor_count);
    frame.valid = random_u32(&random) & all;
    frame.saturated = random_u32(&random) & random_u32(&random) & random_u32(&random) & all;
    frame.saturated &= random_below(&random, 2) ? 0 : all;
    frame.doubtful = random_u32(&random) & random_u32(&random) & all;
    frame.noise_Pa_q10 = (int32_t)(1 + random_below(&random, 20000));
    for (int k = 0; k < frame.sensor_count; k++) {
      frame.pressure_Pa_q10[k] = (int32_t)random_u32(&random) >> random_below(&random, 32);
    }
    run(1);
    TEST_ASSERT_EQUAL_HEX32(0, conditioned.usable & ~(frame.valid & ~frame.saturated));
    int32_t peak = 0;
    for (int k = 0; k < frame.sensor_count; k++) {
      bool usable = conditioned.usable >> k & 1u;
      TEST_ASSERT_TRUE(usable || conditioned.pressure_Pa_q10[k] == 0);
      peak = conditioned.pressure_Pa_q10[k] > peak ? conditioned.pressure_Pa_q10[k] : peak;
    }
    TEST_ASSERT_EQUAL_INT32(peak, conditioned.peak_Pa_q10);
  }
}

/* A sensor that took another's place has another zero; the others keep theirs. */
static void test_another_sensor_is_tared_anew(void) {
  begin_calm(4854);
  TEST_ASSERT_TRUE(conditioned.tared);
  frame.pressure_Pa_q10[4] += 300 * 1024;
  frame.renewed = 1u << 4;
  run(1);
  frame.renewed = 0;
  TEST_ASSERT_FALSE(conditioned.tared);
  TEST_ASSERT_FALSE(conditioned.contact);
  TEST_ASSERT_EQUAL_HEX32(ALL & ~(1u << 4), conditioned.usable);
  run(ZERO_TARE_FRAMES);
  TEST_ASSERT_TRUE(conditioned.tared);
  TEST_ASSERT_FALSE(conditioned.contact);
  TEST_ASSERT_EQUAL_INT32(0, conditioned.pressure_Pa_q10[4]);
}

/* Its supply dipped while the zero was taken, which is found out when it has been reset. A zero
 * from long before is its own. */
static void test_zero_of_a_sensor_that_had_lost_its_state_is_taken_anew(void) {
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

/* Wrong zeros may make a contact, so the wait has an end. */
static void test_a_zero_taken_in_a_long_contact_is_in_doubt_until_it_ends(void) {
  begin_calm(4854);
  press(20000 * Pa);
  run_s(0.5f);
  frame.renewed = 1u << 8;
  run(1);
  frame.renewed = 0;
  run_s(9.5f);
  TEST_ASSERT_EQUAL_HEX32(ALL, conditioned.usable);
  TEST_ASSERT_TRUE(conditioned.contact);
  watch_s(5, 0, 0);
  TEST_ASSERT_TRUE(conditioned.contact);
  TEST_ASSERT_EQUAL_FLOAT(0, unflagged_s);
  press(0);
  run(2 + ZERO_TARE_FRAMES);
  TEST_ASSERT_EQUAL_INT32(AMBIENT, condition.zero_Pa_q10[8]);
  press(20000 * Pa);
  run_s(0.5f);
  TEST_ASSERT_TRUE(conditioned.tared);
  TEST_ASSERT_FALSE(conditioned.zero_doubtful);
}

/* A zero taken under a press would be off by it. */
static void test_one_sensor_is_not_tared_in_a_contact(void) {
  begin_calm(4854);
  press(20000 * Pa);
  run_s(0.5f);
  frame.renewed = 1u << 8;
  run(1);
  frame.renewed = 0;
  run_s(5);
  TEST_ASSERT_TRUE(conditioned.contact);
  TEST_ASSERT_FALSE(conditioned.tared);
  TEST_ASSERT_EQUAL_HEX32(ALL & ~(1u << 8), conditioned.usable);
  press(0);
  run(2 + ZERO_TARE_FRAMES);
  TEST_ASSERT_TRUE(conditioned.tared);
  TEST_ASSERT_EQUAL_HEX32(ALL, conditioned.usable);
  TEST_ASSERT_EQUAL_INT32(AMBIENT, condition.zero_Pa_q10[8]);
}

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(test_tare_is_the_mean_without_the_extremes);
  RUN_TEST(test_slow_frames_need_fewer_readings_for_a_tare);
  RUN_TEST(test_zero_improves_after_the_tare);
  RUN_TEST(test_warming_up_is_no_contact);
  RUN_TEST(test_what_a_cold_sensor_rises_is_no_contact);
  RUN_TEST(test_a_light_touch_is_seen_once_zeros_have_settled);
  RUN_TEST(test_a_ramp_from_the_start_is_a_contact);
  RUN_TEST(test_gate_has_a_hysteresis_in_pascals_and_sigmas);
  RUN_TEST(test_one_disturbed_reading_moves_no_zero);
  RUN_TEST(test_zero_follows_any_drift_of_a_barometer);
  RUN_TEST(test_a_tare_under_a_press_is_mended_for_all_sensors);
  RUN_TEST(test_zero_follows_the_drift_of_a_doubtful_sensor);
  RUN_TEST(test_no_slow_force_is_taken_for_a_drift);
  RUN_TEST(test_what_compensation_costs_is_no_contact);
  RUN_TEST(test_zero_stands_still_during_contact);
  RUN_TEST(test_drift_goes_on_during_contact);
  RUN_TEST(test_other_changes_are_learnt_as_no_drift);
  RUN_TEST(test_a_slow_press_is_learnt_as_no_drift);
  RUN_TEST(test_zero_recovers_after_a_long_contact);
  RUN_TEST(test_what_rubber_does_after_a_release_is_no_contact);
  RUN_TEST(test_a_force_left_after_a_release_is_flagged);
  RUN_TEST(test_press_after_a_release_is_not_taken_for_a_remainder);
  RUN_TEST(test_a_press_proves_the_zero_that_it_leaves);
  RUN_TEST(test_a_weak_contact_that_outlasts_a_strong_one_is_in_doubt);
  RUN_TEST(test_a_touch_that_a_zero_took_part_of_stays_in_doubt);
  RUN_TEST(test_presses_in_quick_succession_move_no_zero);
  RUN_TEST(test_far_sensors_stand_off_too);
  RUN_TEST(test_weak_contact_for_long_is_in_doubt);
  RUN_TEST(test_contact_on_a_wandering_zero_is_in_doubt);
  RUN_TEST(test_what_crept_up_is_in_doubt_and_what_is_sudden_is_not);
  RUN_TEST(test_invalid_sensors_are_left_out);
  RUN_TEST(test_unsettled_readings_move_no_zero);
  RUN_TEST(test_saturated_sensor_means_contact_and_is_left_out);
  RUN_TEST(test_tare_during_contact);
  RUN_TEST(test_reading_below_zero_is_tared_anew_when_it_stays);
  RUN_TEST(test_gains_act_on_what_is_above_zero);
  RUN_TEST(test_what_the_answer_does_not_need_can_wait);
  RUN_TEST(test_extremes);
  RUN_TEST(test_random_frames);
  RUN_TEST(test_another_sensor_is_tared_anew);
  RUN_TEST(test_zero_of_a_sensor_that_had_lost_its_state_is_taken_anew);
  RUN_TEST(test_one_sensor_is_not_tared_in_a_contact);
  RUN_TEST(test_a_zero_taken_in_a_long_contact_is_in_doubt_until_it_ends);
  return UNITY_END();
}
