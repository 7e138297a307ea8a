#include "fit/fit.h"

#include "fit/fit_grid_solve.h"
#include "fit/fit_limits.h"

#include <stdbool.h>

/* The faster kernel, or that for missing sensors. Returns whether the residuals suggest an outlier. */
FIXED_INLINE bool fit_rectangle(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable,
                                const struct fit_settings *settings, struct fit_result *result) {
  if (usable == first_sensors(array->sensor_count) && !fit_steps_want_dip(array, settings)) {
    return fit_grid(array, pressure_Pa_q10, settings, result);
  }
  return fit_grid_masked(array, pressure_Pa_q10, usable, settings, result);
}

/* Fits once more without the outlier, if there is one. */
static void leave_outlier_out(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable,
                              const struct fit_settings *settings, struct fit_result *without, struct fit_result *result) {
  int outlier = fit_grid_outlier(array, pressure_Pa_q10, usable, settings, result);
  if (outlier < 0) {
    return;
  }
  usable &= ~sensor_bit((unsigned)outlier);
  bool rough = fit_grid_masked(array, pressure_Pa_q10, usable, settings, without);
  if (fit_outlier_gone(settings, result, without, rough, array->pitch_mm)) {
    *result = *without;
  }
}

static bool has_grown(const struct fit_watch *watch, const struct fit_result *result) {
  return watch->frames < FIT_WATCH_FRAMES - FIT_WATCH_LEAST &&
         2.0f * result->residual_rms_Pa * watch->force_N > 3.0f * watch->residual_rms_Pa * result->force_N;
}

void fit_gaussian_grid_follow(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable,
                              const struct fit_settings *settings, struct fit_watch *watch, struct fit_result *result) {
  if (settings->noise_Pa_q10 < 1) {
    *result = (struct fit_result){0};
    return;
  }
  usable &= first_sensors(array->sensor_count);
  if (watch->usable != usable) {
    watch->usable = usable;
    watch->frames = 0;
  }
  const sensor_map left_out = watch->frames > 0 ? watch->left_out : 0;
  const bool rough = fit_rectangle(array, pressure_Pa_q10, usable & ~left_out, settings, result);
  if (watch->frames > 0) {
    watch->frames--;
    if (!rough || !has_grown(watch, result)) {
      return;
    }
    if (left_out) { /* the next frame takes all sensors */
      watch->frames = 0;
      return;
    }
  }
  if (rough) {
    leave_outlier_out(array, pressure_Pa_q10, usable, settings, &watch->without, result);
    watch->left_out = usable & ~result->used;
    watch->frames = FIT_WATCH_FRAMES;
    watch->residual_rms_Pa = result->residual_rms_Pa;
    watch->force_N = result->force_N;
  }
}

void fit_gaussian_grid_plain(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable,
                             const struct fit_settings *settings, struct fit_result *result) {
  if (settings->noise_Pa_q10 < 1) {
    *result = (struct fit_result){0};
    return;
  }
  fit_rectangle(array, pressure_Pa_q10, usable & first_sensors(array->sensor_count), settings, result);
}

void fit_gaussian_grid_small(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable,
                             const struct fit_settings *settings, struct fit_result *result) {
  if (settings->noise_Pa_q10 < 1) {
    *result = (struct fit_result){0};
    return;
  }
  fit_grid_masked(array, pressure_Pa_q10, usable & first_sensors(array->sensor_count), settings, result);
}

void fit_gaussian_grid(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable,
                       const struct fit_settings *settings, struct fit_result *result) {
  struct fit_watch none;
  none.usable = none.frames = 0;
  fit_gaussian_grid_follow(array, pressure_Pa_q10, usable, settings, &none, result);
}

void fit_gaussian_follow(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable,
                         const struct fit_settings *settings, struct fit_watch *watch, struct fit_result *result) {
  if (fit_is_rectangle(array) || settings->noise_Pa_q10 < 1) {
    fit_gaussian_grid_follow(array, pressure_Pa_q10, usable, settings, watch, result);
  } else {
    fit_general(array, pressure_Pa_q10, usable & first_sensors(array->sensor_count), settings, result);
  }
}

void fit_gaussian(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable, const struct fit_settings *settings,
                  struct fit_result *result) {
  struct fit_watch none;
  none.usable = none.frames = 0;
  fit_gaussian_follow(array, pressure_Pa_q10, usable, settings, &none, result);
}
