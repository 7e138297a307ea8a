#include "app/acting.h"

#include "app/working.h"
#include "config/defaults.h"
#include "config/geometry.h"

#include <math.h>
#include <string.h>

#if FT_WITH_FIT
/* On one of two cast pads the response to one weight doubled over 172 kPa, on the other it stayed
 * (the arrays of host_tools/report/real). */
#define FORCE_SHARE_PER_kPa 0.0054f

static float millimetres(uint16_t length_um) {
  return 1e-3f * (float)length_um;
}

void app_use_shape(struct app *app) {
  struct fit_settings *settings = &app->fit_settings;
  bool is_set = app->set_sigma_sd_mm > 0.0f;
  bool profile = false;
#if FT_WITH_TANGENTIAL
  profile = app->pad != NULL;
#endif
  const struct calibration *found = DEFAULT_USES_SHAPE ? app->calibration : NULL;
  /* Beside a profile contacts may be of any width: its estimate tells a wide one from a pull. */
  const bool knows = found && !profile;
  settings->prior_sigma_mm = is_set ? app->set_sigma_mm : knows ? millimetres(found->sigma_um) : 0.0f;
  settings->prior_width_mm = is_set ? app->set_sigma_sd_mm : knows ? millimetres(found->sigma_sd_um) : 0.0f;
  settings->dip_share = found ? (1.0f / 65536.0f) * (float)found->dip_share_q16 : 0.0f;
  settings->dip_sd_mm = found ? millimetres(found->dip_sd_um) : 0.0f;
  settings->cut_noises = profile ? 0 : DEFAULT_CUT_NOISES;
}

#if FT_WITH_TANGENTIAL
static void use_tangential_scales(struct app *app) {
  if (app->pad) {
    tangential_use(&app->tangential_settings, app->pad, &app->contact_settings, app->calibration != NULL);
  }
}

void app_use_pad(struct app *app, const struct pad_profile *pad) {
  working_forget(app);
  bool acts = pad && fit_pad_init(&app->tangential_job.pad, &app->fit_array, pad) == FT_OK;
  app->shapes_act = acts && fit_shapes_init(&app->shapes_job.pad, &app->fit_array, pad) == FT_OK;
  app->pad = acts ? pad : NULL;
  app_use_shape(app);
  use_tangential_scales(app);
  tangential_reset(&app->tangential_history);
  motion_reset(&app->motion_history);
}
#endif

static int32_t q15_pitches(int16_t length_um) {
  const float q15 = 32.768f / geometry.pitch_mm * (float)length_um;
  return q15 > 32767.0f ? 32767 : q15 < -32767.0f ? -32767 : (int32_t)q15;
}

static void use_own(struct app *app, const struct calibration *calibration) {
  for (unsigned k = 0; calibration && k < geometry.sensor_count; k++) {
    const struct sensor_calibration *sensor = &calibration->sensors[k];
    app->own[k] = (struct fit_own){q15_pitches(sensor->off_x_um), q15_pitches(sensor->off_y_um), sensor->wider_q15};
  }
  app->fit_settings.own = DEFAULT_USES_SHAPE && calibration ? app->own : NULL;
}

void app_use_calibration(struct app *app, const struct calibration *calibration) {
#if FT_WITH_TANGENTIAL
  working_forget(app); /* what is asked points to what is written here */
#endif
  app->calibration = calibration;
  use_own(app, calibration);
  for (unsigned k = 0; k < geometry.sensor_count; k++) {
    float gain = calibration ? calibration->sensors[k].gain : 1.0f;
    float gain_sd = calibration ? calibration->sensors[k].gain_sd : DEFAULT_GAIN_SD;
    app->gains.inverse_q16[k] = (uint32_t)(65536.0f / gain + 0.5f);
    app->fit_settings.gain_sd_q16[k] = (uint16_t)(gain_sd * 65536.0f + 0.5f);
  }
#if FT_WITH_TANGENTIAL_DOUBT
  fit_gains_begin(&app->learnt_gains, DEFAULT_GAIN_SD);
#endif
  app_use_shape(app);
  app->contact_settings.force_scale = calibration ? calibration->force_scale : DEFAULT_FORCE_SCALE;
  app_use_air(app);
}

void app_use_air(struct app *app) {
  const struct calibration *calibration = app->calibration;
  float sd = calibration ? calibration->force_scale_sd : DEFAULT_FORCE_SCALE_SD;
  if (calibration && calibration->ambient_kPa > 0 && app->conditioned.tared) {
    int32_t sum_Pa = 0, count = 0;
    for (unsigned k = 0; k < geometry.sensor_count; k++) {
      int32_t zero_Pa = app->condition.zero_Pa_q10[k] >> 10;
      sum_Pa += zero_Pa;
      count += zero_Pa > 0;
    }
    if (count > 0) {
      float off_kPa = 1e-3f * (float)sum_Pa / (float)count - (float)calibration->ambient_kPa;
      float doubt = calibration->force_scale * FORCE_SHARE_PER_kPa * off_kPa;
      sd = sqrtf(sd * sd + doubt * doubt);
    }
  }
  app->contact_settings.force_scale_sd = sd;
#if FT_WITH_TANGENTIAL
  use_tangential_scales(app);
#endif
}
#endif
