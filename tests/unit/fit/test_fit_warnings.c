#include "fit_bench.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static void test_equal_readings_are_flat(void) {
  static const int32_t levels[] = {1024, 100 * 1024, 10000 * 1024, INT32_MAX};
  for (size_t i = 0; i < 4; i++) {
    for (int k = 0; k < SENSORS; k++) {
      readings[k] = levels[i];
    }
    fit_gaussian(&array, readings, ALL, &usual, &result);
    assert_finite_and_defined();
    TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_FLAT, result.flags);
  }
  struct press wide = {0.0, 0.0, 5000.0, 60.0};
  read_press(&wide, 0.0, NULL);
  fit_gaussian(&array, readings, ALL, &usual, &result);
  TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_FLAT, result.flags);
}

static void test_nothing_positive_is_no_fit(void) {
  static const int32_t levels[] = {0, -1, -1024, INT32_MIN};
  for (size_t i = 0; i < 4; i++) {
    for (int k = 0; k < SENSORS; k++) {
      readings[k] = levels[i];
    }
    fit_gaussian(&array, readings, ALL, &usual, &result);
    assert_finite_and_defined();
    TEST_ASSERT_EQUAL_HEX32(CONTACT_FLAG_LOW_SIGNAL, result.flags);
  }
}

static void test_one_hot(void) {
  for (int hot = 0; hot < SENSORS; hot++) {
    memset(readings, 0, sizeof readings);
    readings[hot] = 5000 * 1024;
    fit_gaussian(&array, readings, ALL, &usual, &result);
    assert_finite_and_defined();
    TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_FIT_VALID, result.flags);
    TEST_ASSERT_NOT_EQUAL_UINT32(0, result.flags & (CONTACT_FLAG_UNCERTAIN | CONTACT_FLAG_AT_BOUND));
    if (!(result.flags & CONTACT_FLAG_AT_BOUND)) {
      TEST_ASSERT_FLOAT_WITHIN(PITCH_mm, x_mm[hot], result.x_mm);
      TEST_ASSERT_FLOAT_WITHIN(PITCH_mm, y_mm[hot], result.y_mm);
    }
  }
}

static void test_low_signal_below_twenty_sigma(void) {
  struct press press = {0.0, 0.0, 101.0, 6.0};
  read_press(&press, 0.0, NULL); /* the centre sensor reads 101 Pa */
  fit_gaussian(&array, readings, ALL, &usual, &result);
  TEST_ASSERT_BITS_LOW(CONTACT_FLAG_LOW_SIGNAL, result.flags);
  press.p0_Pa = 99.0;
  read_press(&press, 0.0, NULL);
  fit_gaussian(&array, readings, ALL, &usual, &result);
  TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_LOW_SIGNAL | CONTACT_FLAG_FIT_VALID, result.flags);
}

/* Sensors whose gains are off: the predicted standard deviations are those of the errors, alike for
 * all kernels. */
static void test_gains_spread_the_location_as_predicted(void) {
  struct random random = {101};
  for (int kernel = 0; kernel < 3; kernel++) {
    struct fit_settings settings = {.iterations = 7, .noise_Pa_q10 = 1024};
    uint32_t used = kernel == 1 ? ALL & ~(UINT32_C(1) << 4) : ALL;
    double squares = 0.0, predicted = 0.0, force = 0.0, force_predicted = 0.0;
    for (int i = 0; i < 4000; i++) {
      struct press press = random_press(&random, 0.0);
      press.x_mm *= 0.7;
      press.y_mm *= 0.7;
      press.sigma_mm = 5.0 + 0.2 * press.sigma_mm;
      for (int k = 0; k < SENSORS; k++) {
        double sd = k % 3 ? 0.02 : 0.0;
        settings.gain_sd_q16[k] = (uint16_t)(65536.0 * sd);
        readings[k] = to_q10((1.0 + sd * random_normal(&random)) * gaussian(&press, (double)x_mm[k], (double)y_mm[k]));
      }
      if (kernel == 2) {
        fit_general(&array, readings, used, &settings, &result);
      } else {
        fit_gaussian(&array, readings, used, &settings, &result);
      }
      assert_finite_and_defined();
      squares += pow(location_error_mm(&press), 2.0) / 4000.0;
      predicted += pow((double)result.location_sd_mm, 2.0) / 4000.0;
      force += pow((double)result.force_N / force_of(&press) - 1.0, 2.0) / 4000.0;
      force_predicted += pow((double)(result.force_sd_N / result.force_N), 2.0) / 4000.0;
    }
    TEST_ASSERT_FLOAT_WITHIN(0.08f, 1.0f, (float)sqrt(predicted / squares));
    TEST_ASSERT_FLOAT_WITHIN(0.08f, 1.0f, (float)sqrt(force_predicted / force));
  }
}

/* An elliptic Gaussian at any angle. */
static void test_widths_and_slant(void) {
  struct random random = {102};
  struct fit_settings settings = {.iterations = 7, .noise_Pa_q10 = 1024};
  for (int i = 0; i < 2000; i++) {
    double x = random_between(&random, -5.0, 5.0), y = random_between(&random, -13.0, 13.0);
    double ratio = i % 2 ? random_between(&random, 1.15, 1.4) : 1.0;
    double angle = random_between(&random, 0.0, 3.14159265);
    double shorter = random_between(&random, 5.5, 7.0), longer = ratio * shorter;
    double c = cos(angle), s = sin(angle);
    for (int k = 0; k < SENSORS; k++) {
      double dx = (double)x_mm[k] - x, dy = (double)y_mm[k] - y;
      double u = (c * dx + s * dy) / longer, v = (c * dy - s * dx) / shorter;
      readings[k] = to_q10(20000.0 * exp(-0.5 * (u * u + v * v)));
    }
    fit_gaussian(&array, readings, ALL, &settings, &result);
    assert_finite_and_defined();
    TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_WIDTHS_VALID, result.flags);
    TEST_ASSERT_EQUAL(i % 2, (result.flags & CONTACT_FLAG_ELONGATED) != 0);
    double xx = longer * longer * c * c + shorter * shorter * s * s;
    double yy = longer * longer * s * s + shorter * shorter * c * c;
    double xy = (longer * longer - shorter * shorter) * s * c;
    TEST_ASSERT_FLOAT_WITHIN(i % 2 ? 0.6f : 0.02f, (float)sqrt(xx), result.sigma_x_mm);
    TEST_ASSERT_FLOAT_WITHIN(i % 2 ? 0.6f : 0.02f, (float)sqrt(yy), result.sigma_y_mm);
    TEST_ASSERT_FLOAT_WITHIN(i % 2 ? 0.1f : 0.005f, (float)(xy / sqrt(xx * yy)), result.width_correlation);
  }
  /* Not told apart from gains that are off by so much. */
  for (int k = 0; k < SENSORS; k++) {
    settings.gain_sd_q16[k] = 65535 / 4;
  }
  fit_gaussian(&array, readings, ALL, &settings, &result);
  TEST_ASSERT_BITS_LOW(CONTACT_FLAG_ELONGATED, result.flags);
  /* Nor without every sensor. */
  fit_gaussian(&array, readings, ALL & ~UINT32_C(1), &usual, &result);
  TEST_ASSERT_BITS_LOW(CONTACT_FLAG_ELONGATED | CONTACT_FLAG_WIDTHS_VALID, result.flags);
}

/* The profile's tail is not what the dip says: 1 % of the peak too much of it. */
static void test_a_wrong_tail_is_no_elongation(void) {
  struct random random = {103};
  struct fit_settings settings = {.iterations = 4,
                                  .noise_Pa_q10 = 5 * 1024,
                                  .prior_sigma_mm = 5.5f,
                                  .prior_width_mm = 0.06f,
                                  .dip_share = 0.01f,
                                  .dip_sd_mm = 20.7f};
  fit_set_errors(&settings, 0.01f, 0.005f);
  int elongated[2] = {0};
  for (int i = 0; i < 1000; i++) {
    double x = random_between(&random, -9.0, 9.0), y = random_between(&random, -18.0, 18.0);
    double longer = i % 2 ? 2.0 * 5.5 : 5.5, angle = random_between(&random, 0.0, 3.14159265);
    double c = cos(angle), s = sin(angle);
    for (int k = 0; k < SENSORS; k++) {
      double dx = (double)x_mm[k] - x, dy = (double)y_mm[k] - y;
      double u = (c * dx + s * dy) / longer, v = (c * dy - s * dx) / 5.5;
      readings[k] = to_q10(20000.0 * exp(-0.5 * (u * u + v * v)));
    }
    fit_gaussian(&array, readings, ALL, &settings, &result);
    elongated[i % 2] += (result.flags & CONTACT_FLAG_ELONGATED) != 0;
  }
  char text[60];
  snprintf(text, sizeof text, "of 500: round %d, long %d", elongated[0], elongated[1]);
  TEST_ASSERT_TRUE_MESSAGE(elongated[0] == 0, text);
  TEST_ASSERT_TRUE_MESSAGE(elongated[1] > 400, text);
}

static void test_the_limit_of_uncertain_is_a_setting(void) {
  struct press press = {2.0, 5.0, 5000.0, 6.0};
  read_press(&press, 0.0, NULL);
  struct fit_settings settings = usual;
  fit_gaussian(&array, readings, ALL, &settings, &result);
  TEST_ASSERT_BITS_LOW(CONTACT_FLAG_UNCERTAIN, result.flags);
  for (int general = 0; general < 2; general++) {
    for (int above = 0; above < 2; above++) {
      settings.location_sd_limit_mm = result.location_sd_mm * (above ? 0.99f : 1.01f);
      struct fit_result judged;
      if (general) {
        fit_general(&array, readings, ALL, &settings, &judged);
      } else {
        fit_gaussian(&array, readings, ALL, &settings, &judged);
      }
      TEST_ASSERT_EQUAL(above, (judged.flags & CONTACT_FLAG_UNCERTAIN) != 0);
    }
  }
  static const float unset[] = {0.0f, -1.0f, INFINITY, NAN};
  for (size_t i = 0; i < 4; i++) {
    settings.location_sd_limit_mm = unset[i];
    fit_gaussian(&array, readings, ALL, &settings, &result);
    TEST_ASSERT_BITS_LOW(CONTACT_FLAG_UNCERTAIN, result.flags);
    settings.model_sd_q16 = 65535;
    fit_gaussian(&array, readings, ALL, &settings, &result);
    TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_UNCERTAIN, result.flags);
    settings.model_sd_q16 = 0;
  }
}

static void test_two_contacts_are_not_the_model(void) {
  struct press one = {0.0, -14.0, 5000.0, 5.0};
  struct press other = {0.0, 14.0, 5000.0, 5.0};
  for (int k = 0; k < SENSORS; k++) {
    readings[k] =
        to_q10(gaussian(&one, (double)x_mm[k], (double)y_mm[k]) + gaussian(&other, (double)x_mm[k], (double)y_mm[k]));
  }
  fit_gaussian(&array, readings, ALL, &usual, &result);
  assert_finite_and_defined();
  TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_MODEL, result.flags);
}

/* What the last step moved is not settled, and the standard deviation contains it. */
static void test_a_fit_that_still_moves_says_how_far(void) {
  struct random random = {76};
  int unsettled = 0;
  for (int i = 0; i < 2000; i++) {
    struct press press = random_press(&random, 2.0);
    press.p0_Pa = 50000.0;
    read_press(&press, 0.0, NULL);
    struct fit_settings settings = {.iterations = 1, .noise_Pa_q10 = 1};
    fit_general(&array, readings, ALL, &settings, &result);
    for (settings.iterations = 2; settings.iterations <= 5; settings.iterations++) {
      struct fit_result before = result;
      fit_general(&array, readings, ALL, &settings, &result);
      double moved_mm = hypot((double)(result.x_mm - before.x_mm), (double)(result.y_mm - before.y_mm));
      if (before.used != ALL || result.used != ALL) {
        continue; /* without a sensor it is another fit */
      }
      TEST_ASSERT_TRUE((double)result.location_sd_mm > 0.999 * moved_mm - 1e-4);
      unsettled += moved_mm > 0.5 * (double)result.location_sd_mm;
    }
  }
  TEST_ASSERT_GREATER_THAN_INT(50, unsettled); /* that nothing but the step told */
}

/* Share of presses farther off than 1 mm that carry no warning, and of those with a warning. */
static void shares(double sigma_low_mm, double sigma_high_mm, double outside_mm, bool corner, uint64_t seed,
                   double *unflagged, double *warned) {
  struct fit_settings settings = usual;
  settings.model_sd_q16 = 426; /* 0.65 %, as the firmware */
  enum { PRESSES = 5000 };
  struct random random = {seed};
  int bad = 0;
  int warnings = 0;
  for (int i = 0; i < PRESSES; i++) {
    struct press press = {random_between(&random, -9.0, 9.0), random_between(&random, -18.0, 18.0),
                          exp(random_between(&random, log(500.0), log(100000.0))),
                          random_between(&random, sigma_low_mm, sigma_high_mm)};
    if (outside_mm > 0.0) {
      press.x_mm = 9.0 + random_between(&random, 0.0, outside_mm);
    }
    if (corner) {
      press.y_mm = 18.0 + random_between(&random, 0.0, outside_mm);
    }
    read_press(&press, 5.0, &random);
    fit_gaussian(&array, readings, ALL, &settings, &result);
    assert_finite_and_defined();
    bool doubtful = result.flags & (CONTACT_FLAG_UNCERTAIN | CONTACT_FLAG_AT_BOUND | CONTACT_FLAG_LOW_SIGNAL |
                                    CONTACT_FLAG_MODEL | CONTACT_FLAG_FLAT);
    warnings += doubtful;
    bad += !doubtful && location_error_mm(&press) > 1.0;
  }
  *unflagged = (double)bad / PRESSES;
  *warned = (double)warnings / PRESSES;
}

static void test_stiff_cases_are_flagged(void) {
  static const struct {
    const char *name;
    double sigma_low_mm, sigma_high_mm, outside_mm;
    bool corner;
    double most_unflagged, most_warned;
  } cases[] = {
      {"inside, sigma 4 to 9 mm", 4.0, 9.0, 0.0, false, 0.0, 0.1},
      {"sigma 15 to 30 mm", 15.0, 30.0, 0.0, false, 0.0, 0.1},
      {"outside an edge by up to 9 mm", 5.0, 9.0, 9.0, false, 0.0055, 0.4},
      {"outside a corner by up to 6 mm", 4.0, 9.0, 6.0, true, 0.0055, 1.0},
      {"sigma 3 mm", 3.0, 3.0, 0.0, false, 0.0055, 1.0},
      {"sigma 2 mm", 2.0, 2.0, 0.0, false, 0.0055, 1.0},
  };
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    double unflagged, warned;
    shares(cases[i].sigma_low_mm, cases[i].sigma_high_mm, cases[i].outside_mm, cases[i].corner, 80 + i, &unflagged,
           &warned);
    char text[140];
    snprintf(text, sizeof text, "%s: beyond 1 mm unflagged %.4f, with a warning %.3f", cases[i].name, unflagged,
             warned);
    TEST_MESSAGE(text);
    TEST_ASSERT_TRUE_MESSAGE(unflagged <= cases[i].most_unflagged, cases[i].name);
    TEST_ASSERT_TRUE_MESSAGE(warned <= cases[i].most_warned, cases[i].name);
  }
}

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(test_equal_readings_are_flat);
  RUN_TEST(test_nothing_positive_is_no_fit);
  RUN_TEST(test_one_hot);
  RUN_TEST(test_low_signal_below_twenty_sigma);
  RUN_TEST(test_two_contacts_are_not_the_model);
  RUN_TEST(test_a_fit_that_still_moves_says_how_far);
  RUN_TEST(test_gains_spread_the_location_as_predicted);
  RUN_TEST(test_widths_and_slant);
  RUN_TEST(test_a_wrong_tail_is_no_elongation);
  RUN_TEST(test_the_limit_of_uncertain_is_a_setting);
  RUN_TEST(test_stiff_cases_are_flagged);
  return UNITY_END();
}
