#include "app/uncertainty_stage.h"

#include "common/contact_flags.h"
#include "config/defaults.h"
#include "config/geometry.h"

/* Interval from which on a frame has time for all parts of the search and for the gains, us. */
#define ALL_AT_ONCE_us 4500u

static bool is_estimated(const struct findings *found) { return found->tangential && found->tangential->valid; }

void uncertainty_stage_process(const struct uncertainty_stage *stage, const struct location_stage *location, struct findings *found) {
  if (found->conditioned.contact && !is_estimated(found)) {
    fit_bias_add(&stage->force, &location->array, &location->settings, &found->fit);
    found->contact.flags |= found->fit.flags & CONTACT_FLAG_UNCERTAIN;
  }
}

static void learn_gains(struct uncertainty_stage *stage, struct location_stage *location, const struct findings *found) {
  if (fit_gains_learn(&stage->gains, &location->array, found->conditioned.pressure_Pa_q10, &location->settings, &found->fit)) {
    const float gain_sd = fit_gains_sd(&stage->gains);
    for (unsigned k = 0; k < geometry.sensor_count; k++) {
      location->settings.gain_sd_q16[k] = (uint16_t)(65536.0f * gain_sd + 0.5f);
    }
  }
}

static void do_part(struct uncertainty_stage *stage, struct location_stage *location, const struct findings *found) {
  if (stage->gains_are_due) {
    learn_gains(stage, location, found);
    stage->gains_are_due = false;
    return;
  }
  fit_bias_step(&stage->force, &location->array, found->conditioned.pressure_Pa_q10, &location->settings, &found->fit);
  stage->gains_are_due = stage->force.part == 0 && !location->calibration;
}

void uncertainty_stage_after_send(struct uncertainty_stage *stage, struct location_stage *location, const struct findings *found) {
  const uint32_t t_us = (uint32_t)found->frame.t_us;
  const bool slow = t_us - stage->frame_us >= ALL_AT_ONCE_us;
  stage->frame_us = t_us;
  if (!found->conditioned.contact || is_estimated(found)) {
    fit_bias_begin(&stage->force);
    fit_gains_end_touch(&stage->gains);
    stage->gains_are_due = false;
    return;
  }
  for (int parts = slow ? FIT_BIAS_PARTS + 1 : 1; parts > 0; parts--) {
    do_part(stage, location, found);
  }
}

void uncertainty_stage_forget_gains(struct uncertainty_stage *stage) { fit_gains_begin(&stage->gains, DEFAULT_GAIN_SD); }
