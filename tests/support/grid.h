/* The array of the boards, for tests of the fit: three strips of five, 9 mm apart. */
#pragma once

#include "fit/fit.h"
#include "unity.h"

#define GRID_SENSORS 15

static inline void make_grid_of_15(struct fit_array *array) {
  float x_mm[GRID_SENSORS], y_mm[GRID_SENSORS];
  for (int k = 0; k < GRID_SENSORS; k++) {
    x_mm[k] = 9.0f * (float)(k / 5 - 1);
    y_mm[k] = 9.0f * (float)(k % 5 - 2);
  }
  TEST_ASSERT_EQUAL(FT_OK, fit_array_init(array, GRID_SENSORS, x_mm, y_mm, 9.0f));
}
