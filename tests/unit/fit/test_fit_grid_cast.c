/* The kernels on cast rubber: a dip around the contact, sensors off their places and of other
 * widths. Built for both sizes of grid, as test_fit_grid.c is. */
#include "fit_grid_bench.h"
#include "support/random.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unity.h>

/* A contact of 30 kPa on rubber with a dip, felt with 2 Pa of noise by sensors that have this own.
 */
static void press_cast(double x, double y, double sigma, double share, double sd, const struct fit_own *own,
                       struct random *random) {
  for (int k = 0; k < SENSORS; k++) {
    double dx = (double)x_mm[k] + (double)PITCH_mm * own[k].off_x_q15 / 32768.0 - x;
    double dy = (double)y_mm[k] + (double)PITCH_mm * own[k].off_y_q15 / 32768.0 - y;
    double square = dx * dx + dy * dy, wide = sigma * exp(own[k].wider_q15 / 32768.0);
    double p = exp(-square / (2 * wide * wide)) - share * exp(-square / (2 * sd * sd));
    readings[k] = (int32_t)nearbyint(1024.0 * (3e4 * p + 2.0 * random_normal(random)));
  }
}
static const struct fit_own no_own[SENSORS];

/* What a calibration knows of such a pad. */
static struct fit_settings of_cast(double sigma, double share, double sd) {
  return (struct fit_settings){.iterations = 8,
                               .noise_Pa_q10 = 2048,
                               .prior_sigma_mm = (float)sigma,
                               .prior_width_mm = 0.1f,
                               .dip_share = (float)share,
                               .dip_sd_mm = (float)sd};
}

/* Up to 0.16 mm each way, and 5 % of the width. */
static void draw_own(struct random *random, struct fit_own *own) {
  for (int k = 0; k < SENSORS; k++) {
    own[k].off_x_q15 = (int32_t)random_between(random, -600.0, 600.0);
    own[k].off_y_q15 = (int32_t)random_between(random, -600.0, 600.0);
    own[k].wider_q15 = (int32_t)random_between(random, -1638.0, 1638.0);
  }
}

static float off_mm(const struct fit_result *result, double x, double y) {
  return (float)hypot((double)result->x_mm - x, (double)result->y_mm - y);
}

/* The readings of a pad with a dip, with and without the noise's sensor 0; each kernel. */
static void a_known_dip_is_added_back_alike_in_all(void) {
  struct random random = {77};
  const double share = 0.03, sd_per_sigma = 3.2;
  float worst = 0.0f, apart = 0.0f, unknown = 0.0f;
  int counted = 0;
  for (int i = 0; i < 400; i++) {
    double half_x = 4.5 * (COLUMNS - 1), half_y = 4.5 * (ROWS - 1);
    double x = 1.5 + random_between(&random, -half_x, half_x);
    double y = -0.25 + random_between(&random, -half_y, half_y);
    double sigma = random_between(&random, 3.4, 6.0), sd = sd_per_sigma * sigma;
    press_cast(x, y, sigma, share, sd, no_own, &random);
    struct fit_settings settings = {
        .iterations = 8, .noise_Pa_q10 = 2048, .cut_noises = 4, .prior_sigma_mm = (float)sigma, .prior_width_mm = 0.1f};
    struct fit_result plain, grid, masked, general;
    fit_grid(&array, readings, &settings, &plain);
    settings.dip_share = (float)share;
    settings.dip_sd_mm = (float)sd;
    fit_grid(&array, readings, &settings, &grid);
    fit_grid_masked(&array, readings, ALL, &settings, &masked);
    fit_general(&array, readings, ALL, &settings, &general);
    unknown = fmaxf(unknown, off_mm(&plain, x, y));
    worst = fmaxf(worst, fmaxf(off_mm(&grid, x, y), off_mm(&general, x, y)));
    apart = fmaxf(apart, fmaxf(off_mm(&general, (double)grid.x_mm, (double)grid.y_mm),
                               off_mm(&masked, (double)grid.x_mm, (double)grid.y_mm)));
    counted++;
    TEST_ASSERT_TRUE(grid.location_sd_mm <= plain.location_sd_mm);
  }
  char text[100];
  snprintf(text, sizeof text, "%d: off %.3f mm, unknown %.3f, kernels apart %.3f", counted, (double)worst,
           (double)unknown, (double)apart);
  TEST_ASSERT_TRUE_MESSAGE(unknown > 0.3f, text);
  TEST_ASSERT_TRUE_MESSAGE(worst < 0.08f, text);
  TEST_ASSERT_TRUE_MESSAGE(apart < 0.02f, text);
}

/* Narrow contacts up to a third of a pitch beyond the outer sensors. The kernel for wide contacts,
 * whose derivatives do not have the dip, ends far outside. */
static void beyond_the_sensors_the_dip_tells_the_place(void) {
  struct random random = {79};
  const double share = 0.035, sd_per_sigma = 3.2;
  enum { PRESSES = 400 };
  int far = 0, far_of_wide = 0, unsure = 0, apart = 0;
  for (int i = 0; i < PRESSES; i++) {
    double half_x = 4.5 * (COLUMNS - 1), half_y = 4.5 * (ROWS - 1);
    double x = 1.5 + (i % 2 ? -1.0 : 1.0) * (half_x + random_between(&random, 0.5, 3.0));
    double y = -0.25 + random_between(&random, -half_y, half_y);
    double sigma = random_between(&random, 2.8, 3.6), sd = sd_per_sigma * sigma;
    press_cast(x, y, sigma, share, sd, no_own, &random);
    struct fit_settings settings = of_cast(sigma, share, sd);
    struct fit_result found, wide, general;
    fit_gaussian(&array, readings, ALL, &settings, &found);
    fit_grid(&array, readings, &settings, &wide);
    fit_general(&array, readings, ALL, &settings, &general);
    far += off_mm(&found, x, y) > 0.5f;
    far_of_wide += off_mm(&wide, x, y) > 0.5f;
    unsure += off_mm(&found, x, y) > 2.5f * found.location_sd_mm;
    apart += off_mm(&general, (double)found.x_mm, (double)found.y_mm) > 0.05f;
  }
  char text[160];
  snprintf(text, sizeof text, "of %d off by 0.5 mm: %d, wide kernel %d; beyond 2.5 sd %d; apart %d", PRESSES, far,
           far_of_wide, unsure, apart);
  TEST_ASSERT_TRUE_MESSAGE(far_of_wide > PRESSES / 2, text);
  TEST_ASSERT_TRUE_MESSAGE(far <= PRESSES / 50, text);
  TEST_ASSERT_TRUE_MESSAGE(unsure <= PRESSES / 100, text);
  TEST_ASSERT_TRUE_MESSAGE(apart <= PRESSES / 25, text);
}

/* Sensors that are off their places and feel a contact wider, on a pad without a dip and with one.
 */
static void what_is_the_sensors_own_is_taken_out_alike_in_all(void) {
  struct random random = {80};
  float worst = 0.0f, apart = 0.0f, unknown = 0.0f;
  int sooner = 0, rough = 0;
  for (int i = 0; i < 400; i++) {
    struct fit_own own[SENSORS];
    draw_own(&random, own);
    double half_x = 4.5 * (COLUMNS - 1), half_y = 4.5 * (ROWS - 1);
    double x = 1.5 + random_between(&random, -half_x, half_x);
    double y = -0.25 + random_between(&random, -half_y, half_y);
    double sigma = random_between(&random, 5.2, 7.0), sd = 3.0 * sigma, share = i % 2 ? 0.02 : 0.0;
    press_cast(x, y, sigma, share, sd, own, &random);
    struct fit_settings settings = of_cast(sigma, share, sd);
    struct fit_result plain, grid, masked, general;
    fit_grid(&array, readings, &settings, &plain);
    settings.own = own;
    fit_grid(&array, readings, &settings, &grid);
    fit_grid_masked(&array, readings, ALL, &settings, &masked);
    fit_general(&array, readings, ALL, &settings, &general);
    unknown += off_mm(&plain, x, y) / 400.0f;
    worst = fmaxf(worst, fmaxf(off_mm(&grid, x, y), off_mm(&general, x, y)));
    apart = fmaxf(apart, fmaxf(off_mm(&general, (double)grid.x_mm, (double)grid.y_mm),
                               off_mm(&masked, (double)grid.x_mm, (double)grid.y_mm)));
    rough += grid.residual_rms_Pa > 0.5f * plain.residual_rms_Pa;
    struct fit_result lacking[2]; /* what is the own of a missing sensor changes nothing */
    for (int other = 0; other < 2; other++) {
      own[0].wider_q15 = 3000 * other;
      fit_grid_masked(&array, readings, ALL & ~UINT32_C(1), &settings, &lacking[other]);
    }
    TEST_ASSERT_EQUAL_MEMORY(&lacking[0], &lacking[1], sizeof lacking[0]);
    settings.iterations = 2; /* too few to know the contact before it */
    struct fit_result early[3], without[3];
    fit_grid(&array, readings, &settings, &early[0]);
    fit_grid_masked(&array, readings, ALL, &settings, &early[1]);
    fit_general(&array, readings, ALL, &settings, &early[2]);
    settings.own = NULL;
    fit_grid(&array, readings, &settings, &without[0]);
    fit_grid_masked(&array, readings, ALL, &settings, &without[1]);
    fit_general(&array, readings, ALL, &settings, &without[2]);
    sooner += memcmp(early, without, sizeof early) != 0;
  }
  char text[120];
  snprintf(text, sizeof text, "off %.3f mm, unknown %.3f, kernels apart %.3f; %d rough, %d sooner", (double)worst,
           (double)unknown, (double)apart, rough, sooner);
  TEST_ASSERT_TRUE_MESSAGE(unknown > 0.1f, text);
  TEST_ASSERT_TRUE_MESSAGE(worst < 0.08f, text);
  TEST_ASSERT_TRUE_MESSAGE(apart < 0.03f, text);
  TEST_ASSERT_TRUE_MESSAGE(rough < 40, text);
  TEST_ASSERT_EQUAL_INT_MESSAGE(0, sooner, text);
}

/* A sensor that feels a contact much wider is no outlier to a fit that knows it. */
static void a_sensor_that_is_known_to_differ_is_no_outlier(void) {
  struct random random = {81};
  int left_out[2] = {0};
  for (int i = 0; i < 200; i++) {
    struct fit_own own[SENSORS] = {{0}};
    int other = (int)random_below(&random, SENSORS);
    own[other].wider_q15 = 3277; /* 10 % */
    double x = 1.5 + random_between(&random, -4.0, 4.0);
    double y = -0.25 + random_between(&random, -4.0, 4.0);
    press_cast(x, y, 6.0, 0.0, 1.0, own, &random);
    struct fit_settings settings = {.iterations = 7, .noise_Pa_q10 = 2048};
    for (int known = 0; known < 2; known++) {
      struct fit_result result;
      settings.own = known ? own : NULL;
      fit_gaussian(&array, readings, ALL, &settings, &result);
      left_out[known] += result.used != ALL;
    }
  }
  char text[60];
  snprintf(text, sizeof text, "left out %d, known %d", left_out[0], left_out[1]);
  TEST_ASSERT_TRUE_MESSAGE(left_out[0] >= 10, text);
  TEST_ASSERT_EQUAL_INT_MESSAGE(0, left_out[1], text);
}

/* Nor does what is known of all sensors hide one that is an outlier. */
static void an_outlier_is_found_among_sensors_that_differ(void) {
  struct random random = {82};
  enum { PRESSES = 400 };
  int found = 0, others = 0;
  for (int i = 0; i < PRESSES; i++) {
    struct fit_own own[SENSORS];
    draw_own(&random, own);
    double x = 1.5 + random_between(&random, -4.0, 4.0);
    double y = -0.25 + random_between(&random, -4.0, 4.0);
    press_cast(x, y, 6.0, 0.0, 1.0, own, &random);
    int outlier = (int)random_below(&random, SENSORS);
    readings[outlier] += 5000 * 1024;
    struct fit_settings settings = {.iterations = 7, .noise_Pa_q10 = 2048, .own = own};
    struct fit_result result;
    fit_gaussian(&array, readings, ALL, &settings, &result);
    found += result.used == (ALL & ~(UINT32_C(1) << outlier));
    others += result.used != ALL && (result.used >> outlier & 1);
  }
  char text[60];
  snprintf(text, sizeof text, "of %d found %d, others %d", PRESSES, found, others);
  TEST_ASSERT_TRUE_MESSAGE(found > PRESSES * 6 / 10, text);
  TEST_ASSERT_EQUAL_INT_MESSAGE(0, others, text);
}

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(a_known_dip_is_added_back_alike_in_all);
  RUN_TEST(beyond_the_sensors_the_dip_tells_the_place);
  RUN_TEST(what_is_the_sensors_own_is_taken_out_alike_in_all);
  RUN_TEST(a_sensor_that_is_known_to_differ_is_no_outlier);
  RUN_TEST(an_outlier_is_found_among_sensors_that_differ);
  return UNITY_END();
}
