/* Frames that follow each other, of which not each searches for an outlier. */
#include "fit_bench.h"

#include <string.h>

static struct fit_outlier_state outliers;
static const struct press contact = {2.0, -5.0, 20000.0, 6.0};
static const uint32_t broken = UINT32_C(1) << 13;

/* Sensor 13 reads so much more. */
static void read_with(double offset_Pa) {
  static struct random noise = {31};
  read_press(&contact, 2.0, &noise);
  readings[13] += (int32_t)(offset_Pa * 1024.0);
}

static sensor_map used_of(sensor_map usable) {
  fit_gaussian_update(&array, readings, usable, &usual, &outliers, &result);
  return result.used;
}

/* Two contacts, which no sensor explains, with forces of that share. */
static void read_two(double share) {
  const struct press far = {-3.0, 12.0, 20000.0, 6.0};
  int32_t both[SENSORS];
  struct random none = {1};
  read_press(&contact, 0.0, &none);
  memcpy(both, readings, sizeof both);
  read_press(&far, 0.0, &none);
  for (int k = 0; k < SENSORS; k++) {
    readings[k] = both[k] + (int32_t)(share * readings[k]);
  }
}

TEST(what_is_broken_stays_left_out) {
  struct fit_result alone;
  memset(&outliers, 0, sizeof outliers);
  for (int frame = 0; frame <= FIT_OUTLIER_FRAMES; frame++) {
    read_with(8000.0);
    TEST_ASSERT_EQUAL_HEX32(ALL & ~broken, used_of(ALL));
    TEST_ASSERT_EQUAL(FIT_OUTLIER_FRAMES - frame, outliers.frames);
    fit_gaussian(&array, readings, ALL & ~broken, &usual, &alone);
    TEST_ASSERT_EQUAL_MEMORY(&alone, &result, sizeof alone);
    TEST_ASSERT_TRUE(location_error_mm(&contact) < 0.05);
  }
  read_with(8000.0); /* it is looked for again */
  TEST_ASSERT_EQUAL_HEX32(ALL & ~broken, used_of(ALL));
  TEST_ASSERT_EQUAL(FIT_OUTLIER_FRAMES, outliers.frames);
  int frames = 0;
  do {
    read_with(0.0); /* it works again */
    frames++;
  } while (used_of(ALL) != ALL);
  TEST_ASSERT_EQUAL(FIT_OUTLIER_FRAMES + 1, frames);
}

TEST(a_rough_fit_begins_no_search_in_each_frame) {
  memset(&outliers, 0, sizeof outliers);
  for (int frame = 0; frame <= FIT_OUTLIER_FRAMES; frame++) {
    read_two(1.0 + 0.001 * frame);
    TEST_ASSERT_EQUAL_HEX32(ALL, used_of(ALL));
    TEST_ASSERT_EQUAL(FIT_OUTLIER_FRAMES - frame, outliers.frames);
  }
  used_of(ALL);
  TEST_ASSERT_EQUAL(FIT_OUTLIER_FRAMES, outliers.frames);
}

TEST(a_sensor_that_breaks_after_a_search_is_soon_found) {
  memset(&outliers, 0, sizeof outliers);
  read_with(1500.0); /* rough, but no outlier that halves the residuals or stands alone */
  readings[3] += 1500 * 1024;
  used_of(ALL);
  TEST_ASSERT_EQUAL_HEX32(ALL, result.used);
  TEST_ASSERT_EQUAL(FIT_OUTLIER_FRAMES, outliers.frames);
  for (int frame = 0; frame <= FIT_OUTLIER_RETRY_FRAMES; frame++) {
    read_with(8000.0);
    TEST_ASSERT_EQUAL_HEX32(frame < FIT_OUTLIER_RETRY_FRAMES ? ALL : ALL & ~broken, used_of(ALL));
  }
}

/* And where another one is left out, one frame later. */
TEST(residuals_that_grow_end_what_was_found) {
  memset(&outliers, 0, sizeof outliers);
  read_with(8000.0);
  TEST_ASSERT_EQUAL_HEX32(ALL & ~broken, used_of(ALL));
  for (int frame = 0; frame <= FIT_OUTLIER_RETRY_FRAMES; frame++) {
    read_with(0.0);
    readings[3] += 8000 * 1024;
    used_of(ALL);
    TEST_ASSERT_EQUAL(frame < FIT_OUTLIER_RETRY_FRAMES ? FIT_OUTLIER_FRAMES - 1 - frame : 0, outliers.frames);
  }
  TEST_ASSERT_EQUAL_HEX32(ALL & ~(UINT32_C(1) << 3), used_of(ALL));
}

TEST(other_sensors_begin_a_search) {
  memset(&outliers, 0, sizeof outliers);
  read_with(8000.0);
  used_of(ALL);
  used_of(ALL);
  const uint32_t fewer = ALL & ~UINT32_C(1);
  TEST_ASSERT_EQUAL_HEX32(fewer & ~broken, used_of(fewer));
  TEST_ASSERT_EQUAL(FIT_OUTLIER_FRAMES, outliers.frames);
}
