#include "simulation/player/repeat.h"

#include "app/acting.h"
#include "app/app.h"
#include "config/defaults.h"

#include <string.h>

static struct app app;
static struct calibration calibration;
#if FT_WITH_TANGENTIAL
static struct pad_profile pad;
#endif

bool repeat_begin(const struct wire_info *info) {
  memset(&app, 0, sizeof app);
  const struct ms58xx_osr *osr = ms58xx_find_osr(info->osr);
  if (!osr || fit_array_init(&app.fit_array, info->sensor_count, info->x_mm, info->y_mm, info->pitch_mm) != FT_OK) {
    return false;
  }
  app.streams = WIRE_STREAM_CONTACT; /* it is not read, but the packet is made */
  app.frame.noise_Pa_q10 = osr->noise_Pa_q10;
  app.fit_settings.iterations = info->fit_iterations;
  app.fit_settings.n_largest = DEFAULT_FIT_N_LARGEST;
  app.fit_settings.prior_sigma_mm = info->prior_sigma_mm;
  app.fit_settings.prior_width_mm = info->prior_width_mm;
  app.fit_settings.location_sd_limit_mm = info->location_limit_mm;
  fit_set_errors(&app.fit_settings, DEFAULT_GAIN_SD, DEFAULT_MODEL_SD);
  calibration = info->calibration;
  app_use_calibration(&app, info->stored & WIRE_STORED_CALIBRATION ? &calibration : NULL);
#if FT_WITH_TANGENTIAL
  pad = info->pad;
  app_use_pad(&app, info->stored & WIRE_STORED_PAD ? &pad : NULL);
#endif
  app.contact_settings.slip_threshold_mm = info->slip_threshold_mm;
  app.contact_settings.slip_window_us = info->slip_window_ms * 1000u;
  condition_start(&app.condition);
  return true;
}

void repeat_tare(void) {
  condition_tare(&app.condition);
}

void repeat_frame(const struct wire_packet *packet, bool held, struct wire_contact *contact) {
  const struct wire_raw *raw = &packet->body.raw;
  app.frame.number = raw->frame;
  app.frame.t_us = packet->t_us;
  app.frame.held = held;
  app.frame.sensor_count = raw->sensor_count;
  app.frame.temperature_cC = raw->temperature_cC;
  app.frame.valid = raw->valid;
  app.frame.saturated = raw->saturated;
  app.frame.doubtful = raw->doubtful;
  memcpy(app.frame.pressure_Pa_q10, raw->pressure_Pa_q10, sizeof app.frame.pressure_Pa_q10);
  app_process_frame(&app, 0);
  const struct wire_stages stages = contact->stages;
  *contact = app.packet.body.contact;
  contact->stages = stages;
}
