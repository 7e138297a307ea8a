#include "simulation/player/repeat.h"

#include "app/app.h"
#include "common/contact_flags.h"
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
  if (!osr || fit_array_init(&app.stages.location.array, info->sensor_count, info->x_mm, info->y_mm, info->pitch_mm) != FT_OK) {
    return false;
  }
  app.commands.streams = WIRE_STREAM_CONTACT; /* it is not read, but the packet is made */
  app.found.frame.noise_Pa_q10 = osr->noise_Pa_q10;
  app.stages.location.settings.iterations = info->fit_iterations;
  app.stages.location.settings.prior_sigma_mm = info->prior_sigma_mm;
  app.stages.location.settings.prior_width_mm = info->prior_width_mm;
  app.stages.location.settings.location_sd_limit_mm = info->location_limit_mm;
  fit_set_errors(&app.stages.location.settings, DEFAULT_GAIN_SD, DEFAULT_MODEL_SD);
  calibration = info->calibration;
  stages_use_calibration(&app.stages, &app.found, info->stored & WIRE_STORED_CALIBRATION ? &calibration : NULL);
#if FT_WITH_TANGENTIAL
  pad = info->pad;
  stages_use_profile(&app.stages, info->stored & WIRE_STORED_PAD ? &pad : NULL);
#endif
  app.stages.contact_settings.slip_threshold_mm = info->slip_threshold_mm;
  app.stages.contact_settings.slip_window_us = info->slip_window_ms * 1000u;
  condition_start(&app.stages.condition.condition);
  return true;
}

void repeat_tare(void) { condition_tare(&app.stages.condition.condition); }

void repeat_frame(const struct wire_packet *packet, bool held, struct wire_contact *contact) {
  const struct wire_raw *raw = &packet->body.raw;
  app.found.frame.number = raw->frame;
  app.found.frame.t_us = packet->t_us;
  app.found.frame.held = held;
  app.found.frame.sensor_count = raw->sensor_count;
  app.found.frame.temperature_cC = raw->temperature_cC;
  app.found.frame.valid = raw->valid;
  app.found.frame.saturated = raw->saturated;
  app.found.frame.doubtful =
      held && (raw->flags & CONTACT_FLAG_SENSOR_DOUBTFUL) ? ~(sensor_map)0 : raw->doubtful; /* a held one has no map */
  app.found.frame.unsettled = raw->doubtful == raw->valid ? raw->valid : 0; /* what has moved is doubted whole (scan/readings.h) */
  memcpy(app.found.frame.pressure_Pa_q10, raw->pressure_Pa_q10, sizeof app.found.frame.pressure_Pa_q10);
  app_process_frame(&app, 0);
  const struct wire_stages stages = contact->stages;
  *contact = app.line.packet.body.contact;
  contact->stages = stages;
}
