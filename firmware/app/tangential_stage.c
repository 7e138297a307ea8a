#include "app/tangential_stage.h"

#include "common/contact_flags.h"
#include "config/geometry.h"
#include "fit/fit_fixed.h"
#include "port/divide.h"
#include "port/port.h"

#include <string.h>

/* Least share of the force that remains from one frame to the next, and its inverse is the most: else it is another contact. */
#define LEAST_SHARE 0.5f

void tangential_stage_start(struct tangential_stage *stage, const struct fit_array *array, struct jobs *jobs) {
  stage->job.array = array;
  jobs_set(jobs, JOB_TANGENTIAL, tangential_estimate, &stage->job);
}

void tangential_stage_forget(struct tangential_stage *stage) {
  stage->is_asked = false;
  stage->same_contact = false;
}

/* Whether there is an answer. The processor sleeps meanwhile. */
static bool wait_for_answer(const struct tangential_stage *stage, const struct jobs *jobs, struct findings *found) {
  const uint64_t began_us = port_now_us();
  uint64_t now_us = began_us;
  while (!jobs_is_free(jobs, JOB_TANGENTIAL) && now_us - stage->asked_us < stage->limit_us) {
    port_sleep();
    now_us = port_now_us();
  }
  found->slept_us += now_us - began_us;
  return jobs_is_free(jobs, JOB_TANGENTIAL);
}

/* Whether what was asked is answered; if not, the second processor is started again. */
static bool is_answered(struct tangential_stage *stage, struct jobs *jobs, struct findings *found) {
  stage->is_asked = false;
  if (jobs->has_processor ? wait_for_answer(stage, jobs, found) : jobs_is_free(jobs, JOB_TANGENTIAL)) {
    return true;
  }
  port_log_event(CRASH_EVENT_WORKER, 0);
  jobs_start(jobs);
  tangential_stage_forget(stage);
  return false;
}

static void ask(struct tangential_stage *stage, const struct location_stage *location, struct jobs *jobs, const struct findings *found) {
  const bool slow = found->frame.t_us - stage->job.question.t_us >= TANGENTIAL_SLOW_us;
  stage->limit_us = (slow ? TANGENTIAL_SLOW_TIMEOUT_us : TANGENTIAL_TIMEOUT_us) + (jobs_is_free(jobs, JOB_SHAPES) ? 0 : SHAPES_PART_us);
  memcpy(stage->question.pressure_Pa_q10, found->conditioned.pressure_Pa_q10, sizeof stage->question.pressure_Pa_q10);
  stage->question.settings = location->settings;
  stage->question.fit = found->fit;
  stage->job.question = (struct tangential_question){
      .begins = !stage->same_contact,
      .saturated = found->frame.saturated,
      .t_us = found->frame.t_us,
      .pressure_Pa_q10 = stage->question.pressure_Pa_q10,
      .settings = &stage->question.settings,
      .fit = &stage->question.fit,
  };
  worker_ask(&jobs->worker[JOB_TANGENTIAL]);
  port_worker_wake();
  stage->asked_us = port_now_us();
  stage->is_asked = true;
}

/* The estimate is of the frame that was asked about: since then the contact has moved, and its force has changed, as the Gaussian shows. */
static void take_answer(struct tangential_stage *stage, struct findings *found) {
  struct fit_tangential *estimate = &stage->estimate;
  const struct fit_result *then = &stage->question.fit, *now = &found->fit;
  *estimate = stage->job.estimate;
  found->tangential = estimate;
  if (!estimate->valid || stage->waits) {
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

void tangential_stage_ask(struct tangential_stage *stage, const struct location_stage *location, struct jobs *jobs,
                          struct findings *found) {
  const bool asks = stage->profile && found->conditioned.contact;
  stage->waits = asks && jobs->short_interval_us >= TANGENTIAL_NO_WAIT_us;
  stage->is_late = false;
  found->tangential = NULL;
  if (stage->is_asked && !is_answered(stage, jobs, found)) {
    stage->is_late = asks;
  } else if (asks && stage->same_contact && !stage->waits && jobs->interval_us < TANGENTIAL_SLOW_us) {
    take_answer(stage, found);
  }
  if (asks) {
    ask(stage, location, jobs, found);
  }
  stage->same_contact = asks;
}

void tangential_stage_wait(struct tangential_stage *stage, struct jobs *jobs, struct findings *found) {
  if (!stage->waits) {
    return;
  }
  jobs_run_here(jobs, JOB_TANGENTIAL);
  if (is_answered(stage, jobs, found)) {
    take_answer(stage, found);
  } else {
    stage->is_late = true;
  }
}

void tangential_stage_scale(struct tangential_stage *stage, const struct location_stage *location, struct findings *found) {
  found->contact_input.tangential = found->tangential;
  stage->settings.location_sd_limit_mm = location->settings.location_sd_limit_mm;
  tangential_update(&stage->history, &stage->settings, &found->contact_input, &found->contact, &found->tangential_force);
  found->contact.flags |= stage->is_late ? (uint32_t)CONTACT_FLAG_TANGENTIAL_LATE : 0;
}

void tangential_stage_fill(const struct findings *found, struct wire_contact *packet) {
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

void tangential_stage_use_profile(struct tangential_stage *stage, const struct pad_profile *profile) {
  stage->profile = profile && fit_pad_init(&stage->job.pad, stage->job.array, profile) == FT_OK ? profile : NULL;
  tangential_stage_forget(stage);
  tangential_reset(&stage->history);
}

/* How far sensors are off their places: mean of |x| + |y|. */
static int32_t off_um(const struct calibration *calibration) {
  uint32_t sum_um = 0;
  for (unsigned k = 0; k < geometry.sensor_count; k++) {
    sum_um += fixed_magnitude(calibration->sensors[k].off_x_um) + fixed_magnitude(calibration->sensors[k].off_y_um);
  }
  return port_divide((int32_t)sum_um, geometry.sensor_count);
}

void tangential_stage_use_scale(struct tangential_stage *stage, const struct location_stage *location,
                                const struct contact_settings *contact) {
  if (stage->profile) {
    tangential_configure(&stage->settings, stage->profile, contact, location->calibration ? off_um(location->calibration) : -1);
  }
}
