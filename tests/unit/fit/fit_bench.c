#include "fit_bench.h"

#include <string.h>

const float x_mm[SENSORS] = {-9, -9, -9, -9, -9, 0, 0, 0, 0, 0, 9, 9, 9, 9, 9};
const float y_mm[SENSORS] = {-18, -9, 0, 9, 18, -18, -9, 0, 9, 18, -18, -9, 0, 9, 18};

struct fit_array array;
struct fit_result result;
int32_t readings[FT_MAX_SENSORS];
const struct fit_settings usual = {.iterations = 7, .noise_Pa_q10 = NOISE_5_Pa};
const struct fit_settings patient = {.iterations = 20, .noise_Pa_q10 = 1};

void setUp(void) {
  TEST_ASSERT_EQUAL_INT(FT_OK, fit_array_init(&array, SENSORS, x_mm, y_mm, PITCH_mm));
  memset(readings, 0, sizeof readings);
}

int32_t to_q10(double pressure_Pa) {
  double q10 = nearbyint(pressure_Pa * 1024.0);
  return q10 > INT32_MAX ? INT32_MAX : q10 < INT32_MIN ? INT32_MIN : (int32_t)q10;
}

double gaussian(const struct press *press, double x, double y) {
  double dx = x - press->x_mm;
  double dy = y - press->y_mm;
  return press->p0_Pa * exp(-(dx * dx + dy * dy) / (2.0 * press->sigma_mm * press->sigma_mm));
}

void read_press(const struct press *press, double noise_Pa, struct random *random) {
  for (int k = 0; k < SENSORS; k++) {
    double noise = noise_Pa > 0.0 ? noise_Pa * random_normal(random) : 0.0;
    readings[k] = to_q10(gaussian(press, (double)x_mm[k], (double)y_mm[k]) + noise);
  }
}

double location_error_mm(const struct press *press) { return hypot((double)result.x_mm - press->x_mm, (double)result.y_mm - press->y_mm); }

double force_of(const struct press *press) { return 6.283185307179586 * press->p0_Pa * press->sigma_mm * press->sigma_mm * 1e-6; }

struct press random_press(struct random *random, double reach_mm) {
  return (struct press){random_between(random, -9.0 - reach_mm, 9.0 + reach_mm), random_between(random, -18.0 - reach_mm, 18.0 + reach_mm),
                        exp(random_between(random, log(500.0), log(100000.0))), random_between(random, 4.0, 12.0)};
}

void assert_finite_and_defined(void) {
  const float values[] = {result.x_mm,           result.y_mm,       result.p0_Pa,
                          result.sigma_mm,       result.force_N,    result.residual_rms_Pa,
                          result.location_sd_mm, result.force_sd_N, result.location_noise_mm,
                          result.sigma_x_mm,     result.sigma_y_mm, result.width_correlation};
  bool valid = result.flags & CONTACT_FLAG_FIT_VALID;
  for (size_t i = 0; i < sizeof values / sizeof values[0]; i++) {
    TEST_ASSERT_TRUE(isfinite(values[i]));
    TEST_ASSERT_TRUE(valid || values[i] == 0.0f);
  }
  const uint32_t known = CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_UNCERTAINTY_VALID | CONTACT_FLAG_LOW_SIGNAL | CONTACT_FLAG_FLAT |
                         CONTACT_FLAG_UNCERTAIN | CONTACT_FLAG_MODEL | CONTACT_FLAG_AT_BOUND | CONTACT_FLAG_SENSOR_MASKED |
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
    TEST_ASSERT_TRUE(!(result.flags & CONTACT_FLAG_UNCERTAIN) == (result.location_sd_mm <= FIT_LOCATION_SD_LIMIT_mm));
  }
}
