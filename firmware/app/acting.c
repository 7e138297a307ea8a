#include "app/acting.h"

#include "config/defaults.h"
#include "config/geometry.h"

#include <string.h>

#if FT_WITH_FIT
#if FT_WITH_TANGENTIAL
static void use_tangential_scales(struct app *app) {
  if (app->pad) {
    tangential_use(&app->tangential_settings, app->pad, &app->contact_settings,
                   app->calibration != NULL);
  }
}

void app_use_pad(struct app *app, const struct pad_profile *pad) {
  bool acts = pad && fit_pad_init(&app->fit_pad, &app->fit_array, pad) == FT_OK;
  app->pad = acts ? pad : NULL;
  app->fit_settings.cut_noises = acts ? 0 : DEFAULT_CUT_NOISES;
  use_tangential_scales(app);
  memset(&app->tangential_course, 0, sizeof app->tangential_course);
  tangential_reset(&app->tangential_history);
  motion_reset(&app->motion_history);
}
#endif

void app_use_calibration(struct app *app, const struct calibration *calibration) {
  app->calibration = calibration;
  for (unsigned k = 0; k < geometry.sensor_count; k++) {
    float gain = calibration ? calibration->sensors[k].gain : 1.0f;
    float gain_sd = calibration ? calibration->sensors[k].gain_sd : DEFAULT_GAIN_SD;
    app->gains.inverse_q16[k] = (uint32_t)(65536.0f / gain + 0.5f);
    app->fit_settings.gain_sd_q16[k] = (uint16_t)(gain_sd * 65536.0f + 0.5f);
  }
  app->contact_settings.force_scale = calibration ? calibration->force_scale : DEFAULT_FORCE_SCALE;
  app->contact_settings.force_scale_sd =
      calibration ? calibration->force_scale_sd : DEFAULT_FORCE_SCALE_SD;
#if FT_WITH_TANGENTIAL
  use_tangential_scales(app);
#endif
}
#endif
