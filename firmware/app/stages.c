#include "app/stages.h"

#include "config/defaults.h"
#include "config/geometry.h"
#include "port/port.h"

#include <string.h>

/* A scene without a stage has no use for what is meant for it. */
#pragma GCC diagnostic ignored "-Wunused-parameter"

void stages_start(struct stages *stages) {
  condition_start(&stages->condition.condition);
#if FT_WITH_FIT
  stages->plausibility.apart_Pa = MS58XX_APART_Pa;
  location_stage_start(&stages->location);
#endif
#if FT_WITH_TANGENTIAL
  tangential_stage_start(&stages->tangential, &stages->location.array, &stages->jobs);
#if FT_WITH_SHAPES
  shapes_stage_start(&stages->shapes, &stages->location.array, &stages->jobs);
#endif
  jobs_start(&stages->jobs);
#endif
#if FT_WITH_SLIP
  stages->contact_settings.slip_threshold_mm = DEFAULT_SLIP_THRESHOLD_mm;
  stages->contact_settings.slip_window_us = DEFAULT_SLIP_WINDOW_ms * 1000u;
#endif
}

/* Notes what the main loop does from now on. */
static void begin(struct findings *found, enum crash_activity activity) {
  const uint32_t now_us = (uint32_t)port_now_us();
  found->spent_us[found->activity] += now_us - found->since_us;
  found->since_us = now_us;
  found->activity = (uint8_t)activity;
  port_set_activity(activity);
}

/* The list of stages, up to what the second processor is asked. */
static void fit_readings(struct stages *stages, struct findings *found) {
  condition_stage_process(&stages->condition, found);
#if FT_WITH_FIT
  begin(found, CRASH_AT_FIT);
  location_stage_process(&stages->location, stages->condition.condition.hysteresis_sd_Pa_q10, found);
#endif
#if FT_WITH_TANGENTIAL
  jobs_begin_frame(&stages->jobs, found->frame.t_us);
  tangential_stage_ask(&stages->tangential, &stages->location, &stages->jobs, found);
#endif
#if FT_WITH_SHAPES
  shapes_stage_ask(&stages->shapes, &stages->location, &stages->tangential.settings, &stages->jobs, found);
#endif
}

/* The list of stages from there on. Not part of the other, whose stack lies below that of the fit. */
static __attribute__((noinline)) void judge_fit(struct stages *stages, struct findings *found) {
  begin(found, CRASH_AT_CONTACT);
#if FT_WITH_FIT
  location_stage_set_force(&stages->contact_settings, found);
  contact_stage_collect(found, stages->location.calibration != NULL);
#else
  contact_stage_collect(found, false);
#endif
#if FT_WITH_SLIP
  contact_update(&stages->slip, &stages->contact_settings, &found->contact_input, &found->contact);
#else
  contact_set_flags(&found->contact_input, &found->contact);
#endif
#if FT_WITH_TANGENTIAL
  begin(found, CRASH_AT_FIT);
  tangential_stage_wait(&stages->tangential, &stages->jobs, found);
#endif
#if FT_WITH_SHAPES
  shapes_stage_judge_tangential(&stages->shapes, found);
#endif
#if FT_WITH_TANGENTIAL_BIAS
  uncertainty_stage_process(&stages->uncertainty, &stages->location, found);
#endif
#if FT_WITH_TANGENTIAL
  begin(found, CRASH_AT_CONTACT);
  tangential_stage_scale(&stages->tangential, &stages->location, found);
  motion_update(&stages->motion, &stages->tangential.settings, &found->contact_input, &found->contact, &found->motion);
#endif
#if FT_WITH_SHAPES
  shapes_stage_locate(&stages->shapes, &stages->location, found);
#endif
}

void stages_process(struct stages *stages, struct findings *found, uint32_t taken_us) {
  const uint32_t read_us = (uint32_t)found->frame.t_read_us;
  memset(found->spent_us, 0, sizeof found->spent_us);
  found->slept_us = 0;
  found->activity = CRASH_AT_CONDITION;
  port_set_activity(CRASH_AT_CONDITION);
  /* A frame may have come after taken_us was read. */
  found->since_us = found->taken_us = (int32_t)(taken_us - read_us) < 0 ? read_us : taken_us;
  if (found->frame.held) {
    begin(found, CRASH_AT_CONTACT);
    contact_stage_hold(found);
  } else {
    fit_readings(stages, found);
    judge_fit(stages, found);
  }
  begin(found, CRASH_AT_PACKET);
}

#if FT_WITH_FIT
void stages_fill_contact(const struct stages *stages, const struct findings *found, struct wire_contact *packet) {
  (void)stages; /* only shapes are not in the findings */
  contact_stage_fill(found, packet);
  location_stage_fill(found, packet);
#if FT_WITH_TANGENTIAL
  tangential_stage_fill(found, packet);
#endif
#if FT_WITH_SHAPES
  shapes_stage_fill(&stages->shapes, found, packet);
#endif
}
#endif

#if FT_WITH_RAW_STREAM
static void send_raw(const struct stages *stages, const struct findings *found, struct line *line) {
  struct wire_raw *raw = &line->packet.body.raw;
  condition_stage_fill(&stages->condition, found, raw);
  line_send(line, &wire_raw_layout, found->frame.t_us);
}
#endif

void stages_send(const struct stages *stages, const struct findings *found, uint8_t streams, struct line *line) {
#if FT_WITH_FIT
  if (streams & WIRE_STREAM_CONTACT) {
    stages_fill_contact(stages, found, &line->packet.body.contact);
    line_send(line, &wire_contact_layout, found->frame.t_us);
  }
#endif
#if FT_WITH_RAW_STREAM
  if (streams & WIRE_STREAM_RAW) {
    send_raw(stages, found, line);
  }
#endif
}

void stages_after_send(struct stages *stages, const struct findings *found, struct scan *scan) {
#if FT_WITH_TANGENTIAL
  port_set_activity(CRASH_AT_FIT);
  jobs_run_here(&stages->jobs, JOB_TANGENTIAL);
#endif
#if FT_WITH_SHAPES
  jobs_run_here(&stages->jobs, JOB_SHAPES);
#endif
  port_set_activity(CRASH_AT_CONDITION);
  if (found->frame.held) {
    return;
  }
  condition_stage_after_send(&stages->condition, found);
#if FT_WITH_FIT
  if (plausibility_follow(&stages->plausibility, &found->frame, &found->conditioned)) {
    readings_doubt(&scan->readings, stages->plausibility.apart);
  }
#endif
#if FT_WITH_TANGENTIAL_BIAS
  uncertainty_stage_after_send(&stages->uncertainty, &stages->location, found);
#endif
}

void stages_each_second(struct stages *stages, const struct findings *found) {
#if FT_WITH_FIT
  location_stage_set_force_scale(&stages->location, &stages->condition.condition, found->conditioned.tared, &stages->contact_settings);
#endif
#if FT_WITH_TANGENTIAL
  tangential_stage_use_scale(&stages->tangential, &stages->location, &stages->contact_settings);
#endif
}

void stages_each_round(struct stages *stages, uint64_t now_us, uint8_t streams, struct line *line) {
#if FT_WITH_SYNC
  sync_send_edges(&stages->sync, now_us, streams != 0, line);
#endif
}

void stages_on_event(const struct stages *stages, const struct scan *scan) {
#if FT_WITH_SYNC
  sync_show_scan(&stages->sync, scan);
#endif
}

/* Before what the jobs read changes, or the chip sleeps. */
static void forget_jobs(struct stages *stages) {
#if FT_WITH_TANGENTIAL
  jobs_cancel(&stages->jobs);
  tangential_stage_forget(&stages->tangential);
#endif
#if FT_WITH_SHAPES
  shapes_stage_forget(&stages->shapes);
#endif
}

void stages_pause(struct stages *stages, bool paused) {
  if (paused) {
    forget_jobs(stages);
  }
#if FT_WITH_SYNC
  sync_pause(&stages->sync, paused);
#endif
}

bool stages_need_fast_rounds(const struct stages *stages) {
#if FT_WITH_SYNC
  return sync_is_stamping(&stages->sync);
#else
  return false;
#endif
}

void stages_use_calibration(struct stages *stages, const struct findings *found, const struct calibration *calibration) {
  forget_jobs(stages);
#if FT_WITH_FIT
  condition_stage_use_calibration(&stages->condition, calibration);
  location_stage_use_calibration(&stages->location, calibration);
#endif
#if FT_WITH_SLIP
  slip_reset(&stages->slip); /* other gains move the location */
#endif
#if FT_WITH_TANGENTIAL_BIAS
  uncertainty_stage_forget_gains(&stages->uncertainty);
#endif
  stages_each_second(stages, found); /* the force scale */
}

void stages_use_profile(struct stages *stages, const struct pad_profile *profile) {
  forget_jobs(stages);
#if FT_WITH_TANGENTIAL
  tangential_stage_use_profile(&stages->tangential, profile);
#if FT_WITH_SHAPES
  shapes_stage_use_profile(&stages->shapes, stages->tangential.profile);
#endif
  location_stage_use_profile(&stages->location, stages->tangential.profile != NULL);
  tangential_stage_use_scale(&stages->tangential, &stages->location, &stages->contact_settings);
  motion_reset(&stages->motion);
#endif
}

void stages_use_stored_pad(struct stages *stages, const struct findings *found, const struct store_content *content) {
  stages_use_calibration(stages, found, content->has_calibration ? &content->calibration : NULL);
  stages_use_profile(stages, content->has_profile ? &content->profile : NULL);
}

#if FT_WITH_SLIP
static enum ft_status set_slip(struct stages *stages, float threshold_mm, uint16_t window_ms) {
  if (!(threshold_mm >= WIRE_SLIP_THRESHOLD_MIN_mm && threshold_mm <= WIRE_SLIP_THRESHOLD_MAX_mm) || window_ms < WIRE_SLIP_WINDOW_MIN_ms ||
      window_ms > WIRE_SLIP_WINDOW_MAX_ms) {
    return FT_ERR_ARGUMENT;
  }
  stages->contact_settings.slip_threshold_mm = threshold_mm;
  stages->contact_settings.slip_window_us = window_ms * 1000u;
  slip_reset(&stages->slip);
  return FT_OK;
}
#endif

void stages_use_settings(struct stages *stages, const struct store_settings *settings) {
#if FT_WITH_SLIP
  set_slip(stages, settings->slip_threshold_mm, settings->slip_window_ms);
#endif
#if FT_WITH_FIT
  location_stage_set_prior(&stages->location, settings->prior_sigma_mm, settings->prior_width_mm);
  location_stage_set_limit(&stages->location, settings->location_limit_mm);
#endif
#if FT_WITH_SYNC
  sync_set(&stages->sync, (uint8_t)settings->sync);
#endif
}

void stages_get_settings(const struct stages *stages, struct store_settings *settings) {
#if FT_WITH_SLIP
  settings->slip_threshold_mm = stages->contact_settings.slip_threshold_mm;
  settings->slip_window_ms = (uint16_t)(stages->contact_settings.slip_window_us / 1000u);
#endif
#if FT_WITH_FIT
  settings->prior_sigma_mm = stages->location.prior_sigma_mm;
  settings->prior_width_mm = stages->location.prior_sd_mm;
  settings->location_limit_mm = stages->location.settings.location_sd_limit_mm;
#endif
#if FT_WITH_SYNC
  settings->sync = stages->sync.mode;
#endif
}

const struct wire_layout *const stages_commands[] = {WIRE_COMMANDS,
#if FT_WITH_FIT
                                                     WIRE_COMMANDS_OF_FIT,
#endif
#if FT_WITH_SLIP
                                                     WIRE_COMMANDS_OF_SLIP,
#endif
#if FT_WITH_TANGENTIAL
                                                     WIRE_COMMANDS_OF_TANGENTIAL,
#endif
#if FT_WITH_SYNC
                                                     WIRE_COMMANDS_OF_SYNC,
#endif
                                                     NULL};

#if FT_WITH_FIT
static enum ft_status store_calibration(struct store *store, const struct wire_cmd_calibrate *command) {
  if (command->sensor_count != geometry.sensor_count || !calibration_is_valid(&command->calibration, geometry.sensor_count)) {
    return FT_ERR_ARGUMENT;
  }
  return store_put_calibration(store, &command->calibration);
}
#endif

#if FT_WITH_TANGENTIAL
static enum ft_status store_profile(struct store *store, const struct pad_profile *profile) {
  return pad_profile_is_valid(profile) ? store_put_profile(store, profile) : FT_ERR_ARGUMENT;
}
#endif

enum ft_status stages_execute(struct stages *stages, const struct wire_packet *command, struct store *store) {
  switch (command->type) {
#if FT_WITH_SLIP
  case WIRE_CMD_SLIP: return set_slip(stages, command->body.cmd_slip.threshold_mm, command->body.cmd_slip.window_ms);
#endif
#if FT_WITH_FIT
  case WIRE_CMD_CALIBRATE: return store_calibration(store, &command->body.cmd_calibrate);
  case WIRE_CMD_ERASE_CALIBRATION: return store_put_calibration(store, NULL);
  case WIRE_CMD_PRIOR:
    return location_stage_set_prior(&stages->location, command->body.cmd_prior.sigma_mm, command->body.cmd_prior.width_mm);
  case WIRE_CMD_LOCATION_LIMIT: return location_stage_set_limit(&stages->location, command->body.cmd_location_limit.limit_mm);
#endif
#if FT_WITH_TANGENTIAL
  case WIRE_CMD_PAD: return store_profile(store, &command->body.cmd_pad.profile);
  case WIRE_CMD_ERASE_PAD: return store_put_profile(store, NULL);
#endif
#if FT_WITH_SYNC
  case WIRE_CMD_SYNC: return sync_set(&stages->sync, command->body.cmd_sync.mode);
#endif
  default: return FT_ERR_TYPE;
  }
}

static uint32_t second_processor(const struct stages *stages) {
#if FT_WITH_TANGENTIAL
  return stages->jobs.has_processor ? WIRE_CAPABILITY_SECOND : 0;
#else
  (void)stages;
  return 0;
#endif
}

void stages_fill_info(const struct stages *stages, struct wire_info *info) {
  info->capabilities |= second_processor(stages);
#if FT_WITH_FIT
  const struct location_stage *location = &stages->location;
  info->fit_iterations = location->settings.iterations;
  info->prior_sigma_mm = location->prior_sigma_mm;
  info->prior_width_mm = location->prior_sd_mm;
  info->location_limit_mm = location->settings.location_sd_limit_mm;
  if (location->calibration) {
    info->stored |= WIRE_STORED_CALIBRATION;
    info->calibration = *location->calibration;
  }
#endif
#if FT_WITH_SLIP
  info->slip_window_ms = (uint16_t)(stages->contact_settings.slip_window_us / 1000u);
  info->slip_threshold_mm = stages->contact_settings.slip_threshold_mm;
#endif
#if FT_WITH_SYNC
  info->sync = stages->sync.mode;
#endif
#if FT_WITH_TANGENTIAL
  if (stages->tangential.profile) {
    info->stored |= WIRE_STORED_PAD;
    info->pad = *stages->tangential.profile;
  }
#endif
}

void stages_fill_health(const struct stages *stages, struct wire_health *health) {
  health->capabilities |= second_processor(stages);
#if FT_WITH_FIT
  health->fit_failures = stages->location.failures;
#endif
}
