#include "fit_bench.h"

#include <math.h>

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
    TEST_ASSERT_EQUAL_INT(i == 0 ? FT_OK : FT_ERR_ARGUMENT, fit_array_init_grid(&far, SENSORS, x_mm, y, PITCH_mm));
    TEST_ASSERT_EQUAL_INT(FT_OK, fit_array_init(&far, SENSORS, x_mm, y, PITCH_mm));
    fit_gaussian(&far, readings, ALL, &usual, &result);
    TEST_ASSERT_TRUE(result.flags & CONTACT_FLAG_FIT_VALID);
    TEST_ASSERT_FLOAT_WITHIN(0.02f, 3.1f, result.x_mm);
    TEST_ASSERT_FLOAT_WITHIN(0.02f, -5.2f, result.y_mm - offsets_mm[i]);
  }
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
    TEST_ASSERT_EQUAL_INT(FT_OK, fit_array_init(&turned_array, SENSORS, turned_x, turned_y, PITCH_mm));
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
    struct press press = {random_between(&random, -9.0, 9.0), random_between(&random, -18.0, 18.0), 5000.0,
                          random_between(&random, 5.0, 8.0)};
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
    TEST_ASSERT_EQUAL_INT(FT_OK, fit_array_init(&layout, count, x, y, (float)random_between(&random, 1.0, 20.0)));
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
        readings[k] = to_q10(gaussian(&press, (double)x[k], (double)y[k]) + noise_Pa * random_normal(&random));
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

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(test_an_array_far_from_the_origin_is_none_for_the_grid);
  RUN_TEST(test_order_and_rotation_of_the_sensors);
  RUN_TEST(test_every_mask_of_up_to_three_sensors);
  RUN_TEST(test_fewer_than_four_sensors);
  RUN_TEST(test_any_layout);
  RUN_TEST(test_duplicate_positions);
  RUN_TEST(test_sensors_on_a_line);
  return UNITY_END();
}
