#include "fit_bench.h"

#include <string.h>

static uint32_t flags_of_equal(int32_t reading) {
  for (int k = 0; k < SENSORS; k++) {
    readings[k] = reading;
  }
  fit_gaussian(&array, readings, ALL, &usual, &result);
  assert_finite_and_defined();
  return result.flags;
}

TEST(test_equal_readings_are_flat) {
  static const int32_t levels[] = {1024, 100 * 1024, 10000 * 1024, INT32_MAX};
  for (size_t i = 0; i < 4; i++) {
    TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_FLAT, flags_of_equal(levels[i]));
  }
  struct press wide = {0.0, 0.0, 5000.0, 60.0};
  read_press(&wide, 0.0, NULL);
  fit_gaussian(&array, readings, ALL, &usual, &result);
  TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_FLAT, result.flags);
}

TEST(test_nothing_positive_is_no_fit) {
  static const int32_t levels[] = {0, -1, -1024, INT32_MIN};
  for (size_t i = 0; i < 4; i++) {
    TEST_ASSERT_EQUAL_HEX32(CONTACT_FLAG_LOW_SIGNAL, flags_of_equal(levels[i]));
  }
}

TEST(test_one_hot) {
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

TEST(test_low_signal_below_twenty_sigma) {
  struct press press = {0.0, 0.0, 101.0, 6.0};
  read_press(&press, 0.0, NULL); /* the centre sensor reads 101 Pa */
  fit_gaussian(&array, readings, ALL, &usual, &result);
  TEST_ASSERT_BITS_LOW(CONTACT_FLAG_LOW_SIGNAL, result.flags);
  press.p0_Pa = 99.0;
  read_press(&press, 0.0, NULL);
  fit_gaussian(&array, readings, ALL, &usual, &result);
  TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_LOW_SIGNAL | CONTACT_FLAG_FIT_VALID, result.flags);
}

/* Noise, sensors whose gains are off, or what is left of earlier presses: the predicted standard deviations are those
 * of the errors, alike for all kernels. */
TEST(test_errors_spread_the_result_as_predicted) {
  struct random random = {101};
  static const double hysteresis_sds[] = {0.0, 0.0, 0.02, 0.06};
  for (int i = 0; i < 12; i++) {
    const int kernel = i % 3;
    const double noise_Pa = i / 3 == 1 ? 20.0 : 1.0, gain_sd = i < 3 ? 0.02 : 0.0, hysteresis_sd = hysteresis_sds[i / 3];
    struct fit_settings settings = {.iterations = 7, .noise_Pa_q10 = (int32_t)(1024.0 * noise_Pa)};
    uint32_t used = kernel == 1 ? ALL & ~(UINT32_C(1) << 4) : ALL;
    double squares = 0.0, predicted = 0.0, force = 0.0, force_predicted = 0.0;
    for (int n = 0; n < 4000; n++) {
      struct press press = random_press(&random, 0.0);
      press.x_mm *= 0.7;
      press.y_mm *= 0.7;
      press.sigma_mm = 5.0 + 0.2 * press.sigma_mm;
      press.p0_Pa = i < 9 ? press.p0_Pa : 100000.0;
      for (int k = 0; k < SENSORS; k++) {
        double sd = k % 3 ? gain_sd : 0.0;
        double hysteresis_Pa = k % 3 ? hysteresis_sd * press.p0_Pa : 0.0;
        settings.gain_sd_q16[k] = (uint16_t)(65536.0 * sd);
        settings.hysteresis_sd_Pa_q10[k] = (int32_t)(1024.0 * hysteresis_Pa);
        readings[k] = to_q10((1.0 + sd * random_normal(&random)) * gaussian(&press, (double)x_mm[k], (double)y_mm[k]) +
                             (i / 3 == 1 ? noise_Pa : hysteresis_Pa) * random_normal(&random));
      }
      (kernel == 2 ? fit_general : fit_gaussian)(&array, readings, used, &settings, &result);
      assert_finite_and_defined();
      squares += pow(location_error_mm(&press), 2.0);
      predicted += pow((double)result.location_sd_mm, 2.0);
      force += pow((double)result.force_N / force_of(&press) - 1.0, 2.0);
      force_predicted += pow((double)(result.force_sd_N / result.force_N), 2.0);
    }
    /* The larger of noise and residuals is taken, so a little above 1. */
    const float within = gain_sd > 0.0 ? 0.08f : 0.2f;
    TEST_ASSERT_FLOAT_WITHIN(within, 1.0f, (float)sqrt(predicted / squares));
    TEST_ASSERT_FLOAT_WITHIN(within, 1.0f, (float)sqrt(force_predicted / force));
  }
}

/* Readings of an elliptic Gaussian at this angle. */
static void read_ellipse(double x, double y, double longer, double shorter, double angle) {
  double c = cos(angle), s = sin(angle);
  for (int k = 0; k < SENSORS; k++) {
    double dx = (double)x_mm[k] - x, dy = (double)y_mm[k] - y;
    double u = (c * dx + s * dy) / longer, v = (c * dy - s * dx) / shorter;
    readings[k] = to_q10(20000.0 * exp(-0.5 * (u * u + v * v)));
  }
}

TEST(test_widths_and_slant) {
  struct random random = {102};
  struct fit_settings settings = {.iterations = 7, .noise_Pa_q10 = 1024};
  for (int i = 0; i < 2000; i++) {
    double x = random_between(&random, -5.0, 5.0), y = random_between(&random, -13.0, 13.0);
    double ratio = i % 2 ? random_between(&random, 1.15, 1.4) : 1.0;
    double angle = random_between(&random, 0.0, 3.14159265);
    double shorter = random_between(&random, 5.5, 7.0), longer = ratio * shorter;
    double c = cos(angle), s = sin(angle);
    read_ellipse(x, y, longer, shorter, angle);
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
TEST(test_a_wrong_tail_is_no_elongation) {
  struct random random = {103};
  struct fit_settings settings = {
      .iterations = 4, .noise_Pa_q10 = 5 * 1024, .prior_sigma_mm = 5.5f, .prior_width_mm = 0.06f, .dip_share = 0.01f, .dip_sd_mm = 20.7f};
  fit_set_errors(&settings, 0.01f, 0.005f);
  int elongated[2] = {0};
  for (int i = 0; i < 1000; i++) {
    double x = random_between(&random, -9.0, 9.0), y = random_between(&random, -18.0, 18.0);
    double longer = i % 2 ? 2.0 * 5.5 : 5.5, angle = random_between(&random, 0.0, 3.14159265);
    read_ellipse(x, y, longer, 5.5, angle);
    fit_gaussian(&array, readings, ALL, &settings, &result);
    elongated[i % 2] += (result.flags & CONTACT_FLAG_ELONGATED) != 0;
  }
  TEST_ASSERT_EQUAL_INT(0, elongated[0]);
  TEST_ASSERT_GREATER_THAN_INT(400, elongated[1]);
}

TEST(test_the_limit_of_uncertain_is_a_setting) {
  struct press press = {2.0, 5.0, 5000.0, 6.0};
  read_press(&press, 0.0, NULL);
  struct fit_settings settings = usual;
  fit_gaussian(&array, readings, ALL, &settings, &result);
  TEST_ASSERT_BITS_LOW(CONTACT_FLAG_UNCERTAIN, result.flags);
  for (int general = 0; general < 2; general++) {
    for (int above = 0; above < 2; above++) {
      settings.location_sd_limit_mm = result.location_sd_mm * (above ? 0.99f : 1.01f);
      struct fit_result judged;
      (general ? fit_general : fit_gaussian)(&array, readings, ALL, &settings, &judged);
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

TEST(test_two_contacts_are_not_the_model) {
  struct press one = {0.0, -14.0, 5000.0, 5.0};
  struct press other = {0.0, 14.0, 5000.0, 5.0};
  for (int k = 0; k < SENSORS; k++) {
    readings[k] = to_q10(gaussian(&one, (double)x_mm[k], (double)y_mm[k]) + gaussian(&other, (double)x_mm[k], (double)y_mm[k]));
  }
  fit_gaussian(&array, readings, ALL, &usual, &result);
  assert_finite_and_defined();
  TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_MODEL, result.flags);
}
