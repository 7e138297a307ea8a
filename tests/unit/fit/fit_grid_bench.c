#include "fit_grid_bench.h"

#include <unity.h>

float x_mm[SENSORS], y_mm[SENSORS];
struct fit_array array;
int32_t readings[SENSORS];
const struct fit_settings usual = {.iterations = 7, .noise_Pa_q10 = 5120};

void setUp(void) {
  for (int k = 0; k < SENSORS; k++) {
    x_mm[k] = PITCH_mm * ((float)(k % COLUMNS) - 0.5f * (COLUMNS - 1)) + 1.5f;
    y_mm[k] = PITCH_mm * (0.5f * (ROWS - 1) - (float)(k / COLUMNS)) - 0.25f;
  }
  TEST_ASSERT_EQUAL(FT_OK, fit_array_init(&array, SENSORS, x_mm, y_mm, PITCH_mm));
}

void tearDown(void) {}
