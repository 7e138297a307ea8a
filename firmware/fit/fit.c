#include "fit/fit.h"

#include "fit/fit_grid_solve.h"
#include "fit/fit_limits.h"

#include <stdbool.h>

/* The faster kernel, or that for missing sensors. Returns whether the residuals suggest an outlier. */
FIXED_INLINE bool fit_rectangle(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable,
                                const struct fit_settings *settings, struct fit_result *result) {
  if (usable == first_sensors(array->sensor_count) && !fit_jacobian_needs_dip(array, settings)) {
    return fit_grid(array, pressure_Pa_q10, settings, result);
  }
  return fit_grid_masked(array, pressure_Pa_q10, usable, settings, result);
}

/* Fits once more without the outlier, if there is one. */
static void leave_outlier_out(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable,
                              const struct fit_settings *settings, struct fit_result *refit, struct fit_result *result) {
  int outlier = fit_grid_outlier(array, pressure_Pa_q10, usable, settings, result);
  if (outlier < 0) {
    return;
  }
  usable &= ~sensor_bit((unsigned)outlier);
  bool rough = fit_grid_masked(array, pressure_Pa_q10, usable, settings, refit);
  if (fit_is_better_without(settings, result, refit, rough, array->pitch_mm)) {
    *result = *refit;
  }
}

static bool has_grown(const struct fit_outlier_state *outliers, const struct fit_result *result) {
  return outliers->frames < FIT_OUTLIER_FRAMES - FIT_OUTLIER_RETRY_FRAMES &&
         2.0f * result->residual_rms_Pa * outliers->force_N > 3.0f * outliers->residual_rms_Pa * result->force_N;
}

void fit_gaussian_grid_update(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable,
                              const struct fit_settings *settings, struct fit_outlier_state *outliers, struct fit_result *result) {
  if (settings->noise_Pa_q10 < 1) {
    *result = (struct fit_result){0};
    return;
  }
  usable &= first_sensors(array->sensor_count);
  if (outliers->usable != usable) {
    outliers->usable = usable;
    outliers->frames = 0;
  }
  const sensor_map outlier = outliers->frames > 0 ? outliers->outlier : 0;
  const bool rough = fit_rectangle(array, pressure_Pa_q10, usable & ~outlier, settings, result);
  if (outliers->frames > 0) {
    outliers->frames--;
    if (!rough || !has_grown(outliers, result)) {
      return;
    }
    if (outlier) { /* the next frame takes all sensors */
      outliers->frames = 0;
      return;
    }
  }
  if (rough) {
    leave_outlier_out(array, pressure_Pa_q10, usable, settings, &outliers->refit, result);
    outliers->outlier = usable & ~result->used;
    outliers->frames = FIT_OUTLIER_FRAMES;
    outliers->residual_rms_Pa = result->residual_rms_Pa;
    outliers->force_N = result->force_N;
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
  struct fit_outlier_state none;
  none.usable = none.frames = 0;
  fit_gaussian_grid_update(array, pressure_Pa_q10, usable, settings, &none, result);
}

void fit_gaussian_update(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable,
                         const struct fit_settings *settings, struct fit_outlier_state *outliers, struct fit_result *result) {
  if (fit_is_rectangle(array) || settings->noise_Pa_q10 < 1) {
    fit_gaussian_grid_update(array, pressure_Pa_q10, usable, settings, outliers, result);
  } else {
    fit_general(array, pressure_Pa_q10, usable & first_sensors(array->sensor_count), settings, result);
  }
}

void fit_gaussian(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable, const struct fit_settings *settings,
                  struct fit_result *result) {
  struct fit_outlier_state none;
  none.usable = none.frames = 0;
  fit_gaussian_update(array, pressure_Pa_q10, usable, settings, &none, result);
}
