#include "app/tangential_stage.h"

#include "common/contact_flags.h"
#include "config/geometry.h"
#include "fit/fit_fixed.h"
#include "port/divide.h"
#include "port/port.h"

#include <string.h>

/* Least share of the force that remains from one frame to the next, and its inverse is the most: else it is another contact. */
#define LEAST_SHARE 0.5f

void tangential_stage_start(struct tangential_stage *own, const struct fit_array *array, struct jobs *jobs) {
  own->job.array = array;
  jobs_set(jobs, JOB_TANGENTIAL, tangential_estimate, &own->job);
}

void tangential_stage_forget(struct tangential_stage *own) {
  own->is_asked = false;
  own->is_followed = false;
}

/* Whether there is an answer. The processor sleeps meanwhile. */
static bool wait_for_answer(const struct tangential_stage *own, const struct jobs *jobs, struct findings *found) {
  const uint64_t began_us = port_now_us();
  uint64_t now_us = began_us;
  while (!jobs_is_free(jobs, JOB_TANGENTIAL) && now_us - own->asked_us < own->limit_us) {
    port_sleep();
    now_us = port_now_us();
  }
  found->slept_us += now_us - began_us;
  return jobs_is_free(jobs, JOB_TANGENTIAL);
}

/* Whether what was asked is answered; if not, the second processor is started again. */
static bool is_answered(struct tangential_stage *own, struct jobs *jobs, struct findings *found) {
  own->is_asked = false;
  if (jobs->has_processor ? wait_for_answer(own, jobs, found) : jobs_is_free(jobs, JOB_TANGENTIAL)) {
    return true;
  }
  port_event(CRASH_EVENT_WORKER, 0);
  jobs_start(jobs);
  tangential_stage_forget(own);
  return false;
}

static void ask(struct tangential_stage *own, const struct location_stage *location, struct jobs *jobs, const struct findings *found) {
  const bool slow = found->frame.t_us - own->job.question.t_us >= TANGENTIAL_SLOW_us;
  own->limit_us = (slow ? TANGENTIAL_SLOW_LATE_us : TANGENTIAL_LATE_us) + (jobs_is_free(jobs, JOB_SHAPES) ? 0 : SHAPES_PART_us);
  memcpy(own->question.pressure_Pa_q10, found->conditioned.pressure_Pa_q10, sizeof own->question.pressure_Pa_q10);
  own->question.settings = location->settings;
  own->question.fit = found->fit;
  own->job.question = (struct tangential_question){
      .begins = !own->is_followed,
      .saturated = found->frame.saturated,
      .t_us = found->frame.t_us,
      .pressure_Pa_q10 = own->question.pressure_Pa_q10,
      .settings = &own->question.settings,
      .fit = &own->question.fit,
  };
  worker_ask(&jobs->worker[JOB_TANGENTIAL]);
  port_worker_wake();
  own->asked_us = port_now_us();
  own->is_asked = true;
}

/* The estimate is of the frame that was asked about: since then the contact has moved, and its force has changed, as the Gaussian shows. */
static void take_answer(struct tangential_stage *own, struct findings *found) {
  struct fit_tangential *estimate = &own->estimate;
  const struct fit_result *then = &own->question.fit, *now = &found->fit;
  *estimate = own->job.estimate;
  found->tangential = estimate;
  if (!estimate->valid || own->waits) {
    return;
  }
  const float share = then->force_N > 0.0f ? now->force_N / then->force_N : 0.0f;
  if (!tangential_is_worthwhile(now, found->frame.saturated) || share < LEAST_SHARE || share > 1.0f / LEAST_SHARE) {
    memset(estimate, 0, sizeof *estimate);
    return;
  }
  estimate->x_mm += now->x_mm - then->x_mm;
  estimate->y_mm += now->y_mm - then->y_mm;
  estimate->force_N *= share;
  estimate->force_sd_N *= share;
  estimate->qx_N *= share;
  estimate->qy_N *= share;
  estimate->q_sd_N *= share;
}

void tangential_stage_ask(struct tangential_stage *own, const struct location_stage *location, struct jobs *jobs, struct findings *found) {
  const bool asks = own->profile && found->conditioned.contact;
  own->waits = asks && jobs->pace_us >= TANGENTIAL_BESIDE_us;
  own->is_late = false;
  found->tangential = NULL;
  if (own->is_asked && !is_answered(own, jobs, found)) {
    own->is_late = asks;
  } else if (asks && own->is_followed && !own->waits && jobs->interval_us < TANGENTIAL_SLOW_us) {
    take_answer(own, found);
  }
  if (asks) {
    ask(own, location, jobs, found);
  }
  own->is_followed = asks;
}

void tangential_stage_wait(struct tangential_stage *own, struct jobs *jobs, struct findings *found) {
  if (!own->waits) {
    return;
  }
  jobs_serve_alone(jobs, JOB_TANGENTIAL);
  if (is_answered(own, jobs, found)) {
    take_answer(own, found);
  } else {
    own->is_late = true;
  }
}

void tangential_stage_scale(struct tangential_stage *own, const struct location_stage *location, struct findings *found) {
  found->contact_input.tangential = found->tangential;
  own->settings.location_sd_limit_mm = location->settings.location_sd_limit_mm;
  tangential_update(&own->history, &own->settings, &found->contact_input, &found->contact, &found->tangential_force);
  found->contact.flags |= own->is_late ? (uint32_t)CONTACT_FLAG_TANGENTIAL_LATE : 0;
}

void tangential_stage_put(const struct findings *found, struct wire_contact *packet) {
  if (found->contact.flags & CONTACT_FLAG_TANGENTIAL_VALID) {
    const struct tangential_force *force = &found->tangential_force;
    packet->x_mm = force->x_mm;
    packet->y_mm = force->y_mm;
    packet->location_sd_mm = force->location_sd_mm;
    packet->force_N = force->force_N;
    packet->force_sd_N = force->force_sd_N;
    packet->qx_N = force->qx_N;
    packet->qy_N = force->qy_N;
    packet->q_sd_N = force->q_sd_N;
    packet->tangential_ratio = force->ratio;
  }
  packet->vx_mm_s = found->motion.vx_mm_s;
  packet->vy_mm_s = found->motion.vy_mm_s;
}

void tangential_stage_use_profile(struct tangential_stage *own, const struct pad_profile *profile) {
  own->profile = profile && fit_pad_init(&own->job.pad, own->job.array, profile) == FT_OK ? profile : NULL;
  tangential_stage_forget(own);
  tangential_reset(&own->history);
}

/* How far sensors are off their places: mean of |x| + |y|. */
static int32_t off_um(const struct calibration *calibration) {
  uint32_t sum_um = 0;
  for (unsigned k = 0; k < geometry.sensor_count; k++) {
    sum_um += fixed_magnitude(calibration->sensors[k].off_x_um) + fixed_magnitude(calibration->sensors[k].off_y_um);
  }
  return port_divide((int32_t)sum_um, geometry.sensor_count);
}

void tangential_stage_use_scale(struct tangential_stage *own, const struct location_stage *location,
                                const struct contact_settings *contact) {
  if (own->profile) {
    tangential_use(&own->settings, own->profile, contact, location->calibration ? off_um(location->calibration) : -1);
  }
}
