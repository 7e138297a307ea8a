#include "app/location_stage.h"

#include "common/contact_flags.h"
#include "config/defaults.h"
#include "config/geometry.h"
#include "port/port.h"

#include <math.h>
#include <string.h>

/* Interval from which on each frame has time for its own search for an outlier, us: the search takes up to 1 ms. */
#define OUTLIER_EACH_FRAME_us 2000u
/* Change of the force scale with the air pressure, per kPa: on one of two cast pads the response to one weight doubled
 * over 172 kPa, on the other it did not change (the arrays of host_tools/report/real). */
#define FORCE_SHARE_PER_kPa 0.0054f

#if FT_WITH_FIT_GENERAL
#define INIT_ARRAY fit_array_init
#define FIT fit_gaussian_update
#elif FT_WITH_OUTLIERS
#define INIT_ARRAY fit_array_init_grid
#define FIT fit_gaussian_grid_update
#elif FT_WITH_FULL_GRID
#define INIT_ARRAY fit_array_init_grid
#define FIT(array, pressure, usable, settings, outliers, result) fit_gaussian_grid_plain(array, pressure, usable, settings, result)
#else
#define INIT_ARRAY fit_array_init_grid
#define FIT(array, pressure, usable, settings, outliers, result) fit_gaussian_grid_small(array, pressure, usable, settings, result)
#endif

void location_stage_start(struct location_stage *stage) {
  if (INIT_ARRAY(&stage->array, geometry.sensor_count, geometry.x_mm, geometry.y_mm, geometry.pitch_mm) != FT_OK) {
    port_panic();
  }
  stage->settings.iterations = DEFAULT_FIT_ITERATIONS;
  stage->prior_sigma_mm = DEFAULT_PRIOR_SIGMA_mm;
  stage->prior_sd_mm = DEFAULT_PRIOR_WIDTH_mm;
  fit_set_errors(&stage->settings, DEFAULT_GAIN_SD, DEFAULT_MODEL_SD);
  stage->settings.location_sd_limit_mm = DEFAULT_LOCATION_LIMIT_mm;
}

void location_stage_process(struct location_stage *stage, const int32_t *hysteresis_sd_Pa_q10, struct findings *found) {
  const uint32_t t_us = (uint32_t)found->frame.t_us;
  if (!found->conditioned.contact || t_us - stage->frame_us >= OUTLIER_EACH_FRAME_us) {
    memset(&stage->outliers, 0, sizeof stage->outliers);
  }
  stage->frame_us = t_us;
  if (found->conditioned.contact) {
    stage->settings.noise_Pa_q10 = found->frame.noise_Pa_q10;
    memcpy(stage->settings.hysteresis_sd_Pa_q10, hysteresis_sd_Pa_q10, sizeof stage->settings.hysteresis_sd_Pa_q10);
    FIT(&stage->array, found->conditioned.pressure_Pa_q10, found->conditioned.usable, &stage->settings, &stage->outliers, &found->fit);
    stage->failures += !(found->fit.flags & CONTACT_FLAG_FIT_VALID);
  } else {
    memset(&found->fit, 0, sizeof found->fit);
  }
}

void location_stage_set_force(const struct contact_settings *contact, struct findings *found) {
  const float peak_Pa = (1.0f / 1024.0f) * (float)found->conditioned.peak_Pa_q10;
  found->force = contact_scale_force(contact, &found->fit, found->frame.saturated ? INFINITY : peak_Pa);
}

void location_stage_fill(const struct findings *found, struct wire_contact *packet) {
  packet->sensors_used = found->fit.used;
  packet->x_mm = found->fit.x_mm;
  packet->y_mm = found->fit.y_mm;
  packet->p0_Pa = found->fit.p0_Pa;
  packet->sigma_mm = found->fit.sigma_mm;
  packet->force_N = found->force.force_N;
  packet->residual_rms_Pa = found->fit.residual_rms_Pa;
  packet->location_sd_mm = found->fit.location_sd_mm;
  packet->force_sd_N = found->force.force_sd_N;
  packet->sigma_x_mm = found->fit.sigma_x_mm;
  packet->sigma_y_mm = found->fit.sigma_y_mm;
  packet->width_correlation = found->fit.width_correlation;
}

static float millimetres(uint16_t length_um) { return 1e-3f * (float)length_um; }

/* The prior that is set, or else the calibration's, and the calibration's dip. */
static void set_shape(struct location_stage *stage) {
  struct fit_settings *settings = &stage->settings;
  const bool is_set = stage->prior_sd_mm > 0.0f;
  const struct calibration *calibration = DEFAULT_USES_SHAPE ? stage->calibration : NULL;
  const bool has_prior = calibration && !stage->has_profile;
  settings->prior_sigma_mm = is_set ? stage->prior_sigma_mm : has_prior ? millimetres(calibration->sigma_um) : 0.0f;
  settings->prior_width_mm = is_set ? stage->prior_sd_mm : has_prior ? millimetres(calibration->sigma_sd_um) : 0.0f;
  settings->dip_share = calibration ? (1.0f / 65536.0f) * (float)calibration->dip_share_q16 : 0.0f;
  settings->dip_sd_mm = calibration ? millimetres(calibration->dip_sd_um) : 0.0f;
  settings->clip_below_sds = stage->has_profile ? 0 : DEFAULT_CLIP_BELOW_SDS;
}

enum ft_status location_stage_set_prior(struct location_stage *stage, float sigma_mm, float sd_mm) {
  const bool none = sigma_mm == 0.0f && sd_mm == 0.0f;
  const bool possible = sigma_mm >= WIRE_PRIOR_SIGMA_MIN_mm && sigma_mm <= WIRE_PRIOR_SIGMA_MAX_mm && sd_mm >= WIRE_PRIOR_WIDTH_MIN_mm &&
                        sd_mm <= WIRE_PRIOR_WIDTH_MAX_mm;
  if (!none && !possible) {
    return FT_ERR_ARGUMENT;
  }
  stage->prior_sigma_mm = sigma_mm;
  stage->prior_sd_mm = sd_mm;
  set_shape(stage);
  return FT_OK;
}

enum ft_status location_stage_set_limit(struct location_stage *stage, float limit_mm) {
  if (!(limit_mm >= WIRE_LOCATION_LIMIT_MIN_mm && limit_mm <= WIRE_LOCATION_LIMIT_MAX_mm)) {
    return FT_ERR_ARGUMENT;
  }
  stage->settings.location_sd_limit_mm = limit_mm;
  return FT_OK;
}

static int32_t q15_pitches(int16_t length_um) {
  const float q15 = 32.768f / geometry.pitch_mm * (float)length_um;
  return q15 > 32767.0f ? 32767 : q15 < -32767.0f ? -32767 : (int32_t)q15;
}

void location_stage_use_calibration(struct location_stage *stage, const struct calibration *calibration) {
  stage->calibration = calibration;
  for (unsigned k = 0; k < geometry.sensor_count; k++) {
    const struct sensor_calibration *sensor = calibration ? &calibration->sensors[k] : NULL;
    if (sensor) {
      stage->deviations[k] = (struct fit_deviation){q15_pitches(sensor->off_x_um), q15_pitches(sensor->off_y_um), sensor->wider_q15};
    }
    stage->settings.gain_sd_q16[k] = (uint16_t)((sensor ? sensor->gain_sd : DEFAULT_GAIN_SD) * 65536.0f + 0.5f);
  }
  stage->settings.deviations = DEFAULT_USES_SHAPE && calibration ? stage->deviations : NULL;
  set_shape(stage);
}

void location_stage_use_profile(struct location_stage *stage, bool has_profile) {
  stage->has_profile = has_profile;
  set_shape(stage);
}

/* Standard deviation that the air adds to the force scale. */
static float sd_by_air(const struct calibration *calibration, const struct condition *condition) {
  int32_t sum_Pa = 0, count = 0;
  for (unsigned k = 0; k < geometry.sensor_count; k++) {
    const int32_t zero_Pa = condition->zero_Pa_q10[k] >> 10;
    sum_Pa += zero_Pa;
    count += zero_Pa > 0;
  }
  if (count == 0) {
    return 0.0f;
  }
  const float off_kPa = 1e-3f * (float)sum_Pa / (float)count - (float)calibration->ambient_kPa;
  return calibration->force_scale * FORCE_SHARE_PER_kPa * off_kPa;
}

void location_stage_set_force_scale(const struct location_stage *stage, const struct condition *condition, bool tared,
                                    struct contact_settings *contact) {
  const struct calibration *calibration = stage->calibration;
  contact->force_scale = calibration ? calibration->force_scale : DEFAULT_FORCE_SCALE;
  float sd = calibration ? calibration->force_scale_sd : DEFAULT_FORCE_SCALE_SD;
  if (calibration && calibration->ambient_kPa > 0 && tared) {
    const float by_air = sd_by_air(calibration, condition);
    sd = sqrtf(sd * sd + by_air * by_air);
  }
  contact->force_scale_sd = sd;
}
