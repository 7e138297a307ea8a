#include "app/shapes_stage.h"

#include "common/contact_flags.h"
#include "port/port.h"

#include <string.h>

void shapes_stage_start(struct shapes_stage *stage, const struct fit_array *array, struct jobs *jobs) {
  stage->job.array = array;
  stage->job.before = &jobs->worker[JOB_TANGENTIAL];
  stage->begins = true;
  jobs_set(jobs, JOB_SHAPES, shapes_estimate, &stage->job);
}

void shapes_stage_forget(struct shapes_stage *stage) { stage->begins = true; }

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

void shapes_stage_ask(struct shapes_stage *stage, const struct location_stage *location, const struct tangential_settings *scales,
                      struct jobs *jobs, const struct findings *found) {
  const bool asks = stage->is_in_use && found->conditioned.contact;
  if (!asks || stage->starts != jobs->starts) {
    stage->begins = true;
    stage->starts = jobs->starts;
  }
  if (stage->begins) {
    memset(&stage->report, 0, sizeof stage->report);
  }
  if (!asks || !jobs_is_free(jobs, JOB_SHAPES)) {
    return;
  }
  if (stage->begins) {
    memset(&stage->job.report, 0, sizeof stage->job.report);
    stage->job.progress = FIT_SHAPES_STEPPED;
  }
  stage->report = stage->job.report;
  if (stage->job.progress == FIT_SHAPES_UNFINISHED) {
    stage->job.question.begins = false;
  } else {
    set_question(&stage->job.question, stage->begins, location, scales, found);
  }
  stage->job.question.parts = shapes_parts(jobs->short_interval_us);
  stage->begins = false;
  worker_ask(&jobs->worker[JOB_SHAPES]);
  port_worker_wake();
}

void shapes_stage_judge_tangential(const struct shapes_stage *stage, struct findings *found) {
  if (stage->report.shape == FIT_SHAPE_TWO) {
    found->tangential = NULL;
  }
}

void shapes_stage_locate(const struct shapes_stage *stage, const struct location_stage *location, struct findings *found) {
  const bool has_force = (found->contact.flags & CONTACT_FLAG_TANGENTIAL_VALID) != 0;
  found->contact.flags |= shapes_flags(&stage->report);
  found->location = shapes_locate(&stage->report, &found->fit, has_force ? &found->tangential_force : NULL);
  found->contact.flags &= ~(uint32_t)CONTACT_FLAG_UNCERTAIN;
  if (found->location.location_sd_mm > location->settings.location_sd_limit_mm) {
    found->contact.flags |= CONTACT_FLAG_UNCERTAIN;
  }
}

/* A quantity that the shape does not have is zero. */
void shapes_stage_fill(const struct shapes_stage *stage, const struct findings *found, struct wire_contact *packet) {
  const struct shapes_report *report = &stage->report;
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

void shapes_stage_use_profile(struct shapes_stage *stage, const struct pad_profile *profile) {
  stage->is_in_use = profile && fit_shapes_init(&stage->job.pad, stage->job.array, profile) == FT_OK;
  shapes_stage_forget(stage);
}
