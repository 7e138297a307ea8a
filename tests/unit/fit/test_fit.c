#include "common/contact_flags.h"
#include "fit/fit.h"
#include "support/random.h"

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <unity.h>

enum { SENSORS = 15 };
#define ALL 0x7FFFu
#define PITCH_mm 9.0f
#define NOISE_5_Pa 5120
#define GOOD_FIT (CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_UNCERTAINTY_VALID)

static const float x_mm[SENSORS] = {-9, -9, -9, -9, -9, 0, 0, 0, 0, 0, 9, 9, 9, 9, 9};
static const float y_mm[SENSORS] = {-18, -9, 0, 9, 18, -18, -9, 0, 9, 18, -18, -9, 0, 9, 18};

static struct fit_array array;
static struct fit_result result;
static int32_t readings[FT_MAX_SENSORS];
static const struct fit_settings usual = {.iterations = 7, .noise_Pa_q10 = NOISE_5_Pa};
static const struct fit_settings patient = {.iterations = 20, .noise_Pa_q10 = 1};

struct press {
  double x_mm, y_mm, p0_Pa, sigma_mm;
};

void setUp(void) {
  TEST_ASSERT_EQUAL_INT(FT_OK, fit_array_init(&array, SENSORS, x_mm, y_mm, PITCH_mm));
  memset(readings, 0, sizeof readings);
}

void tearDown(void) {}

static void say(const char *what, double value) {
  char text[100];
  snprintf(text, sizeof text, "%s %.4g", what, value);
  TEST_MESSAGE(text);
}

static int32_t to_q10(double pressure_Pa) {
  double q10 = nearbyint(pressure_Pa * 1024.0);
  return q10 > INT32_MAX ? INT32_MAX : q10 < INT32_MIN ? INT32_MIN : (int32_t)q10;
}

static double gaussian(const struct press *press, double x, double y) {
  double dx = x - press->x_mm;
  double dy = y - press->y_mm;
  return press->p0_Pa * exp(-(dx * dx + dy * dy) / (2.0 * press->sigma_mm * press->sigma_mm));
}

static void read_press(const struct press *press, double noise_Pa, struct random *random) {
  for (int k = 0; k < SENSORS; k++) {
    double noise = noise_Pa > 0.0 ? noise_Pa * random_normal(random) : 0.0;
    readings[k] = to_q10(gaussian(press, (double)x_mm[k], (double)y_mm[k]) + noise);
  }
}

static double location_error_mm(const struct press *press) {
  return hypot((double)result.x_mm - press->x_mm, (double)result.y_mm - press->y_mm);
}

static double force_of(const struct press *press) {
  return 6.283185307179586 * press->p0_Pa * press->sigma_mm * press->sigma_mm * 1e-6;
}

static struct press random_press(struct random *random, double reach_mm) {
  return (struct press){random_between(random, -9.0 - reach_mm, 9.0 + reach_mm),
                        random_between(random, -18.0 - reach_mm, 18.0 + reach_mm),
                        exp(random_between(random, log(500.0), log(100000.0))),
                        random_between(random, 4.0, 12.0)};
}

static void assert_finite_and_defined(void) {
  const float values[] = {result.x_mm,           result.y_mm,       result.p0_Pa,
                          result.sigma_mm,       result.force_N,    result.residual_rms_Pa,
                          result.location_sd_mm, result.force_sd_N, result.location_noise_mm,
                          result.sigma_x_mm,     result.sigma_y_mm, result.width_correlation};
  bool valid = result.flags & CONTACT_FLAG_FIT_VALID;
  for (size_t i = 0; i < sizeof values / sizeof values[0]; i++) {
    TEST_ASSERT_TRUE(isfinite(values[i]));
    TEST_ASSERT_TRUE(valid || values[i] == 0.0f);
  }
  const uint32_t known = CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_UNCERTAINTY_VALID |
                         CONTACT_FLAG_LOW_SIGNAL | CONTACT_FLAG_FLAT | CONTACT_FLAG_UNCERTAIN |
                         CONTACT_FLAG_MODEL | CONTACT_FLAG_AT_BOUND | CONTACT_FLAG_SENSOR_MASKED |
                         CONTACT_FLAG_WIDTHS_VALID | CONTACT_FLAG_ELONGATED;
  TEST_ASSERT_EQUAL_HEX32(0, result.flags & ~known);
  TEST_ASSERT_EQUAL((result.flags & CONTACT_FLAG_WIDTHS_VALID) != 0, result.sigma_x_mm > 0.0f);
  TEST_ASSERT_EQUAL(result.sigma_x_mm > 0.0f, result.sigma_y_mm > 0.0f);
  TEST_ASSERT_TRUE(fabsf(result.width_correlation) <= 1.0f);
  TEST_ASSERT_EQUAL(valid, (result.flags & CONTACT_FLAG_UNCERTAINTY_VALID) != 0);
  TEST_ASSERT_TRUE(valid || result.used == 0);
  if (valid) {
    TEST_ASSERT_TRUE(result.p0_Pa > 0.0f && result.sigma_mm > 0.0f && result.force_N > 0.0f);
    TEST_ASSERT_TRUE(result.residual_rms_Pa >= 0.0f);
    TEST_ASSERT_TRUE(result.location_sd_mm >= 0.0f && result.force_sd_N >= 0.0f);
    TEST_ASSERT_TRUE(result.location_noise_mm >= 0.0f);
    TEST_ASSERT_TRUE(!(result.flags & CONTACT_FLAG_UNCERTAIN) ==
                     (result.location_sd_mm <= FIT_LOCATION_SD_LIMIT_mm));
  }
}

static void test_an_array_far_from_the_origin_is_none_for_the_grid(void) {
  static const struct press press = {3.1, -5.2, 4000.0, 7.0};
  static const float offsets_mm[] = {900.0f, 1100.0f, 2100.0f, -9900.0f};
  read_press(&press, 0.0, NULL);
  for (size_t i = 0; i < 4; i++) {
    struct fit_array far;
    float y[SENSORS];
    for (int k = 0; k < SENSORS; k++) {
      y[k] = y_mm[k] + offsets_mm[i];
    }
    TEST_ASSERT_EQUAL_INT(i == 0 ? FT_OK : FT_ERR_ARGUMENT,
                          fit_array_init_grid(&far, SENSORS, x_mm, y, PITCH_mm));
    TEST_ASSERT_EQUAL_INT(FT_OK, fit_array_init(&far, SENSORS, x_mm, y, PITCH_mm));
    fit_gaussian(&far, readings, ALL, &usual, &result);
    TEST_ASSERT_TRUE(result.flags & CONTACT_FLAG_FIT_VALID);
    TEST_ASSERT_FLOAT_WITHIN(0.02f, 3.1f, result.x_mm);
    TEST_ASSERT_FLOAT_WITHIN(0.02f, -5.2f, result.y_mm - offsets_mm[i]);
  }
}

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
  struct press fitted = {(double)result.x_mm, (double)result.y_mm, (double)result.p0_Pa,
                         (double)result.sigma_mm};
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

static void test_order_and_rotation_of_the_sensors(void) {
  struct random random = {74};
  for (int i = 0; i < 500; i++) {
    struct press press = random_press(&random, 0.0);
    read_press(&press, 0.0, NULL);
    fit_gaussian(&array, readings, ALL, &patient, &result);
    struct fit_result plain = result;
    double angle = random_between(&random, 0.0, 6.28);
    float turned_x[SENSORS], turned_y[SENSORS];
    int32_t turned[SENSORS];
    int order[SENSORS];
    for (int k = 0; k < SENSORS; k++) {
      order[k] = k;
    }
    for (uint32_t k = SENSORS - 1; k > 0; k--) {
      uint32_t other = random_below(&random, k + 1);
      int held = order[k];
      order[k] = order[other];
      order[other] = held;
    }
    for (int k = 0; k < SENSORS; k++) {
      double x = (double)x_mm[order[k]];
      double y = (double)y_mm[order[k]];
      turned_x[k] = (float)(cos(angle) * x - sin(angle) * y);
      turned_y[k] = (float)(sin(angle) * x + cos(angle) * y);
      turned[k] = readings[order[k]];
    }
    struct fit_array turned_array;
    TEST_ASSERT_EQUAL_INT(FT_OK,
                          fit_array_init(&turned_array, SENSORS, turned_x, turned_y, PITCH_mm));
    fit_gaussian(&turned_array, turned, ALL, &patient, &result);
    double back_x = cos(angle) * (double)result.x_mm + sin(angle) * (double)result.y_mm;
    double back_y = -sin(angle) * (double)result.x_mm + cos(angle) * (double)result.y_mm;
    TEST_ASSERT_FLOAT_WITHIN(1e-3f, plain.x_mm, (float)back_x);
    TEST_ASSERT_FLOAT_WITHIN(1e-3f, plain.y_mm, (float)back_y);
    TEST_ASSERT_FLOAT_WITHIN(1e-3f, plain.sigma_mm, result.sigma_mm);
  }
}

/* Every way to lose one, two or three sensors: recovered, or called uncertain. What the lost
 * sensors read must not matter. */
static void test_every_mask_of_up_to_three_sensors(void) {
  struct random random = {75};
  int uncertain = 0;
  int masks = 0;
  for (uint32_t lost = 1; lost <= ALL; lost++) {
    int bits = __builtin_popcount(lost);
    if (bits > 3) {
      continue;
    }
    struct press press = {random_between(&random, -9.0, 9.0), random_between(&random, -18.0, 18.0),
                          5000.0, random_between(&random, 5.0, 8.0)};
    read_press(&press, 0.0, NULL);
    for (int k = 0; k < SENSORS; k++) {
      readings[k] = lost >> k & 1u ? (int32_t)random_u32(&random) : readings[k];
    }
    fit_gaussian(&array, readings, ALL & ~lost, &patient, &result);
    TEST_ASSERT_EQUAL_HEX32(ALL & ~lost, result.used);
    TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_SENSOR_MASKED, result.flags);
    masks++;
    if (result.flags & CONTACT_FLAG_UNCERTAIN) {
      uncertain++;
    } else {
      TEST_ASSERT_TRUE(location_error_mm(&press) < 0.02);
    }
  }
  TEST_ASSERT_EQUAL_INT(15 + 105 + 455, masks);
  say("masks that left the location uncertain:", uncertain);
  TEST_ASSERT_LESS_THAN_INT(6, uncertain);
}

static void test_fewer_than_four_sensors(void) {
  struct press press = {0.0, 0.0, 5000.0, 6.0};
  read_press(&press, 0.0, NULL);
  for (uint32_t used = 0; used <= ALL; used++) {
    fit_gaussian(&array, readings, used, &usual, &result);
    assert_finite_and_defined();
    TEST_ASSERT_EQUAL(__builtin_popcount(used) >= 4, (result.flags & CONTACT_FLAG_FIT_VALID) != 0);
    TEST_ASSERT_EQUAL(used != ALL, (result.flags & CONTACT_FLAG_SENSOR_MASKED) != 0);
  }
  /* Bits beyond the array are no sensors. */
  fit_gaussian(&array, readings, UINT32_MAX, &usual, &result);
  TEST_ASSERT_EQUAL_HEX32(ALL, result.used);
}

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
    TEST_ASSERT_NOT_EQUAL_UINT32(0,
                                 result.flags & (CONTACT_FLAG_UNCERTAIN | CONTACT_FLAG_AT_BOUND));
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
        readings[k] = to_q10((1.0 + sd * random_normal(&random)) *
                             gaussian(&press, (double)x_mm[k], (double)y_mm[k]));
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
    TEST_ASSERT_FLOAT_WITHIN(i % 2 ? 0.1f : 0.005f, (float)(xy / sqrt(xx * yy)),
                             result.width_correlation);
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
    readings[k] = to_q10(gaussian(&one, (double)x_mm[k], (double)y_mm[k]) +
                         gaussian(&other, (double)x_mm[k], (double)y_mm[k]));
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
      double moved_mm =
          hypot((double)(result.x_mm - before.x_mm), (double)(result.y_mm - before.y_mm));
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
static void shares(double sigma_low_mm, double sigma_high_mm, double outside_mm, bool corner,
                   uint64_t seed, double *unflagged, double *warned) {
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
    bool doubtful =
        result.flags & (CONTACT_FLAG_UNCERTAIN | CONTACT_FLAG_AT_BOUND | CONTACT_FLAG_LOW_SIGNAL |
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
    shares(cases[i].sigma_low_mm, cases[i].sigma_high_mm, cases[i].outside_mm, cases[i].corner,
           80 + i, &unflagged, &warned);
    char text[140];
    snprintf(text, sizeof text, "%s: beyond 1 mm unflagged %.4f, with a warning %.3f",
             cases[i].name, unflagged, warned);
    TEST_MESSAGE(text);
    TEST_ASSERT_TRUE_MESSAGE(unflagged <= cases[i].most_unflagged, cases[i].name);
    TEST_ASSERT_TRUE_MESSAGE(warned <= cases[i].most_warned, cases[i].name);
  }
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
    const struct fit_settings settings = {.iterations = 7,
                                          .noise_Pa_q10 = to_q10(cases[i].noise_Pa)};
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
    double radial = sqrt((square_x + square_y) / FITS -
                         (sum_x * sum_x + sum_y * sum_y) / ((double)FITS * FITS));
    double force = sqrt(square_f / FITS - sum_f * sum_f / ((double)FITS * FITS));
    char text[140];
    snprintf(text, sizeof text,
             "predicted over actual scatter: location %.3f, force %.3f (%.2g mm, %.2g N)",
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
    masked.flags = result.flags =
        (masked.flags ^ result.flags) & ~(uint32_t)CONTACT_FLAG_SENSOR_MASKED;
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

static void test_any_layout(void) {
  struct random random = {92};
  for (int i = 0; i < 20000; i++) {
    uint8_t count = (uint8_t)(1 + random_below(&random, 32));
    float x[FT_MAX_SENSORS], y[FT_MAX_SENSORS];
    double span = exp(random_between(&random, log(1e-3), log(1e3)));
    for (int k = 0; k < count; k++) {
      x[k] = (float)random_between(&random, -span, span);
      y[k] = i % 5 == 0 ? 0.0f : (float)random_between(&random, -span, span);
      readings[k] = (int32_t)random_u32(&random) >> random_below(&random, 32);
    }
    struct fit_array layout;
    TEST_ASSERT_EQUAL_INT(
        FT_OK, fit_array_init(&layout, count, x, y, (float)random_between(&random, 1.0, 20.0)));
    fit_gaussian(&layout, readings, UINT32_MAX, &usual, &result);
    assert_finite_and_defined();
  }
}

static void test_duplicate_positions(void) {
  struct press press = {1.0, 2.0, 5000.0, 6.0};
  float x[SENSORS], y[SENSORS];
  for (int k = 0; k < SENSORS; k++) {
    x[k] = y[k] = 0.0f;
    readings[k] = to_q10(gaussian(&press, 0.0, 0.0));
  }
  struct fit_array point;
  TEST_ASSERT_EQUAL_INT(FT_OK, fit_array_init(&point, SENSORS, x, y, PITCH_mm));
  fit_gaussian(&point, readings, ALL, &usual, &result);
  assert_finite_and_defined();
  TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_UNCERTAIN, result.flags);
  /* A doubled sensor among good ones only weighs twice. */
  for (int k = 0; k < SENSORS; k++) {
    x[k] = x_mm[k == 14 ? 7 : k];
    y[k] = y_mm[k == 14 ? 7 : k];
    readings[k] = to_q10(gaussian(&press, (double)x[k], (double)y[k]));
  }
  struct fit_array doubled;
  TEST_ASSERT_EQUAL_INT(FT_OK, fit_array_init(&doubled, SENSORS, x, y, PITCH_mm));
  fit_gaussian(&doubled, readings, ALL, &patient, &result);
  TEST_ASSERT_TRUE(location_error_mm(&press) < 1e-3);
  TEST_ASSERT_BITS_LOW(CONTACT_FLAG_UNCERTAIN, result.flags);
}

/* Six sensors, 6 mm apart, on a line at any angle: the location is found along it, and its scatter
 * is the predicted one. */
static void test_sensors_on_a_line(void) {
  enum { COUNT = 6, FITS = 2000 };
  struct random random = {94};
  const double angles[] = {0.0, 1.5707963267948966, 0.5, 2.4};
  for (size_t a = 0; a < sizeof angles / sizeof *angles; a++) {
    const double along_x = cos(angles[a]), along_y = sin(angles[a]);
    const double origin_x = 3.0, origin_y = -7.0;
    float x[COUNT], y[COUNT];
    for (int k = 0; k < COUNT; k++) {
      x[k] = (float)(origin_x + 6.0 * k * along_x);
      y[k] = (float)(origin_y + 6.0 * k * along_y);
    }
    struct fit_array line;
    TEST_ASSERT_EQUAL_INT(FT_OK, fit_array_init(&line, COUNT, x, y, 6.0f));
    double squares = 0.0, predicted = 0.0;
    for (int i = 0; i < FITS; i++) {
      const double noise_Pa = i == 0 ? 0.0 : 5.0;
      const double at = random_between(&random, 6.0, 24.0);
      const struct press press = {origin_x + at * along_x, origin_y + at * along_y, 5000.0,
                                  random_between(&random, 3.0, 6.0)};
      for (int k = 0; k < COUNT; k++) {
        readings[k] = to_q10(gaussian(&press, (double)x[k], (double)y[k]) +
                             noise_Pa * random_normal(&random));
      }
      const struct fit_settings settings = {.iterations = 12, .noise_Pa_q10 = NOISE_5_Pa};
      fit_gaussian(&line, readings, UINT32_MAX, &settings, &result);
      TEST_ASSERT_EQUAL_HEX32(GOOD_FIT, result.flags);
      const double dx = (double)result.x_mm - press.x_mm, dy = (double)result.y_mm - press.y_mm;
      const double along = dx * along_x + dy * along_y;
      TEST_ASSERT_TRUE(fabs(dy * along_x - dx * along_y) < 1e-4);
      if (i == 0) {
        TEST_ASSERT_TRUE(fabs(along) < 1e-3);
        TEST_ASSERT_DOUBLE_WITHIN(1e-4, 1.0, (double)result.force_N / force_of(&press));
      }
      squares += along * along;
      predicted += (double)result.location_sd_mm * (double)result.location_sd_mm;
    }
    /* The prediction takes the larger of noise and residual, hence the wide upper limit. */
    TEST_ASSERT_TRUE(predicted > 0.9 * squares && predicted < 2.0 * squares);
    fit_gaussian(&line, readings, 0x7, &usual, &result);
    TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_FIT_VALID, result.flags);
    fit_gaussian(&line, readings, 0x3, &usual, &result);
    TEST_ASSERT_BITS_LOW(CONTACT_FLAG_FIT_VALID, result.flags);
  }
}

/* Narrow contacts up to 6 mm outside the array: where they are missed, it is not for a limit of p0,
 * which is 10^6 of the largest reading and a hundred times what any of them asks for. */
static void test_narrow_contacts_outside_are_not_held_back_by_p0(void) {
  struct random random = {95};
  double steepest = 0.0;
  int missed = 0, held_back = 0, unflagged = 0, count = 0;
  while (count < 20000) {
    const struct press press = {random_between(&random, -15.0, 15.0),
                                random_between(&random, -24.0, 24.0), 50000.0,
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
  RUN_TEST(test_an_array_far_from_the_origin_is_none_for_the_grid);
  RUN_TEST(test_without_noise_there_is_no_fit);
  RUN_TEST(test_noise_free_presses_are_recovered);
  RUN_TEST(test_residual_is_that_of_the_readings);
  RUN_TEST(test_scale_invariance);
  RUN_TEST(test_order_and_rotation_of_the_sensors);
  RUN_TEST(test_every_mask_of_up_to_three_sensors);
  RUN_TEST(test_fewer_than_four_sensors);
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
  RUN_TEST(test_predicted_scatter);
  RUN_TEST(test_n_largest);
  RUN_TEST(test_random_bits);
  RUN_TEST(test_any_layout);
  RUN_TEST(test_duplicate_positions);
  RUN_TEST(test_sensors_on_a_line);
  RUN_TEST(test_narrow_contacts_outside_are_not_held_back_by_p0);
  RUN_TEST(test_quadrature);
  RUN_TEST(test_repeated_fits_give_the_same_bits);
  return UNITY_END();
}
