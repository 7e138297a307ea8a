/* A load that is not estimated: its trace in the residual, and what that makes of the error. */
#include "common/contact_flags.h"
#include "fit/fit_doubt.h"
#include "support/grid.h"
#include "support/random.h"
#include "unity.h"

#include <math.h>
#include <stdio.h>

#define SENSORS GRID_SENSORS
#define ALL ((UINT32_C(1) << SENSORS) - 1)
#define NOISE_Pa 4.0

static struct fit_array array;
static struct random noise;

void setUp(void) {
  make_grid_of_15(&array);
  noise = (struct random){UINT64_C(20221015)};
}

void tearDown(void) {}

/* 5 N on 12 mm of rubber, the sums of Gaussians of its profile (common/pad_profile.h). */
static void press(double x_mm, double y_mm, double qx, double qy, int32_t *pressure_Pa_q10) {
  static const double share[] = {0.0962, 0.8206}, sd_mm[] = {3.563, 5.739};
  static const double moment_mm[] = {1.052, 4.015, 5.431}, pull_sd_mm[] = {4.803, 7.883, 19.82};
  for (int k = 0; k < SENSORS; k++) {
    double dx = 9.0 * (k / 5 - 1) - x_mm, dy = 9.0 * (k % 5 - 2) - y_mm, sum = 0.0;
    for (int j = 0; j < 2; j++) {
      double v = sd_mm[j] * sd_mm[j] + 4.0;
      sum += share[j] / v * exp(-(dx * dx + dy * dy) / (2.0 * v));
    }
    for (int j = 0; j < 3; j++) {
      double v = pull_sd_mm[j] * pull_sd_mm[j] + 5.2;
      sum += (qx * dx + qy * dy) * moment_mm[j] / (v * v) * exp(-(dx * dx + dy * dy) / (2.0 * v));
    }
    double pressure_Pa = 5e6 / 6.28318531 * sum + NOISE_Pa * random_between(&noise, -1.0, 1.0);
    pressure_Pa_q10[k] = (int32_t)lround(1024.0 * pressure_Pa);
  }
}

static struct fit_settings usual(void) {
  struct fit_settings settings = {.iterations = 4, .noise_Pa_q10 = (int32_t)(1024 * NOISE_Pa)};
  fit_set_errors(&settings, 0.015f, 0.0065f);
  return settings;
}

/* A press that is held until the look has ended. */
static void hold(struct fit_doubt *load, const int32_t *pressure_Pa_q10, uint32_t usable,
                 const struct fit_settings *settings, struct fit_result *result) {
  fit_gaussian(&array, pressure_Pa_q10, usable, settings, result);
  for (int part = 0; part < FIT_DOUBT_PARTS; part++) {
    fit_doubt_follow(load, &array, pressure_Pa_q10, settings, result);
  }
  fit_doubt_widen(load, &array, settings, result);
}

static void test_a_load_is_part_of_the_error(void) {
  const struct fit_settings settings = usual();
  double errors_mm = 0.0, said_mm = 0.0;
  int silent = 0;
  for (int i = 0; i < 400; i++) {
    double x_mm = random_between(&noise, -6.0, 6.0), y_mm = random_between(&noise, -14.0, 14.0);
    double ratio = random_between(&noise, 0.25, 0.5), angle = random_between(&noise, 0.0, 6.28);
    int32_t pressure_Pa_q10[SENSORS];
    press(x_mm, y_mm, ratio * cos(angle), ratio * sin(angle), pressure_Pa_q10);
    struct fit_result result;
    struct fit_doubt load = {0};
    hold(&load, pressure_Pa_q10, ALL, &settings, &result);
    double error_mm = hypot((double)result.x_mm - x_mm, (double)result.y_mm - y_mm);
    TEST_ASSERT_TRUE(error_mm > 0.6);
    errors_mm += error_mm;
    said_mm += (double)result.location_sd_mm;
    silent += error_mm > 1.0 && !(result.flags & CONTACT_FLAG_UNCERTAIN);
  }
  char text[80];
  snprintf(text, sizeof text, "off %.2f mm, said %.2f mm, %d silent", errors_mm / 400.0, said_mm / 400.0, silent);
  TEST_ASSERT_TRUE_MESSAGE(fabs(said_mm / errors_mm - 1.0) < 0.2, text);
  TEST_ASSERT_LESS_OR_EQUAL_INT_MESSAGE(4, silent, text);
}

static void test_without_a_load_little_is_added(void) {
  const struct fit_settings settings = usual();
  int more = 0;
  for (int i = 0; i < 200; i++) {
    int32_t pressure_Pa_q10[SENSORS];
    press(random_between(&noise, -9.0, 9.0), random_between(&noise, -18.0, 18.0), 0.0, 0.0, pressure_Pa_q10);
    struct fit_result with, without;
    struct fit_doubt load = {0};
    fit_gaussian(&array, pressure_Pa_q10, ALL, &settings, &without);
    hold(&load, pressure_Pa_q10, ALL, &settings, &with);
    TEST_ASSERT_TRUE(with.location_sd_mm >= without.location_sd_mm * 0.999f);
    more += with.location_sd_mm > without.location_sd_mm + 0.25f;
  }
  TEST_ASSERT_LESS_OR_EQUAL(2, more);
}

/* Until a look has ended the load is what is usual, and so again after the contact. */
static void test_before_the_first_look_a_load_is_assumed(void) {
  const struct fit_settings settings = usual();
  int32_t pressure_Pa_q10[SENSORS];
  press(2.0, 3.0, 0.0, 0.0, pressure_Pa_q10);
  struct fit_result fitted;
  fit_gaussian(&array, pressure_Pa_q10, ALL, &settings, &fitted);
  struct fit_doubt load = {0};
  for (int contact = 0; contact < 2; contact++) {
    for (int part = 0; part < FIT_DOUBT_PARTS; part++) {
      struct fit_result result = fitted;
      fit_doubt_widen(&load, &array, &settings, &result);
      TEST_ASSERT_FLOAT_WITHIN(0.01f, hypotf(fitted.location_sd_mm, FIT_DOUBT_USUAL * 0.38f * 9.0f),
                               result.location_sd_mm);
      TEST_ASSERT_TRUE(result.flags & CONTACT_FLAG_UNCERTAIN);
      fit_doubt_follow(&load, &array, pressure_Pa_q10, &settings, &result);
    }
    struct fit_result result = fitted;
    fit_doubt_widen(&load, &array, &settings, &result);
    TEST_ASSERT_TRUE(result.location_sd_mm < fitted.location_sd_mm + 0.1f);
    fit_doubt_begin(&load);
  }
}

/* A look is of the readings that it began with. */
static void test_a_look_does_not_mix_frames(void) {
  const struct fit_settings settings = usual();
  int32_t loaded_Pa_q10[SENSORS], other_Pa_q10[SENSORS];
  press(2.0, 3.0, 0.4, 0.1, loaded_Pa_q10);
  press(-5.0, 8.0, 0.0, 0.0, other_Pa_q10);
  struct fit_result loaded, other;
  struct fit_doubt held = {0}, moved = {0};
  hold(&held, loaded_Pa_q10, ALL, &settings, &loaded);
  fit_gaussian(&array, loaded_Pa_q10, ALL, &settings, &loaded);
  fit_gaussian(&array, other_Pa_q10, ALL, &settings, &other);
  fit_doubt_follow(&moved, &array, loaded_Pa_q10, &settings, &loaded);
  for (int part = 1; part < FIT_DOUBT_PARTS; part++) {
    TEST_ASSERT_FALSE(moved.known);
    fit_doubt_follow(&moved, &array, other_Pa_q10, &settings, &other);
  }
  TEST_ASSERT_TRUE(moved.known);
  TEST_ASSERT_TRUE(held.ratio > 0.2f);
  TEST_ASSERT_EQUAL_FLOAT(held.ratio, moved.ratio);
}

/* What is known of the pad's dip is taken out of the residual too. A calibration finds a wider one
 * than there is, since it can not tell a narrow one from zeros (DIP_PITCHES of the solver). */
static void test_a_dip_that_is_known_is_no_load(void) {
  static const float told_mm[] = {15.0f, 20.7f};
  for (int c = 0; c < 2; c++) {
    struct fit_settings settings = usual();
    settings.prior_sigma_mm = 5.6f;
    settings.prior_width_mm = 0.07f;
    settings.dip_share = 0.05f;
    settings.dip_sd_mm = told_mm[c];
    int warned[2] = {0}; /* without a load, with one */
    for (int i = 0; i < 400; i++) {
      double x_mm = random_between(&noise, -9.0, 9.0), y_mm = random_between(&noise, -18.0, 18.0);
      double load = i % 2 ? 0.4 : 0.0, angle = random_between(&noise, 0.0, 6.28);
      int32_t pressure_Pa_q10[SENSORS];
      press(x_mm, y_mm, 0.0, 0.0, pressure_Pa_q10);
      struct fit_result result;
      const struct fit_settings plain = {.iterations = 4, .noise_Pa_q10 = 4096};
      fit_gaussian(&array, pressure_Pa_q10, ALL, &plain, &result);
      press(x_mm, y_mm, load * cos(angle), load * sin(angle), pressure_Pa_q10);
      for (int k = 0; k < SENSORS; k++) {
        double dx = 9.0 * (k / 5 - 1) - x_mm, dy = 9.0 * (k % 5 - 2) - y_mm;
        pressure_Pa_q10[k] -=
            (int32_t)(0.05 * 1024.0 * (double)result.p0_Pa * exp(-(dx * dx + dy * dy) / (2.0 * 14.0 * 14.0)));
      }
      struct fit_doubt held = {0};
      hold(&held, pressure_Pa_q10, ALL, &settings, &result);
      warned[i % 2] += (result.flags & CONTACT_FLAG_UNCERTAIN) != 0;
    }
    char text[80];
    snprintf(text, sizeof text, "told %.1f mm, of 200 warned: %d, loaded %d", (double)told_mm[c], warned[0], warned[1]);
    TEST_ASSERT_LESS_OR_EQUAL_INT_MESSAGE(4, warned[0], text);
    TEST_ASSERT_GREATER_OR_EQUAL_INT_MESSAGE(180, warned[1], text);
  }
}

static void test_sensors_may_be_missing(void) {
  const struct fit_settings settings = usual();
  int32_t pressure_Pa_q10[SENSORS];
  press(2.0, 3.0, 0.4, 0.1, pressure_Pa_q10);
  for (int k = 0; k < SENSORS; k++) {
    struct fit_result result;
    struct fit_doubt load = {0};
    hold(&load, pressure_Pa_q10, ALL & ~(UINT32_C(1) << k), &settings, &result);
    TEST_ASSERT_TRUE(load.known);
    TEST_ASSERT_TRUE_MESSAGE(result.flags & CONTACT_FLAG_UNCERTAIN, "one is enough to hide it");
  }
}

/* Where the residual shows nothing the load stays what is usual. */
static void test_few_sensors_see_no_load(void) {
  const struct fit_settings settings = usual();
  int32_t pressure_Pa_q10[SENSORS];
  press(2.0, 3.0, 0.0, 0.0, pressure_Pa_q10);
  struct fit_result result;
  struct fit_doubt load = {0};
  hold(&load, pressure_Pa_q10, (UINT32_C(1) << (FIT_DOUBT_SENSORS - 1)) - 1, &settings, &result);
  TEST_ASSERT_FALSE(load.known);
  TEST_ASSERT_TRUE(result.location_sd_mm > FIT_DOUBT_USUAL * 0.38f * 9.0f);
}

static void test_what_is_no_fit_stays_as_it_is(void) {
  const struct fit_settings settings = usual();
  int32_t pressure_Pa_q10[SENSORS];
  press(2.0, 3.0, 0.4, 0.1, pressure_Pa_q10);
  struct fit_result fitted;
  fit_gaussian_grid(&array, pressure_Pa_q10, ALL, &settings, &fitted);
  const uint32_t flags[] = {0, CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_AT_BOUND,
                            CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_FLAT};
  for (int i = 0; i < 3; i++) {
    struct fit_result result = fitted;
    result.flags = flags[i];
    result.location_sd_mm = 0.1f;
    struct fit_doubt load = {0};
    for (int frame = 0; frame < 2 * FIT_DOUBT_PARTS; frame++) {
      fit_doubt_widen(&load, &array, &settings, &result);
      fit_doubt_follow(&load, &array, pressure_Pa_q10, &settings, &result);
    }
    TEST_ASSERT_FALSE(load.known);
    TEST_ASSERT_EQUAL_FLOAT(0.1f, result.location_sd_mm);
    TEST_ASSERT_EQUAL_HEX32(flags[i], result.flags);
  }
}

/* Sensors that feel a contact wider or narrower by 6 % at most, and are off by 0.16 mm. */
static void test_what_is_the_sensors_own_is_no_load(void) {
  int loads[2] = {0}; /* unknown, known */
  for (int i = 0; i < 200; i++) {
    struct fit_own own[SENSORS];
    int32_t pressure_Pa_q10[SENSORS];
    double x_mm = random_between(&noise, -9.0, 9.0), y_mm = random_between(&noise, -18.0, 18.0);
    for (int k = 0; k < SENSORS; k++) {
      own[k] = (struct fit_own){(int32_t)random_between(&noise, -600, 600), (int32_t)random_between(&noise, -600, 600),
                                (int32_t)random_between(&noise, -2000, 2000)};
      double sigma_mm = 6.0 * exp(own[k].wider_q15 / 32768.0);
      double dx = 9.0 * (k / 5 - 1 + own[k].off_x_q15 / 32768.0) - x_mm;
      double dy = 9.0 * (k % 5 - 2 + own[k].off_y_q15 / 32768.0) - y_mm;
      pressure_Pa_q10[k] = (int32_t)lround(1024.0 * 2e4 * exp(-(dx * dx + dy * dy) / (2.0 * sigma_mm * sigma_mm)));
    }
    for (int known = 0; known < 2; known++) {
      struct fit_settings settings = usual();
      fit_set_errors(&settings, 0.002f, 0.0065f);
      settings.own = known ? own : NULL;
      struct fit_doubt load = {0};
      struct fit_result result;
      hold(&load, pressure_Pa_q10, ALL, &settings, &result);
      loads[known] += load.known && load.ratio > 0.1f;
    }
  }
  char text[60];
  snprintf(text, sizeof text, "of 200 loads: %d, known %d", loads[0], loads[1]);
  TEST_ASSERT_GREATER_OR_EQUAL_INT_MESSAGE(20, loads[0], text);
  TEST_ASSERT_LESS_OR_EQUAL_INT_MESSAGE(4, loads[1], text);
}

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(test_a_load_is_part_of_the_error);
  RUN_TEST(test_without_a_load_little_is_added);
  RUN_TEST(test_before_the_first_look_a_load_is_assumed);
  RUN_TEST(test_a_look_does_not_mix_frames);
  RUN_TEST(test_a_dip_that_is_known_is_no_load);
  RUN_TEST(test_what_is_the_sensors_own_is_no_load);
  RUN_TEST(test_sensors_may_be_missing);
  RUN_TEST(test_few_sensors_see_no_load);
  RUN_TEST(test_what_is_no_fit_stays_as_it_is);
  return UNITY_END();
}
