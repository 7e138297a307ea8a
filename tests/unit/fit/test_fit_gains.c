/* How far gains are apart, learnt from touches. */
#include "common/contact_flags.h"
#include "fit/fit_gains.h"
#include "support/grid.h"
#include "support/random.h"
#include "unity.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define SENSORS GRID_SENSORS
#define ALL ((UINT32_C(1) << SENSORS) - 1)
#define ASSUMED 0.105f

static struct fit_array array;
static struct random random;
static struct fit_settings settings;
static double gain[SENSORS];

void setUp(void) {
  make_grid_of_15(&array);
  for (int k = 0; k < SENSORS; k++) {
    gain[k] = 1.0;
  }
  random = (struct random){UINT64_C(20221015)};
  settings = (struct fit_settings){.iterations = 4, .noise_Pa_q10 = 4096};
  fit_set_errors(&settings, ASSUMED, 0.0f);
}

void tearDown(void) {}

struct touch {
  double p0_Pa, sigma_mm, x_mm, y_mm;
};

static struct touch anywhere(double p0_Pa, double sigma_mm) {
  return (struct touch){p0_Pa, sigma_mm, random_between(&random, -9.0, 9.0), random_between(&random, -18.0, 18.0)};
}

static void feel(struct touch touch, int32_t *pressure_Pa_q10, struct fit_result *result) {
  for (int k = 0; k < SENSORS; k++) {
    const double dx = 9.0 * (k / 5 - 1) - touch.x_mm, dy = 9.0 * (k % 5 - 2) - touch.y_mm;
    const double bell = exp(-(dx * dx + dy * dy) / (2.0 * touch.sigma_mm * touch.sigma_mm));
    pressure_Pa_q10[k] = (int32_t)lround(1024.0 * (gain[k] * touch.p0_Pa * bell + 4.0 * random_normal(&random)));
  }
  fit_gaussian(&array, pressure_Pa_q10, ALL, &settings, result);
}

/* Two looks. Whether it counts. */
static bool hold(struct fit_gains *gains, struct touch touch) {
  int32_t pressure_Pa_q10[SENSORS];
  struct fit_result result;
  fit_gains_lift(gains);
  feel(touch, pressure_Pa_q10, &result);
  TEST_ASSERT_FALSE(fit_gains_learn(gains, &array, pressure_Pa_q10, &settings, &result));
  feel(touch, pressure_Pa_q10, &result);
  return fit_gains_learn(gains, &array, pressure_Pa_q10, &settings, &result);
}

static void test_touches_tell_how_far_gains_are_apart(void) {
  static const double spreads[] = {0.1, 0.15, 0.2};
  for (int s = 0; s < 3; s++) {
    double squares = 0.0;
    for (int pad = 0; pad < 100; pad++) {
      struct fit_gains gains;
      fit_gains_begin(&gains, ASSUMED);
      for (int k = 0; k < SENSORS; k++) {
        gain[k] = 1.0 + spreads[s] * random_normal(&random);
      }
      for (int i = 0; i < 60; i++) {
        hold(&gains, anywhere(14000.0, random_between(&random, 5.2, 6.2)));
      }
      const double sd = (double)fit_gains_sd(&gains);
      squares += sd * sd / 100.0;
    }
    char text[60];
    snprintf(text, sizeof text, "gains apart by %.2f: learnt %.4f", spreads[s], sqrt(squares));
    /* of 64 touches four stay what was assumed */
    const double expected = sqrt((60.0 * spreads[s] * spreads[s] + 4.0 * 0.105 * 0.105) / 64.0);
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.12 * expected + 0.002, expected, sqrt(squares), text);
  }
}

static void test_a_touch_counts_once_and_when_it_rests(void) {
  struct fit_gains gains;
  fit_gains_begin(&gains, ASSUMED);
  TEST_ASSERT_FLOAT_WITHIN(1e-5f, ASSUMED, fit_gains_sd(&gains));
  struct touch touch = {5000.0, 5.6, 1.0, 2.0};
  int32_t pressure_Pa_q10[SENSORS];
  struct fit_result result;
  for (int i = 0; i < 10; i++) { /* it still grows */
    touch.p0_Pa *= 1.05;
    feel(touch, pressure_Pa_q10, &result);
    TEST_ASSERT_FALSE(fit_gains_learn(&gains, &array, pressure_Pa_q10, &settings, &result));
  }
  feel(touch, pressure_Pa_q10, &result);
  TEST_ASSERT_TRUE(fit_gains_learn(&gains, &array, pressure_Pa_q10, &settings, &result));
  const float sd = fit_gains_sd(&gains);
  TEST_ASSERT_TRUE(sd < 0.97f * ASSUMED);
  for (int i = 0; i < 10; i++) {
    feel(touch, pressure_Pa_q10, &result);
    TEST_ASSERT_FALSE(fit_gains_learn(&gains, &array, pressure_Pa_q10, &settings, &result));
  }
  TEST_ASSERT_EQUAL_FLOAT(sd, fit_gains_sd(&gains));
  TEST_ASSERT_TRUE(hold(&gains, touch));
}

static void test_what_does_not_tell_does_not_count(void) {
  struct fit_gains gains, before;
  fit_gains_begin(&gains, ASSUMED);
  before = gains;
  TEST_ASSERT_FALSE(hold(&gains, (struct touch){300.0, 5.6, 1.0, 2.0}));     /* noise */
  TEST_ASSERT_FALSE(hold(&gains, (struct touch){900000.0, 3.0, 1.0, 2.0}));  /* thin rubber */
  TEST_ASSERT_FALSE(hold(&gains, (struct touch){14000.0, 5.6, 30.0, 2.0}));  /* beside the array */
  TEST_ASSERT_FALSE(hold(&gains, (struct touch){14000.0, 200.0, 1.0, 2.0})); /* flat */
  TEST_ASSERT_FALSE(hold(&gains, (struct touch){0.0, 5.6, 1.0, 2.0}));
  TEST_ASSERT_EQUAL_FLOAT(before.residual, gains.residual);
  int32_t pressure_Pa_q10[SENSORS];
  struct fit_result result;
  for (int i = 0; i < 2; i++) {
    feel((struct touch){14000.0, 5.6, 1.0, 2.0}, pressure_Pa_q10, &result);
    fit_gaussian(&array, pressure_Pa_q10, ALL & ~1u, &settings, &result);
    TEST_ASSERT_FALSE(fit_gains_learn(&gains, &array, pressure_Pa_q10, &settings, &result));
  }
}

/* Nothing of the model is wrong in its residual, and its place is. */
static void test_a_fit_at_a_limit_does_not_count(void) {
  struct fit_gains gains;
  fit_gains_begin(&gains, ASSUMED);
  int32_t pressure_Pa_q10[SENSORS];
  struct fit_result result;
  for (int i = 0; i < 4; i++) {
    feel((struct touch){14000.0, 5.6, 1.0, 2.0}, pressure_Pa_q10, &result);
    result.flags |= i < 2 ? CONTACT_FLAG_AT_BOUND : CONTACT_FLAG_FLAT;
    TEST_ASSERT_FALSE(fit_gains_learn(&gains, &array, pressure_Pa_q10, &settings, &result));
  }
}

static void test_an_odd_touch_says_little(void) {
  struct fit_gains gains;
  fit_gains_begin(&gains, ASSUMED);
  for (int k = 0; k < SENSORS; k++) {
    gain[k] = k % 2 ? 0.5 : 1.5;
  }
  TEST_ASSERT_TRUE(hold(&gains, (struct touch){14000.0, 6.0, 1.0, 2.0}));
  TEST_ASSERT_TRUE(fit_gains_sd(&gains) > 0.12f && fit_gains_sd(&gains) < 0.22f);
}

static void test_eight_sensors_learn_nothing(void) {
  float x_mm[8], y_mm[8];
  for (int k = 0; k < 8; k++) {
    x_mm[k] = 9.0f * (float)(k / 4);
    y_mm[k] = 9.0f * (float)(k % 4);
  }
  TEST_ASSERT_EQUAL(FT_OK, fit_array_init(&array, 8, x_mm, y_mm, 9.0f));
  struct fit_gains gains;
  fit_gains_begin(&gains, ASSUMED);
  int32_t pressure_Pa_q10[8];
  struct fit_result result;
  for (int look = 0; look < 2; look++) {
    for (int k = 0; k < 8; k++) {
      const double dx = (double)x_mm[k] - 5.0, dy = (double)y_mm[k] - 14.0;
      pressure_Pa_q10[k] = (int32_t)lround(1024.0 * 14000.0 * exp(-(dx * dx + dy * dy) / 62.7));
    }
    fit_gaussian(&array, pressure_Pa_q10, 0xFF, &settings, &result);
    TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_FIT_VALID, result.flags);
    TEST_ASSERT_FALSE(fit_gains_learn(&gains, &array, pressure_Pa_q10, &settings, &result));
  }
}

/* The law is one of rectangles. */
static void test_a_strip_learns_nothing(void) {
  float x_mm[SENSORS], y_mm[SENSORS];
  for (int k = 0; k < SENSORS; k++) {
    x_mm[k] = 0.0f;
    y_mm[k] = 9.0f * (float)(k - 7);
  }
  TEST_ASSERT_EQUAL(FT_OK, fit_array_init(&array, SENSORS, x_mm, y_mm, 9.0f));
  struct fit_gains gains;
  fit_gains_begin(&gains, ASSUMED);
  int32_t pressure_Pa_q10[SENSORS];
  struct fit_result result;
  for (int look = 0; look < 2; look++) {
    for (int k = 0; k < SENSORS; k++) {
      const double bell = exp(-9.0 * 9.0 * (k - 7) * (k - 7) / (2.0 * 5.6 * 5.6));
      pressure_Pa_q10[k] = (int32_t)lround(1024.0 * (14000.0 * bell + 4.0 * random_normal(&random)));
    }
    fit_gaussian(&array, pressure_Pa_q10, ALL, &settings, &result);
    TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_FIT_VALID, result.flags);
    TEST_ASSERT_FALSE(fit_gains_learn(&gains, &array, pressure_Pa_q10, &settings, &result));
  }
}

/* A skin is changed: what sixty touches told of the old one fades. */
static void test_another_pad_is_learnt(void) {
  struct fit_gains gains;
  fit_gains_begin(&gains, ASSUMED);
  for (int i = 0; i < 300; i++) {
    hold(&gains, anywhere(14000.0, 5.6));
  }
  TEST_ASSERT_EQUAL_FLOAT(0.08f, fit_gains_sd(&gains)); /* a tilt may hide */
  for (int k = 0; k < SENSORS; k++) {
    gain[k] = 1.0 + 0.2 * random_normal(&random);
  }
  for (int i = 0; i < 100; i++) {
    hold(&gains, anywhere(14000.0, 5.6));
  }
  TEST_ASSERT_TRUE(fit_gains_sd(&gains) > 0.12f);
}

/* One wild touch is one touch. */
static void test_an_sd_has_limits(void) {
  struct fit_gains gains;
  fit_gains_begin(&gains, ASSUMED);
  for (int k = 0; k < SENSORS; k++) {
    gain[k] = k % 2 ? 0.1 : 3.0;
  }
  for (int i = 0; i < 300; i++) {
    hold(&gains, anywhere(14000.0, 6.5));
  }
  TEST_ASSERT_TRUE(fit_gains_sd(&gains) <= 0.5f);
  fit_gains_begin(&gains, 0.0f);
  TEST_ASSERT_EQUAL_FLOAT(0.08f, fit_gains_sd(&gains));
}

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(test_touches_tell_how_far_gains_are_apart);
  RUN_TEST(test_a_touch_counts_once_and_when_it_rests);
  RUN_TEST(test_what_does_not_tell_does_not_count);
  RUN_TEST(test_a_fit_at_a_limit_does_not_count);
  RUN_TEST(test_an_odd_touch_says_little);
  RUN_TEST(test_eight_sensors_learn_nothing);
  RUN_TEST(test_a_strip_learns_nothing);
  RUN_TEST(test_another_pad_is_learnt);
  RUN_TEST(test_an_sd_has_limits);
  return UNITY_END();
}
