#include "app/shapes_stage.h"

#include "common/contact_flags.h"
#include "port/port.h"

#include <string.h>

void shapes_stage_start(struct shapes_stage *own, const struct fit_array *array, struct jobs *jobs) {
  own->job.array = array;
  own->begins = true;
  jobs_set(jobs, JOB_SHAPES, shapes_estimate, &own->job);
}

void shapes_stage_forget(struct shapes_stage *own) { own->begins = true; }

static void set_question(struct shapes_question *question, bool begins, const struct location_stage *location,
                         const struct tangential_settings *scales, const struct findings *found) {
  question->begins = begins;
  question->t_us = found->frame.t_us;
  memcpy(question->pressure_Pa_q10, found->conditioned.pressure_Pa_q10, sizeof question->pressure_Pa_q10);
  question->settings = location->settings;
  question->fit = found->fit;
  question->force_scale = scales->force_scale;
  question->force_scale_sd = scales->force_scale_sd;
}

void shapes_stage_ask(struct shapes_stage *own, const struct location_stage *location, const struct tangential_settings *scales,
                      struct jobs *jobs, const struct findings *found) {
  const bool asks = own->is_in_use && found->conditioned.contact;
  if (!asks || own->starts != jobs->starts) {
    own->begins = true;
    own->starts = jobs->starts;
  }
  if (own->begins) {
    memset(&own->report, 0, sizeof own->report);
  }
  if (!asks || !jobs_is_free(jobs, JOB_SHAPES)) {
    return;
  }
  if (own->begins) {
    memset(&own->job.report, 0, sizeof own->job.report);
    own->job.progress = FIT_SHAPES_STEPPED;
  }
  own->report = own->job.report;
  if (own->job.progress == FIT_SHAPES_UNFINISHED) {
    own->job.question.begins = false;
  } else {
    set_question(&own->job.question, own->begins, location, scales, found);
  }
  own->job.question.parts = shapes_parts(jobs->pace_us);
  own->begins = false;
  worker_ask(&jobs->worker[JOB_SHAPES]);
  port_worker_wake();
}

void shapes_stage_judge_tangential(const struct shapes_stage *own, struct findings *found) {
  if (own->report.shape == FIT_SHAPE_TWO) {
    found->tangential = NULL;
  }
}

void shapes_stage_locate(const struct shapes_stage *own, const struct location_stage *location, struct findings *found) {
  const bool has_force = (found->contact.flags & CONTACT_FLAG_TANGENTIAL_VALID) != 0;
  found->contact.flags |= shapes_flags(&own->report);
  found->location = shapes_locate(&own->report, &found->fit, has_force ? &found->tangential_force : NULL);
  found->contact.flags &= ~(uint32_t)CONTACT_FLAG_UNCERTAIN;
  if (found->location.location_sd_mm > location->settings.location_sd_limit_mm) {
    found->contact.flags |= CONTACT_FLAG_UNCERTAIN;
  }
}

/* A quantity that the shape does not have is zero. */
void shapes_stage_put(const struct shapes_stage *own, const struct findings *found, struct wire_contact *packet) {
  const struct shapes_report *report = &own->report;
  packet->x_mm = found->location.x_mm;
  packet->y_mm = found->location.y_mm;
  packet->location_sd_mm = found->location.location_sd_mm;
  packet->shape_age_ms = report->shape ? 1e-3f * (float)(uint32_t)(found->frame.t_us - report->t_us) : 0.0f;
  packet->x1_mm = report->contact[0].x_mm;
  packet->y1_mm = report->contact[0].y_mm;
  packet->location1_sd_mm = report->contact[0].location_sd_mm;
  packet->force1_N = report->contact[0].force_N;
  packet->force1_sd_N = report->contact[0].force_sd_N;
  packet->x2_mm = report->contact[1].x_mm;
  packet->y2_mm = report->contact[1].y_mm;
  packet->location2_sd_mm = report->contact[1].location_sd_mm;
  packet->force2_N = report->contact[1].force_N;
  packet->force2_sd_N = report->contact[1].force_sd_N;
  packet->edge_angle_deg = report->edge_angle_deg;
  packet->edge_angle_sd_deg = report->edge_angle_sd_deg;
  packet->edge_length_mm = report->edge_length_mm;
}

void shapes_stage_use_profile(struct shapes_stage *own, const struct pad_profile *profile) {
  own->is_in_use = profile && fit_shapes_init(&own->job.pad, own->job.array, profile) == FT_OK;
  shapes_stage_forget(own);
}
