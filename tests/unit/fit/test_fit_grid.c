/* The fixed-point kernels against the float32 one, which other tests hold to the reference. Built
 * once for the 3 x 5 grid of the firmware and once for another size. */
#include "fit/fit_tables.h"
#include "fit_grid_bench.h"
#include "support/random.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <unity.h>

static void press(double x, double y, double p0_Pa, double sigma_mm, double noise_Pa, struct random *random) {
  for (int k = 0; k < SENSORS; k++) {
    double dx = (double)x_mm[k] - x;
    double dy = (double)y_mm[k] - y;
    double p = p0_Pa * exp(-(dx * dx + dy * dy) / (2.0 * sigma_mm * sigma_mm));
    readings[k] = (int32_t)nearbyint(1024.0 * (p + noise_Pa * random_normal(random)));
  }
}

static void random_press(struct random *random, double sigma_low_mm, double sigma_high_mm) {
  double half_x = 4.5 * (COLUMNS - 1), half_y = 4.5 * (ROWS - 1);
  press(1.5 + random_between(random, -half_x, half_x), -0.25 + random_between(random, -half_y, half_y),
        random_between(random, 2e3, 1e5), random_between(random, sigma_low_mm, sigma_high_mm), 5.0, random);
}

static void a_rectangle_is_recognised_in_any_order(void) {
  TEST_ASSERT_EQUAL_UINT8(COLUMNS, array.grid.columns);
  TEST_ASSERT_EQUAL_UINT8(ROWS, array.grid.rows);
}

static void what_is_no_rectangle_is_not(void) {
  float moved = x_mm[0];
  x_mm[0] += 0.1f;
  TEST_ASSERT_EQUAL(FT_OK, fit_array_init(&array, SENSORS, x_mm, y_mm, PITCH_mm));
  TEST_ASSERT_EQUAL_UINT8(0, array.grid.columns);
  x_mm[0] = moved;
  TEST_ASSERT_EQUAL(FT_OK, fit_array_init(&array, SENSORS - 1, x_mm, y_mm, PITCH_mm));
  TEST_ASSERT_EQUAL_UINT8(0, array.grid.columns);
  TEST_ASSERT_EQUAL(FT_OK, fit_array_init(&array, SENSORS, x_mm, y_mm, PITCH_mm / 2));
  TEST_ASSERT_EQUAL_UINT8(0, array.grid.columns);
  x_mm[0] = x_mm[1]; /* two sensors on one node, another node empty */
  TEST_ASSERT_EQUAL(FT_OK, fit_array_init(&array, SENSORS, x_mm, y_mm, PITCH_mm));
  TEST_ASSERT_EQUAL_UINT8(0, array.grid.columns);
}

static void the_tables_are_those_of_the_library(void) {
  for (int k = 0; k < 256; k++) {
    TEST_ASSERT_EQUAL_INT32(lround(ldexp(exp2(-k / 256.0), 30)), fit_exp2_table[k]);
    TEST_ASSERT_EQUAL_INT(k > 0 ? ilogb(k) + 1 : 0, fit_bits_table[k]);
  }
  for (int k = 0; k <= 64; k++) {
    TEST_ASSERT_EQUAL_INT32(lround(32768.0 * log2(1.0 + k / 64.0)), fit_log2_table[k]);
  }
}

static const uint32_t of_shape = CONTACT_FLAG_WIDTHS_VALID | CONTACT_FLAG_ELONGATED;

/* The kernels agree on presses that neither warns of, once both have settled: without the sensor at
 * the peak that takes some longer. */
static void hold_to_the_general_kernel(uint32_t seed, int presses, int masked) {
  struct fit_settings settled = {.iterations = masked > 0 ? 14 : 7, .noise_Pa_q10 = 5120};
  struct random random = {seed};
  int compared = 0;
  float worst_um = 0.0f, worst_force = 0.0f, worst_sd = 0.0f, worst_force_sd = 0.0f;
  for (int i = 0; i < presses; i++) {
    random_press(&random, 4.0, 15.0);
    uint32_t usable = ALL;
    for (int k = 0; k < masked; k++) {
      usable &= ~(UINT32_C(1) << random_below(&random, SENSORS));
    }
    for (int k = 0; k < SENSORS; k++) {
      readings[k] = usable >> k & 1 ? readings[k] : (int32_t)random_u32(&random);
    }
    for (int k = 0; k < SENSORS; k++) { /* where gains alone count, weak sensors lose bits */
      settled.gain_sd_q16[k] = (uint16_t)(i % 3 == 2 ? random_below(&random, 8000) : 0);
    }
    settled.model_sd_q16 = i % 3 ? 400 : 0;
    struct fit_result grid, general;
    if (masked == 0) {
      fit_grid(&array, readings, &settled, &grid);
    } else {
      fit_grid_masked(&array, readings, usable, &settled, &grid);
    }
    fit_general(&array, readings, usable, &settled, &general);
    TEST_ASSERT_EQUAL_HEX32(usable, grid.used);
    const uint32_t skipped = CONTACT_FLAG_UNCERTAIN | CONTACT_FLAG_LOW_SIGNAL | CONTACT_FLAG_ELONGATED;
    if (((general.flags | grid.flags) & skipped) || general.location_sd_mm > 0.2f) {
      continue; /* what is hardly determined may differ, and one alone tells shapes */
    }
    compared++;
    TEST_ASSERT_EQUAL_HEX32(general.flags, grid.flags & ~of_shape);
    float um = 1e3f * hypotf(grid.x_mm - general.x_mm, grid.y_mm - general.y_mm);
    worst_um = fmaxf(worst_um, um);
    worst_force = fmaxf(worst_force, fabsf(grid.force_N / general.force_N - 1.0f));
    worst_sd = fmaxf(worst_sd, fabsf(grid.location_sd_mm / general.location_sd_mm - 1.0f));
    worst_force_sd = fmaxf(worst_force_sd, fabsf(grid.force_sd_N / general.force_sd_N - 1.0f));
    TEST_ASSERT_FLOAT_WITHIN(3e-4f * general.p0_Pa, general.p0_Pa, grid.p0_Pa);
    TEST_ASSERT_FLOAT_WITHIN(3e-4f * general.sigma_mm, general.sigma_mm, grid.sigma_mm);
    TEST_ASSERT_FLOAT_WITHIN(0.02f * general.residual_rms_Pa, general.residual_rms_Pa, grid.residual_rms_Pa);
  }
  char text[120];
  snprintf(text, sizeof text, "%d compared, worst: %.3f um, force %.1e, sd %.1e, force sd %.1e", compared,
           (double)worst_um, (double)worst_force, (double)worst_sd, (double)worst_force_sd);
  TEST_MESSAGE(text);
  TEST_ASSERT_GREATER_THAN_INT(presses / 3, compared);
  TEST_ASSERT_TRUE(worst_um < (masked > 0 ? 3.0f : 1.0f));
  TEST_ASSERT_TRUE(worst_force < (masked > 0 ? 5e-4f : 1e-4f));
  TEST_ASSERT_TRUE(worst_sd < 0.08f);
  TEST_ASSERT_TRUE(worst_force_sd < 0.04f);
}

static void the_kernels_agree(void) { hold_to_the_general_kernel(11, 20000, 0); }

static void the_kernels_agree_without_some_sensors(void) {
  for (int masked = 1; masked <= 4; masked++) {
    hold_to_the_general_kernel(40 + (uint32_t)masked, 5000, masked);
  }
}

static void without_a_mask_both_grid_kernels_agree(void) {
  struct random random = {17};
  for (int i = 0; i < 2000; i++) {
    random_press(&random, 3.5, 15.0);
    struct fit_result plain, masked;
    fit_grid(&array, readings, &usual, &plain);
    fit_grid_masked(&array, readings, ALL, &usual, &masked);
    TEST_ASSERT_EQUAL_HEX32(0, masked.flags & CONTACT_FLAG_SENSOR_MASKED);
    if (plain.location_sd_mm < 0.2f && masked.location_sd_mm < 0.2f) {
      TEST_ASSERT_TRUE(hypotf(plain.x_mm - masked.x_mm, plain.y_mm - masked.y_mm) < 1e-3f);
    }
  }
}

static void what_a_masked_sensor_reads_changes_nothing(void) {
  struct random random = {19};
  for (int i = 0; i < 500; i++) {
    random_press(&random, 3.0, 15.0);
    uint32_t gone = random_below(&random, SENSORS);
    struct fit_result one, other;
    fit_grid_masked(&array, readings, ALL & ~(UINT32_C(1) << gone), &usual, &one);
    readings[gone] = (int32_t)random_u32(&random);
    fit_grid_masked(&array, readings, ALL & ~(UINT32_C(1) << gone), &usual, &other);
    TEST_ASSERT_EQUAL_MEMORY(&one, &other, sizeof one);
  }
}

static void too_few_sensors_give_no_fit(void) {
  struct random random = {23};
  random_press(&random, 4.0, 8.0);
  for (int count = 0; count < 4; count++) {
    struct fit_result result;
    fit_grid_masked(&array, readings, (UINT32_C(1) << count) - 1, &usual, &result);
    TEST_ASSERT_EQUAL_HEX32(0, result.flags & CONTACT_FLAG_FIT_VALID);
    TEST_ASSERT_TRUE(result.flags & CONTACT_FLAG_SENSOR_MASKED);
  }
}

/* One sensor of a clean press reads 10 kPa too much or too little. */
static void an_outlier_is_left_out(bool by_the_general_kernel) {
  struct random random = {29};
  int found = 0, others = 0, unwarned = 0;
  const int presses = 2000;
  for (int i = 0; i < presses; i++) {
    random_press(&random, 4.5, 12.0);
    struct fit_result clean, result;
    fit_gaussian(&array, readings, ALL, &usual, &clean);
    uint32_t wrong = random_below(&random, SENSORS);
    readings[wrong] += (i % 2 ? 1 : -1) * 10000 * 1024;
    if (by_the_general_kernel) {
      fit_general(&array, readings, ALL, &usual, &result);
    } else {
      fit_gaussian(&array, readings, ALL, &usual, &result);
    }
    float moved_mm = hypotf(result.x_mm - clean.x_mm, result.y_mm - clean.y_mm);
    bool masked = result.flags & CONTACT_FLAG_SENSOR_MASKED;
    TEST_ASSERT_EQUAL(masked, result.used != ALL);
    found += result.used == (ALL & ~(UINT32_C(1) << wrong)) && moved_mm < 0.2f;
    others += masked && result.used != (ALL & ~(UINT32_C(1) << wrong));
    const uint32_t warnings = CONTACT_FLAG_UNCERTAIN | CONTACT_FLAG_MODEL | CONTACT_FLAG_AT_BOUND | CONTACT_FLAG_FLAT |
                              CONTACT_FLAG_LOW_SIGNAL;
    unwarned += moved_mm > 1.0f && !(result.flags & warnings);
  }
  char text[100];
  snprintf(text, sizeof text, "of %d outliers %d found, %d others left out, %d unwarned", presses, found, others,
           unwarned);
  TEST_MESSAGE(text);
  TEST_ASSERT_GREATER_THAN_INT(presses * 3 / 5, found);
  TEST_ASSERT_LESS_THAN_INT(presses / 20, others);
  TEST_ASSERT_LESS_THAN_INT(presses / 100, unwarned);
}

static void the_grid_kernels_leave_an_outlier_out(void) { an_outlier_is_left_out(false); }

static void the_general_kernel_leaves_an_outlier_out(void) { an_outlier_is_left_out(true); }

static void no_sensor_of_a_clean_press_is_left_out(void) {
  struct random random = {31};
  for (int i = 0; i < 5000; i++) {
    random_press(&random, 4.0, 15.0);
    struct fit_result result;
    fit_gaussian(&array, readings, ALL, &usual, &result);
    TEST_ASSERT_EQUAL_HEX32(ALL, result.used);
  }
}

static void scaling_the_readings_scales_the_pressures_alone(void) {
  struct random random = {5};
  random_press(&random, 5.0, 6.0);
  const struct fit_settings quiet = {.iterations = 7, .noise_Pa_q10 = 1};
  struct fit_result once, twice;
  fit_grid(&array, readings, &quiet, &once);
  for (int k = 0; k < SENSORS; k++) {
    readings[k] *= 2;
  }
  fit_grid(&array, readings, &quiet, &twice);
  TEST_ASSERT_EQUAL_MEMORY(&once.x_mm, &twice.x_mm, sizeof once.x_mm);
  TEST_ASSERT_EQUAL_MEMORY(&once.y_mm, &twice.y_mm, sizeof once.y_mm);
  TEST_ASSERT_EQUAL_MEMORY(&once.sigma_mm, &twice.sigma_mm, sizeof once.sigma_mm);
  TEST_ASSERT_EQUAL_MEMORY(&once.location_sd_mm, &twice.location_sd_mm, sizeof once.location_sd_mm);
  TEST_ASSERT_TRUE(twice.p0_Pa == 2.0f * once.p0_Pa && twice.force_N == 2.0f * once.force_N);
}

static void more_iterations_come_nearer(void) {
  struct random random = {7};
  float mean_um[9] = {0};
  for (int i = 0; i < 500; i++) {
    random_press(&random, 4.5, 7.0);
    struct fit_result best, result;
    fit_general(&array, readings, ALL, &usual, &best);
    for (uint8_t n = 0; n < 9; n++) {
      const struct fit_settings settings = {.iterations = n, .noise_Pa_q10 = 5120};
      fit_grid(&array, readings, &settings, &result);
      mean_um[n] += 2.0f * hypotf(result.x_mm - best.x_mm, result.y_mm - best.y_mm);
    }
  }
  TEST_ASSERT_TRUE(mean_um[0] > 20.0f && mean_um[0] < 2000.0f);
  for (int n = 1; n < 5; n++) {
    TEST_ASSERT_TRUE(mean_um[n] < 0.7f * mean_um[n - 1] || mean_um[n] < 0.05f);
  }
  TEST_ASSERT_TRUE(mean_um[7] < 0.05f && mean_um[8] < 0.05f);
}

/* Up to two iterations are all of one kind, so that one more is one more step. */
static void a_fit_that_still_moves_says_how_far(void) {
  struct random random = {13};
  int moving = 0;
  for (int i = 0; i < 1000; i++) {
    random_press(&random, 3.5, 7.0);
    struct fit_settings settings = {.iterations = 1, .noise_Pa_q10 = 1};
    struct fit_result before, result;
    fit_grid(&array, readings, &settings, &before);
    settings.iterations = 2;
    fit_grid(&array, readings, &settings, &result);
    float moved_mm = hypotf(result.x_mm - before.x_mm, result.y_mm - before.y_mm);
    TEST_ASSERT_TRUE(result.location_sd_mm > 0.99f * moved_mm - 1e-3f);
    moving += moved_mm > 0.5f * result.location_sd_mm;
  }
  TEST_ASSERT_GREATER_THAN_INT(20, moving);
}

static void a_prior_pulls_sigma_alike_in_both(void) {
  struct random random = {9};
  for (int i = 0; i < 200; i++) {
    random_press(&random, 3.2, 3.6);
    struct fit_settings settings = usual;
    settings.prior_sigma_mm = 4.0f;
    settings.prior_width_mm = 0.5f;
    struct fit_result grid, general, free;
    fit_grid(&array, readings, &settings, &grid);
    fit_general(&array, readings, ALL, &settings, &general);
    fit_general(&array, readings, ALL, &usual, &free);
    if ((general.flags | grid.flags | free.flags) & CONTACT_FLAG_UNCERTAIN) {
      continue;
    }
    /* the grid kernel takes sigma to 15 bits into the prior */
    TEST_ASSERT_FLOAT_WITHIN(1e-2f, general.sigma_mm, grid.sigma_mm);
    TEST_ASSERT_FLOAT_WITHIN(1e-2f, general.x_mm, grid.x_mm);
    TEST_ASSERT_TRUE(general.sigma_mm > free.sigma_mm - 1e-4f);
  }
}

/* Little but the prior speaks of the width where one sensor feels something beside noise: what the
 * prior makes of the deviations may be many times what the readings do. */
static void a_prior_leaves_what_is_uncertain_so(void) {
  struct fit_settings settings = usual;
  settings.iterations = 4;
  settings.prior_sigma_mm = 6.5f;
  settings.prior_width_mm = 3.0f;
  fit_set_errors(&settings, 0.01f, 0.0065f);
  struct random random = {12};
  int compared = 0;
  for (int i = 0; i < 3000; i++) {
    press(0, 0, 0.0, 1.0, 5.0, &random);
    readings[random_below(&random, SENSORS)] += (int32_t)random_between(&random, 150e3, 4000e3);
    struct fit_result grid, general;
    if (i % 2) {
      fit_grid(&array, readings, &settings, &grid);
    } else {
      fit_grid_masked(&array, readings, ALL & ~(UINT32_C(1) << random_below(&random, SENSORS)), &settings, &grid);
    }
    if (!(grid.flags & CONTACT_FLAG_FIT_VALID)) {
      continue;
    }
    fit_general(&array, readings, grid.used, &settings, &general);
    if (!((grid.flags | general.flags) & CONTACT_FLAG_AT_BOUND)) {
      TEST_ASSERT_TRUE(grid.flags & CONTACT_FLAG_UNCERTAIN || grid.location_sd_mm > 0.3f * general.location_sd_mm);
      compared++;
    }
  }
  TEST_ASSERT_GREATER_THAN_INT(500, compared);
}

static void readings_below_zero_count_as_zero(void) {
  struct random random = {78};
  const struct fit_settings cut = {.iterations = 4, .noise_Pa_q10 = 5120, .cut_noises = 4};
  struct fit_settings whole = cut;
  whole.cut_noises = 0;
  for (int i = 0; i < 100; i++) {
    random_press(&random, 3.2, 6.0);
    int32_t below[SENSORS];
    int changed = 0;
    for (int k = 0; k < SENSORS; k++) {
      if (readings[k] < 4 * 5120) { /* some as far below zero as is noise, some farther */
        readings[k] = (int32_t)random_below(&random, 2) ? -4 * 5120 : -4 * 5120 - 1 - 40000 * k;
      }
      below[k] = readings[k];
      if (readings[k] < -4 * 5120) {
        readings[k] = 0;
        changed++;
      }
    }
    struct fit_result expected, found;
    fit_gaussian(&array, readings, ALL, &whole, &expected);
    fit_gaussian(&array, below, ALL, &cut, &found);
    TEST_ASSERT_EQUAL_MEMORY(&expected, &found, sizeof found);
    fit_grid_masked(&array, readings, ALL & ~2u, &whole, &expected);
    fit_grid_masked(&array, below, ALL & ~2u, &cut, &found);
    TEST_ASSERT_EQUAL_MEMORY(&expected, &found, sizeof found);
    fit_general(&array, readings, ALL, &whole, &expected);
    fit_general(&array, below, ALL, &cut, &found);
    TEST_ASSERT_EQUAL_MEMORY(&expected, &found, sizeof found);
    fit_general(&array, below, ALL, &whole, &found);
    TEST_ASSERT_EQUAL(changed > 0, memcmp(&expected, &found, sizeof found) != 0);
  }
}

static void warnings_are_given(void) {
  struct fit_result result;
  for (int k = 0; k < SENSORS; k++) {
    readings[k] = 5000 * 1024;
  }
  fit_grid(&array, readings, &usual, &result);
  TEST_ASSERT_TRUE(result.flags & CONTACT_FLAG_FLAT);
  TEST_ASSERT_TRUE(result.flags & CONTACT_FLAG_AT_BOUND);

  struct random random = {3};
  press(1.5, -0.25, 60.0, 6.0, 0.0, &random);
  fit_grid(&array, readings, &usual, &result);
  TEST_ASSERT_TRUE(result.flags & CONTACT_FLAG_LOW_SIGNAL);

  press(1.5, -0.25, 20e3, 6.0, 0.0, &random);
  for (int k = 0; k < SENSORS; k += 2) {
    readings[k] -= 8000 * 1024; /* no Gaussian */
  }
  fit_grid(&array, readings, &usual, &result);
  TEST_ASSERT_TRUE(result.flags & CONTACT_FLAG_MODEL);

  press(1.5, -0.25, 20e3, 1.0, 0.0, &random); /* far narrower than the grid */
  fit_grid(&array, readings, &usual, &result);
  TEST_ASSERT_TRUE(result.flags & (CONTACT_FLAG_UNCERTAIN | CONTACT_FLAG_AT_BOUND | CONTACT_FLAG_LOW_SIGNAL));

  memset(readings, 0, sizeof readings);
  fit_grid(&array, readings, &usual, &result);
  TEST_ASSERT_EQUAL_HEX32(CONTACT_FLAG_LOW_SIGNAL, result.flags);
  for (int k = 0; k < SENSORS; k++) {
    readings[k] = INT32_MIN;
  }
  fit_grid(&array, readings, &usual, &result);
  TEST_ASSERT_EQUAL_HEX32(CONTACT_FLAG_LOW_SIGNAL, result.flags);
}

static int32_t any_q15(struct random *random) { return (int32_t)random_below(random, 65535) - 32767; }

static void any_bits_give_finite_results(void) {
  struct random random = {21};
  for (int i = 0; i < 200000; i++) {
    uint32_t kind = random_below(&random, 4);
    for (int k = 0; k < SENSORS; k++) {
      uint32_t bits = random_u32(&random);
      readings[k] = (int32_t)(kind == 0   ? bits
                              : kind == 1 ? bits >> (bits & 31)
                              : kind == 2 ? (bits & 7 ? 0 : bits)
                                          : (bits & 1 ? 0x7FFFFFFFu : 0x80000000u));
    }
    struct fit_settings settings = {.iterations = (uint8_t)random_below(&random, 11),
                                    .noise_Pa_q10 = (int32_t)(random_u32(&random) >> 1) | 1};
    if (random_below(&random, 2)) {
      settings.prior_sigma_mm = 5.0f;
      settings.prior_width_mm = 0.01f + (float)random_below(&random, 100);
    }
    if (random_below(&random, 2)) {
      settings.cut_noises = (uint8_t)random_u32(&random);
      settings.dip_share = FIT_DIP_SHARE_MAX / (float)(1 + random_below(&random, 9));
      settings.dip_sd_mm = 0.01f + (float)random_below(&random, 100);
    }
    struct fit_own own[SENSORS];
    if (random_below(&random, 2)) {
      for (int k = 0; k < SENSORS; k++) {
        own[k] = (struct fit_own){any_q15(&random), any_q15(&random), any_q15(&random)};
      }
      settings.own = own;
    }
    struct fit_result result;
    bool masked = random_below(&random, 2);
    if (masked) {
      fit_grid_masked(&array, readings, random_u32(&random), &settings, &result);
    } else {
      fit_grid(&array, readings, &settings, &result);
    }
    TEST_ASSERT_TRUE(isfinite(result.x_mm) && isfinite(result.y_mm) && isfinite(result.p0_Pa) &&
                     isfinite(result.sigma_mm) && isfinite(result.force_N) && isfinite(result.residual_rms_Pa) &&
                     isfinite(result.location_sd_mm) && isfinite(result.force_sd_N));
    bool valid = result.flags & CONTACT_FLAG_FIT_VALID;
    TEST_ASSERT_TRUE(valid || masked || result.flags == CONTACT_FLAG_LOW_SIGNAL);
  }
}

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(a_rectangle_is_recognised_in_any_order);
  RUN_TEST(what_is_no_rectangle_is_not);
  RUN_TEST(the_tables_are_those_of_the_library);
  RUN_TEST(the_kernels_agree);
  RUN_TEST(the_kernels_agree_without_some_sensors);
  RUN_TEST(without_a_mask_both_grid_kernels_agree);
  RUN_TEST(what_a_masked_sensor_reads_changes_nothing);
  RUN_TEST(too_few_sensors_give_no_fit);
  RUN_TEST(the_grid_kernels_leave_an_outlier_out);
  RUN_TEST(the_general_kernel_leaves_an_outlier_out);
  RUN_TEST(no_sensor_of_a_clean_press_is_left_out);
  RUN_TEST(scaling_the_readings_scales_the_pressures_alone);
  RUN_TEST(more_iterations_come_nearer);
  RUN_TEST(a_fit_that_still_moves_says_how_far);
  RUN_TEST(a_prior_pulls_sigma_alike_in_both);
  RUN_TEST(a_prior_leaves_what_is_uncertain_so);
  RUN_TEST(readings_below_zero_count_as_zero);
  RUN_TEST(warnings_are_given);
  RUN_TEST(any_bits_give_finite_results);
  return UNITY_END();
}
