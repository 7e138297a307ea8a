/* A tangential force that is not estimated: its trace in the residual, and what that makes of the error. */
#include "common/contact_flags.h"
#include "fit/fit_bias.h"
#include "pad_press.h"

#define SENSORS GRID_SENSORS
#define ALL ((UINT32_C(1) << SENSORS) - 1)
#define NOISE_Pa 4.0

static struct fit_array array;
static struct random noise;
static struct pad_press rubber;
static int32_t readings[SENSORS];
static struct fit_settings settings;
static struct fit_result result;
static struct fit_bias bias;

void setUp(void) {
  make_grid_of_15(&array);
  noise = (struct random){UINT64_C(20221015)};
  rubber = (struct pad_press){.profile = pad_of_12_mm()};
  bias = (struct fit_bias){0};
  settings = (struct fit_settings){.iterations = 4, .noise_Pa_q10 = (int32_t)(1024 * NOISE_Pa)};
  fit_set_errors(&settings, 0.015f, 0.0065f);
}

static double any(double low, double high) { return random_between(&noise, low, high); }

/* 5 N; qx, qy: shares of it. */
static void press(double x_mm, double y_mm, double qx, double qy) {
  const struct contact contact = {x_mm, y_mm, 5.0, 5.0 * qx, 5.0 * qy, 4.0};
  for (int k = 0; k < SENSORS; k++) {
    double pressure_Pa = pad_press_Pa(&rubber, &contact, k) + NOISE_Pa * any(-1.0, 1.0);
    readings[k] = (int32_t)lround(1024.0 * pressure_Pa);
  }
}

static void fit(void) { fit_gaussian(&array, readings, ALL, &settings, &result); }

static void widen(void) { fit_bias_add(&bias, &array, &settings, &result); }

static void follow(void) { fit_bias_step(&bias, &array, readings, &settings, &result); }

/* A press that is held until the search has ended. */
static void hold(uint32_t usable) {
  bias = (struct fit_bias){0};
  fit_gaussian(&array, readings, usable, &settings, &result);
  for (int part = 0; part < FIT_BIAS_PARTS; part++) {
    follow();
  }
  widen();
}

static bool is_uncertain(void) { return result.flags & CONTACT_FLAG_UNCERTAIN; }

TEST(test_a_force_is_part_of_the_error) {
  double errors_mm = 0.0, stated_mm = 0.0;
  int silent = 0;
  for (int i = 0; i < 400; i++) {
    double x_mm = any(-6.0, 6.0), y_mm = any(-14.0, 14.0), ratio = any(0.25, 0.5), angle = any(0.0, 6.28);
    press(x_mm, y_mm, ratio * cos(angle), ratio * sin(angle));
    hold(ALL);
    double error_mm = hypot((double)result.x_mm - x_mm, (double)result.y_mm - y_mm);
    TEST_ASSERT_TRUE(error_mm > 0.6);
    errors_mm += error_mm;
    stated_mm += (double)result.location_sd_mm;
    silent += error_mm > 1.0 && !is_uncertain();
  }
  CHECK(fabs(stated_mm / errors_mm - 1.0) < 0.2 && silent <= 4, "off %.2f mm, stated %.2f mm, %d silent", errors_mm / 400.0,
        stated_mm / 400.0, silent);
}

TEST(test_without_a_force_little_is_added) {
  int more = 0;
  for (int i = 0; i < 200; i++) {
    press(any(-9.0, 9.0), any(-18.0, 18.0), 0.0, 0.0);
    fit();
    const float without_mm = result.location_sd_mm;
    hold(ALL);
    TEST_ASSERT_TRUE(result.location_sd_mm >= without_mm * 0.999f);
    more += result.location_sd_mm > without_mm + 0.25f;
  }
  TEST_ASSERT_LESS_OR_EQUAL(2, more);
}

/* Until a search has ended the force is what is usual, and so again after the contact. */
TEST(test_before_the_first_search_a_force_is_assumed) {
  press(2.0, 3.0, 0.0, 0.0);
  fit();
  const struct fit_result fitted = result;
  for (int contact = 0; contact < 2; contact++) {
    for (int part = 0; part < FIT_BIAS_PARTS; part++) {
      result = fitted;
      widen();
      TEST_ASSERT_FLOAT_WITHIN(0.01f, hypotf(fitted.location_sd_mm, FIT_BIAS_ASSUMED_RATIO * 0.38f * 9.0f), result.location_sd_mm);
      TEST_ASSERT_TRUE(is_uncertain());
      follow();
    }
    result = fitted;
    widen();
    TEST_ASSERT_TRUE(result.location_sd_mm < fitted.location_sd_mm + 0.1f);
    fit_bias_begin(&bias);
  }
}

/* A search is of the readings that it began with. */
TEST(test_a_search_does_not_mix_frames) {
  press(2.0, 3.0, 0.4, 0.1);
  hold(ALL);
  const float ratio = bias.ratio;
  result = (struct fit_result){.flags = CONTACT_FLAG_FIT_VALID, .sigma_mm = 3.0f};
  widen();
  TEST_ASSERT_FLOAT_WITHIN_MESSAGE(0.01f, FIT_BIAS_ASSUMED_RATIO * 0.55f * 9.0f, result.location_sd_mm, "narrow: a dip may be its trace");
  bias = (struct fit_bias){0};
  fit();
  follow();
  press(-5.0, 8.0, 0.0, 0.0);
  fit();
  for (int part = 1; part < FIT_BIAS_PARTS; part++) {
    TEST_ASSERT_FALSE(bias.known);
    follow();
  }
  TEST_ASSERT_EQUAL_FLOAT(ratio, bias.ratio);
}

/* The search removes a known dip. Calibrations find too wide a dip, since a narrow one looks like shifted zeros (DIP_WIDTHS, solver). */
TEST(test_a_dip_that_is_known_is_no_force) {
  static const float known_mm[] = {15.0f, 20.7f};
  rubber.dip_share = 0.05;
  rubber.dip_sd_mm = 14.0;
  settings.prior_sigma_mm = 5.6f;
  settings.prior_width_mm = 0.07f;
  settings.dip_share = 0.05f;
  for (int c = 0; c < 2; c++) {
    settings.dip_sd_mm = known_mm[c];
    int warned[2] = {0}; /* without a force, with one */
    for (int i = 0; i < 400; i++) {
      double x_mm = any(-9.0, 9.0), y_mm = any(-18.0, 18.0), ratio = i % 2 ? 0.4 : 0.0, angle = any(0.0, 6.28);
      press(x_mm, y_mm, ratio * cos(angle), ratio * sin(angle));
      hold(ALL);
      warned[i % 2] += is_uncertain();
    }
    CHECK(warned[0] <= 4 && warned[1] >= 180, "known %.1f mm, of 200 warned: %d, pulled %d", (double)known_mm[c], warned[0], warned[1]);
  }
}

/* Sensors that measure a contact wider or narrower by 6 % at most, and are off by 0.16 mm. */
TEST(test_what_is_the_sensors_own_is_no_force) {
  int forces[2] = {0}; /* unknown, known */
  fit_set_errors(&settings, 0.002f, 0.0065f);
  for (int i = 0; i < 200; i++) {
    double x_mm = any(-9.0, 9.0), y_mm = any(-18.0, 18.0);
    pad_press_draw_deviations(&rubber, 600, 2000, &noise);
    for (int k = 0; k < SENSORS; k++) {
      const struct fit_deviation *deviation = &rubber.deviations[k];
      double sigma_mm = 6.0 * exp(deviation->wider_q15 / 32768.0);
      double dx = 9.0 * (k / 5 - 1 + deviation->off_x_q15 / 32768.0) - x_mm;
      double dy = 9.0 * (k % 5 - 2 + deviation->off_y_q15 / 32768.0) - y_mm;
      readings[k] = (int32_t)lround(1024.0 * 2e4 * exp(-(dx * dx + dy * dy) / (2.0 * sigma_mm * sigma_mm)));
    }
    for (int known = 0; known < 2; known++) {
      settings.deviations = known ? rubber.deviations : NULL;
      hold(ALL);
      forces[known] += bias.known && bias.ratio > 0.1f;
    }
  }
  CHECK(forces[0] >= 20 && forces[1] <= 4, "of 200 forces: %d, known %d", forces[0], forces[1]);
}

/* Where too few sensors are left the residual shows nothing, and the force stays what is usual. */
TEST(test_sensors_may_be_missing) {
  press(2.0, 3.0, 0.4, 0.1);
  for (int k = 0; k < SENSORS; k++) {
    hold(ALL & ~(UINT32_C(1) << k));
    TEST_ASSERT_TRUE(bias.known);
    TEST_ASSERT_TRUE_MESSAGE(is_uncertain(), "one is enough to hide it");
  }
  press(2.0, 3.0, 0.0, 0.0);
  hold((UINT32_C(1) << (FIT_BIAS_SENSORS - 1)) - 1);
  TEST_ASSERT_FALSE(bias.known);
  TEST_ASSERT_TRUE(result.location_sd_mm > FIT_BIAS_ASSUMED_RATIO * 0.38f * 9.0f);
}

TEST(test_what_is_no_fit_stays_as_it_is) {
  const uint32_t flags[] = {0, CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_AT_BOUND, CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_FLAT};
  press(2.0, 3.0, 0.4, 0.1);
  for (int i = 0; i < 3; i++) {
    fit();
    result.flags = flags[i];
    result.location_sd_mm = 0.1f;
    for (int frame = 0; frame < 2 * FIT_BIAS_PARTS; frame++) {
      widen();
      follow();
    }
    TEST_ASSERT_FALSE(bias.known);
    TEST_ASSERT_EQUAL_FLOAT(0.1f, result.location_sd_mm);
    TEST_ASSERT_EQUAL_HEX32(flags[i], result.flags);
  }
}
