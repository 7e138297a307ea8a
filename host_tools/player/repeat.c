#include "player/repeat.h"

#include "common/contact_flags.h"
#include "condition/condition.h"
#include "config/defaults.h"
#include "contact/contact.h"
#include "fit/fit.h"
#include "ms5840/ms5840.h"

#include <string.h>

static struct {
  struct fit_array array;
  struct fit_settings fit_settings;
  struct contact_settings contact_settings;
  struct condition condition;
  struct conditioned conditioned;
  struct fit_result fit;
  struct contact_result contact;
  struct slip_history slip_history;
} repeat;

bool repeat_begin(const struct wire_info *info) {
  memset(&repeat, 0, sizeof repeat);
  const struct ms5840_osr *osr = ms5840_find_osr(info->osr);
  if (!osr || fit_array_init(&repeat.array, info->sensor_count, info->x_mm, info->y_mm,
                             info->pitch_mm) != FT_OK) {
    return false;
  }
  repeat.fit_settings.iterations = info->fit_iterations;
  repeat.fit_settings.n_largest = DEFAULT_FIT_N_LARGEST;
  repeat.fit_settings.prior_sigma_mm = DEFAULT_PRIOR_SIGMA_mm;
  repeat.fit_settings.prior_width_mm = DEFAULT_PRIOR_WIDTH_mm;
  repeat.fit_settings.noise_Pa_q10 = osr->noise_Pa_q10;
  repeat_slip_settings(info->slip_threshold_mm, info->slip_window_ms);
  repeat_tare();
  return true;
}

void repeat_tare(void) {
  condition_tare(&repeat.condition);
}

void repeat_slip_settings(float threshold_mm, uint16_t window_ms) {
  repeat.contact_settings.slip_threshold_mm = threshold_mm;
  repeat.contact_settings.slip_window_us = window_ms * 1000u;
  slip_reset(&repeat.slip_history);
}

void repeat_frame(const struct wire_packet *packet, bool held, struct wire_contact *contact) {
  const struct wire_raw *raw = &packet->body.raw;
  if (held) {
    repeat.contact.flags |= CONTACT_FLAG_HELD;
  } else {
    struct frame frame = {
        .number = raw->frame,
        .t_us = packet->t_us,
        .sensor_count = raw->sensor_count,
        .noise_Pa_q10 = repeat.fit_settings.noise_Pa_q10,
        .temperature_cC = raw->temperature_cC,
        .valid = raw->valid,
        .saturated = raw->saturated,
    };
    memcpy(frame.pressure_Pa_q10, raw->pressure_Pa_q10, sizeof frame.pressure_Pa_q10);
    condition_frame(&repeat.condition, &frame, &repeat.conditioned);
    memset(&repeat.fit, 0, sizeof repeat.fit);
    if (repeat.conditioned.contact) {
      fit_gaussian(&repeat.array, repeat.conditioned.pressure_Pa_q10, repeat.conditioned.usable,
                   &repeat.fit_settings, &repeat.fit);
    }
    const struct contact_input input = {
        .t_us = packet->t_us,
        .contact = repeat.conditioned.contact,
        .tared = repeat.conditioned.tared,
        .masked = repeat.conditioned.usable != UINT32_MAX >> (FT_MAX_SENSORS - frame.sensor_count),
        .noise_Pa = (float)frame.noise_Pa_q10 * (1.0f / 1024.0f),
        .saturated = frame.saturated,
        .fit = repeat.conditioned.contact ? &repeat.fit : NULL,
    };
    contact_update(&repeat.slip_history, &repeat.contact_settings, &input, &repeat.contact);
  }
  contact->frame = raw->frame;
  contact->flags = repeat.contact.flags;
  contact->sensors_used = repeat.fit.used;
  contact->x_mm = repeat.fit.x_mm;
  contact->y_mm = repeat.fit.y_mm;
  contact->p0_Pa = repeat.fit.p0_Pa;
  contact->sigma_mm = repeat.fit.sigma_mm;
  contact->force_N = repeat.fit.force_N;
  contact->slip_mm = repeat.contact.slip_mm;
  contact->residual_rms_Pa = repeat.fit.residual_rms_Pa;
  contact->location_sd_mm = repeat.fit.location_sd_mm;
  contact->force_sd_N = repeat.fit.force_sd_N;
}
