#include "fit_bench.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static void test_without_noise_there_is_no_fit(void) {
  static const struct press press = {3.1, -5.2, 4000.0, 7.0};
  static const int32_t noises[] = {0, -1, INT32_MIN};
  read_press(&press, 0.0, NULL);
  for (size_t i = 0; i < 3; i++) {
    for (int largest = 0; largest < 6; largest += 5) {
      for (uint32_t usable = ALL; usable >= ALL - 1; usable--) {
        struct fit_settings settings = usual;
        settings.noise_Pa_q10 = noises[i];
        settings.n_largest = (uint8_t)largest;
        fit_gaussian(&array, readings, usable, &settings, &result);
        TEST_ASSERT_EQUAL_HEX32(0, result.flags);
        TEST_ASSERT_EQUAL_HEX32(0, result.used);
      }
    }
  }
}

static void test_array_arguments(void) {
  struct fit_array made;
  memset(&made, 0x5A, sizeof made);
  const struct fit_array before = made;
  TEST_ASSERT_EQUAL_INT(FT_ERR_ARGUMENT, fit_array_init(&made, 0, x_mm, y_mm, PITCH_mm));
  TEST_ASSERT_EQUAL_INT(FT_ERR_ARGUMENT, fit_array_init(&made, 33, x_mm, y_mm, PITCH_mm));
  static const float pitches[] = {0.0f, -9.0f, INFINITY, NAN};
  for (size_t i = 0; i < 4; i++) {
    TEST_ASSERT_EQUAL_INT(FT_ERR_ARGUMENT, fit_array_init(&made, SENSORS, x_mm, y_mm, pitches[i]));
  }
  static const float places[] = {INFINITY, -INFINITY, NAN};
  for (size_t i = 0; i < 3; i++) {
    float wrong[SENSORS] = {0};
    wrong[SENSORS - 1] = places[i];
    TEST_ASSERT_EQUAL_INT(FT_ERR_ARGUMENT, fit_array_init(&made, SENSORS, wrong, y_mm, PITCH_mm));
    TEST_ASSERT_EQUAL_INT(FT_ERR_ARGUMENT, fit_array_init(&made, SENSORS, x_mm, wrong, PITCH_mm));
  }
  TEST_ASSERT_EQUAL_MEMORY(&before, &made, sizeof made);
  TEST_ASSERT_FLOAT_WITHIN(1e-6f, -2.5f, array.x_min);
  TEST_ASSERT_FLOAT_WITHIN(1e-6f, 2.5f, array.x_max);
  TEST_ASSERT_FLOAT_WITHIN(1e-6f, -3.5f, array.y_min);
  TEST_ASSERT_FLOAT_WITHIN(1e-6f, 3.5f, array.y_max);
}

/* Readings in steps of 1/1024 Pa around Gaussians inside the array. */
static void test_noise_free_presses_are_recovered(void) {
  struct random random = {71};
  const struct fit_settings brief = {.iterations = 7, .noise_Pa_q10 = 1};
  int beyond_1_um = 0;
  int not_settled = 0;
  double worst_usual = 0.0;
  double worst_patient = 0.0;
  double worst_force = 0.0;
  double worst_sigma = 0.0;
  double worst_p0 = 0.0;
  for (int i = 0; i < 20000; i++) {
    struct press press = random_press(&random, 0.0);
    read_press(&press, 0.0, NULL);
    fit_gaussian(&array, readings, ALL, &brief, &result);
    assert_finite_and_defined();
    TEST_ASSERT_EQUAL_HEX32(ALL, result.used);
    beyond_1_um += location_error_mm(&press) > 1e-3;
    uint32_t flags = result.flags & ~(uint32_t)CONTACT_FLAG_WIDTHS_VALID;
    if (flags != GOOD_FIT) {
      TEST_ASSERT_EQUAL_HEX32(GOOD_FIT | CONTACT_FLAG_UNCERTAIN, flags);
      not_settled++;
    } else {
      worst_usual = fmax(worst_usual, location_error_mm(&press));
    }
    fit_gaussian(&array, readings, ALL, &patient, &result);
    worst_patient = fmax(worst_patient, location_error_mm(&press));
    worst_force = fmax(worst_force, fabs((double)result.force_N / force_of(&press) - 1.0));
    worst_sigma = fmax(worst_sigma, fabs((double)result.sigma_mm / press.sigma_mm - 1.0));
    worst_p0 = fmax(worst_p0, fabs((double)result.p0_Pa / press.p0_Pa - 1.0));
  }
  say("after 7 iterations: share beyond 1 um:", beyond_1_um / 20000.0);
  say("share flagged as not settled:", not_settled / 20000.0);
  say("location of the others, worst, um:", worst_usual * 1e3);
  say("after 20 iterations, worst, um:", worst_patient * 1e3);
  say("force, worst, relative:", worst_force);
  say("sigma, worst, relative:", worst_sigma);
  say("p0, worst, relative:", worst_p0);
  TEST_ASSERT_EQUAL_INT(0, not_settled);
  TEST_ASSERT_LESS_OR_EQUAL_INT(20, beyond_1_um); /* 0.1 % */
  /* What is left are the readings' own steps, for narrow presses between the sensors. */
  TEST_ASSERT_TRUE(worst_usual < 5e-3);
  TEST_ASSERT_TRUE(worst_patient < 5e-3);
  TEST_ASSERT_TRUE(worst_force < 5e-4);
  TEST_ASSERT_TRUE(worst_sigma < 5e-4);
  TEST_ASSERT_TRUE(worst_p0 < 5e-4);
}

static void test_residual_is_that_of_the_readings(void) {
  struct random random = {72};
  struct press press = {2.0, -5.0, 5000.0, 6.0};
  read_press(&press, 50.0, &random);
  fit_gaussian(&array, readings, ALL, &patient, &result);
  struct press fitted = {(double)result.x_mm, (double)result.y_mm, (double)result.p0_Pa, (double)result.sigma_mm};
  double squares = 0.0;
  for (int k = 0; k < SENSORS; k++) {
    double residual = readings[k] / 1024.0 - gaussian(&fitted, (double)x_mm[k], (double)y_mm[k]);
    squares += residual * residual;
  }
  TEST_ASSERT_FLOAT_WITHIN(0.1f, (float)sqrt(squares / SENSORS), result.residual_rms_Pa);
  TEST_ASSERT_FLOAT_WITHIN(1e-6f, (float)force_of(&fitted), result.force_N);
}

/* Doubled readings give the same bits of location and width, from 1 Pa to 2 MPa. */
static void test_scale_invariance(void) {
  struct random random = {73};
  double worst = 0.0;
  for (int i = 0; i < 200; i++) {
    struct press press = random_press(&random, 3.0);
    press.p0_Pa = 1.0;
    read_press(&press, 0.01, &random);
    struct fit_settings settings = {.iterations = 7, .noise_Pa_q10 = 1};
    fit_gaussian(&array, readings, ALL, &settings, &result);
    struct fit_result first = result;
    for (int doubled = 1; doubled <= 20; doubled++) {
      for (int k = 0; k < SENSORS; k++) {
        readings[k] *= 2;
      }
      settings.noise_Pa_q10 *= 2;
      fit_gaussian(&array, readings, ALL, &settings, &result);
      TEST_ASSERT_EQUAL_MEMORY(&first.x_mm, &result.x_mm, sizeof(float));
      TEST_ASSERT_EQUAL_MEMORY(&first.y_mm, &result.y_mm, sizeof(float));
      TEST_ASSERT_EQUAL_MEMORY(&first.sigma_mm, &result.sigma_mm, sizeof(float));
      TEST_ASSERT_EQUAL_MEMORY(&first.location_sd_mm, &result.location_sd_mm, sizeof(float));
      float p0_Pa = ldexpf(first.p0_Pa, doubled);
      TEST_ASSERT_EQUAL_MEMORY(&p0_Pa, &result.p0_Pa, sizeof(float));
      TEST_ASSERT_EQUAL_HEX32(first.flags, result.flags);
    }
    static const double peaks_Pa[] = {100.0, 3e3, 7e4, 2e6};
    for (size_t at = 0; at < 4; at++) {
      press.p0_Pa = peaks_Pa[at];
      read_press(&press, 0.0, NULL);
      fit_gaussian(&array, readings, ALL, &patient, &result);
      worst = fmax(worst, location_error_mm(&press));
    }
  }
  say("location between 100 Pa and 2 MPa, worst, um:", worst * 1e3);
  TEST_ASSERT_TRUE(worst < 10e-3); /* at 100 Pa the readings' own steps show */
}

static void test_predicted_scatter(void) {
  static const struct {
    struct press press;
    double noise_Pa;
  } cases[] = {{{0.0, 0.0, 5000.0, 5.7}, 11.0},
               {{3.0, -6.5, 5000.0, 5.7}, 11.0},
               {{-4.0, 10.0, 1000.0, 7.0}, 5.0},
               {{4.5, 4.5, 20000.0, 5.0}, 5.0}};
  for (size_t i = 0; i < 4; i++) {
    enum { FITS = 20000 };
    struct random random = {90 + i};
    const struct fit_settings settings = {.iterations = 7, .noise_Pa_q10 = to_q10(cases[i].noise_Pa)};
    double sum_x = 0, sum_y = 0, sum_f = 0, square_x = 0, square_y = 0, square_f = 0;
    double predicted = 0, predicted_f = 0;
    for (int fit = 0; fit < FITS; fit++) {
      read_press(&cases[i].press, cases[i].noise_Pa, &random);
      fit_gaussian(&array, readings, ALL, &settings, &result);
      double dx = (double)result.x_mm - cases[i].press.x_mm;
      double dy = (double)result.y_mm - cases[i].press.y_mm;
      double df = (double)result.force_N - force_of(&cases[i].press);
      sum_x += dx;
      sum_y += dy;
      sum_f += df;
      square_x += dx * dx;
      square_y += dy * dy;
      square_f += df * df;
      predicted += (double)result.location_sd_mm / FITS;
      predicted_f += (double)result.force_sd_N / FITS;
    }
    double radial = sqrt((square_x + square_y) / FITS - (sum_x * sum_x + sum_y * sum_y) / ((double)FITS * FITS));
    double force = sqrt(square_f / FITS - sum_f * sum_f / ((double)FITS * FITS));
    char text[140];
    snprintf(text, sizeof text, "predicted over actual scatter: location %.3f, force %.3f (%.2g mm, %.2g N)",
             predicted / radial, predicted_f / force, radial, force);
    TEST_MESSAGE(text);
    /* The larger of noise and residuals is taken, so a little above 1. */
    TEST_ASSERT_TRUE(fabs(predicted / radial - 1.0) < 0.2);
    TEST_ASSERT_TRUE(fabs(predicted_f / force - 1.0) < 0.2);
  }
}

/* The same fit as if the others did not read, but those are no masked sensors. */
static void test_n_largest(void) {
  struct random random = {94};
  for (int i = 0; i < 5000; i++) {
    struct press press = random_press(&random, 6.0);
    read_press(&press, 5.0, &random);
    for (int k = 0; k < SENSORS && i % 2; k++) {
      readings[k] = (readings[k] >> 20) - 1; /* many equal ones */
    }
    uint32_t usable = i % 3 ? ALL : random_u32(&random) & ALL;
    struct fit_settings settings = usual;
    settings.n_largest = (uint8_t)(1 + random_below(&random, 20));
    uint32_t expected = 0;
    int32_t largest = 0;
    for (int k = 0; k < SENSORS; k++) {
      int before = 0;
      for (int j = 0; j < SENSORS; j++) {
        bool ahead = readings[j] > readings[k] || (readings[j] == readings[k] && j < k);
        before += (usable >> j & 1u) && ahead;
      }
      bool in_use = usable >> k & 1u;
      expected |= in_use && before < settings.n_largest ? UINT32_C(1) << k : 0;
      largest = in_use && readings[k] > largest ? readings[k] : largest;
    }
    struct fit_result masked;
    fit_general(&array, readings, expected, &usual, &masked);
    fit_general(&array, readings, usable, &settings, &result);
    assert_finite_and_defined();
    bool enough = largest > 0 && __builtin_popcount(expected) >= 4;
    TEST_ASSERT_EQUAL_HEX32(enough ? expected : 0, result.used);
    TEST_ASSERT_EQUAL(usable != ALL, (result.flags & CONTACT_FLAG_SENSOR_MASKED) != 0);
    masked.flags = result.flags = (masked.flags ^ result.flags) & ~(uint32_t)CONTACT_FLAG_SENSOR_MASKED;
    TEST_ASSERT_EQUAL_MEMORY(&masked, &result, sizeof masked);
    TEST_ASSERT_EQUAL_HEX32(0, result.flags);

    fit_general(&array, readings, ALL, &settings, &masked);
    fit_gaussian(&array, readings, ALL, &settings, &result);
    if (settings.n_largest >= SENSORS) {
      fit_gaussian(&array, readings, ALL, &usual, &masked);
    }
    TEST_ASSERT_EQUAL_MEMORY(&masked, &result, sizeof masked);
  }
}

static void test_random_bits(void) {
  struct random random = {91};
  for (int i = 0; i < 100000; i++) {
    uint32_t shift = random_below(&random, 32);
    for (int k = 0; k < SENSORS; k++) {
      readings[k] = (int32_t)random_u32(&random) >> (i % 2 ? shift : random_below(&random, 32));
      readings[k] = i % 4 ? readings[k] : readings[k] & INT32_MAX;
    }
    uint32_t used = i % 3 ? random_u32(&random) : ALL;
    struct fit_settings settings = {.iterations = (uint8_t)(1 + random_below(&random, 20)),
                                    .noise_Pa_q10 = 1 + (int32_t)random_below(&random, 100000),
                                    .n_largest = (uint8_t)(i % 5 ? 0 : random_below(&random, 17))};
    fit_gaussian(&array, readings, used, &settings, &result);
    assert_finite_and_defined();
  }
}

/* Narrow contacts up to 6 mm outside the array: where they are missed, it is not for a limit of p0,
 * which is 10^6 of the largest reading and a hundred times what any of them asks for. */
static void test_narrow_contacts_outside_are_not_held_back_by_p0(void) {
  struct random random = {95};
  double steepest = 0.0;
  int missed = 0, held_back = 0, unflagged = 0, count = 0;
  while (count < 20000) {
    const struct press press = {random_between(&random, -15.0, 15.0), random_between(&random, -24.0, 24.0), 50000.0,
                                random_between(&random, 2.7, 4.0)};
    if (fabs(press.x_mm) <= 9.0 && fabs(press.y_mm) <= 18.0) {
      continue;
    }
    read_press(&press, 0.0, &random);
    int32_t largest = 0;
    for (int k = 0; k < SENSORS; k++) {
      largest = readings[k] > largest ? readings[k] : largest;
    }
    if (largest < 100 * 1024) {
      continue;
    }
    count++;
    const double share = press.p0_Pa * 1024.0 / largest;
    steepest = fmax(steepest, share);
    struct fit_settings settings = patient;
    fit_set_errors(&settings, 0.03f, 0.005f);
    for (int kernel = 0; kernel < 2; kernel++) {
      (kernel == 0 ? fit_gaussian : fit_general)(&array, readings, ALL, &settings, &result);
      if (hypot((double)result.x_mm - press.x_mm, (double)result.y_mm - press.y_mm) > 1.0) {
        missed++;
        held_back += (double)result.p0_Pa * 1024.0 / largest > 0.99e6;
        unflagged += !(result.flags & (CONTACT_FLAG_UNCERTAIN | CONTACT_FLAG_AT_BOUND));
      }
    }
  }
  say("largest p0 over the largest reading:", steepest);
  say("percent missed:", 50.0 * missed / count);
  say("percent of these held back by p0:", 100.0 * held_back / missed);
  say("percent of these unflagged:", 100.0 * unflagged / missed);
  TEST_ASSERT_TRUE(steepest < 1e4);
  TEST_ASSERT_TRUE(held_back < 0.01 * missed);
  TEST_ASSERT_TRUE(unflagged < 0.001 * missed);
}

static void test_quadrature(void) {
  struct random random = {94};
  for (int i = 0; i < 100000; i++) {
    float v[4];
    for (int k = 0; k < 4; k++) {
      v[k] = i % 16 >> k & 1 ? 0.0f : (float)exp(random_between(&random, -12.0, 9.0));
    }
    const double expected = hypot((double)v[0] * (double)v[1], (double)v[2] * (double)v[3]);
    const double found = (double)fit_quadrature(v[0], v[1], v[2], v[3]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3 * expected, expected, found);
  }
}

static void test_repeated_fits_give_the_same_bits(void) {
  struct random random = {93};
  struct press press = random_press(&random, 0.0);
  read_press(&press, 5.0, &random);
  fit_gaussian(&array, readings, ALL, &usual, &result);
  struct fit_result first = result;
  fit_gaussian(&array, readings, 0x3333, &usual, &result);
  memset(&result, 0xA5, sizeof result);
  fit_gaussian(&array, readings, ALL, &usual, &result);
  TEST_ASSERT_EQUAL_MEMORY(&first, &result, sizeof first);
}

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(test_array_arguments);
  RUN_TEST(test_without_noise_there_is_no_fit);
  RUN_TEST(test_noise_free_presses_are_recovered);
  RUN_TEST(test_residual_is_that_of_the_readings);
  RUN_TEST(test_scale_invariance);
  RUN_TEST(test_predicted_scatter);
  RUN_TEST(test_n_largest);
  RUN_TEST(test_random_bits);
  RUN_TEST(test_narrow_contacts_outside_are_not_held_back_by_p0);
  RUN_TEST(test_quadrature);
  RUN_TEST(test_repeated_fits_give_the_same_bits);
  return UNITY_END();
}
