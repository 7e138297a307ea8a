#include "app/packets.h"

#include "common/contact_flags.h"
#include "config/build_info.h"
#include "config/geometry.h"
#include "port/port.h"
#include "usb/cdc.h"

#include <string.h>

enum {
  CAPABILITIES = (FT_WITH_FIT ? WIRE_CAPABILITY_FIT : 0) | (FT_WITH_SLIP ? WIRE_CAPABILITY_SLIP : 0) |
                 (FT_WITH_RAW_STREAM ? WIRE_CAPABILITY_RAW_STREAM : 0) |
                 (FT_WITH_TANGENTIAL ? WIRE_CAPABILITY_TANGENTIAL : 0) | (FT_WITH_SYNC ? WIRE_CAPABILITY_SYNC : 0),
};

/* Sends app->packet. A sequence number is spent even when the queue is full: the gap tells. */
static void send_packet(struct app *app, const struct wire_layout *layout, uint64_t t_us) {
  size_t length;
  app->packet.sequence = app->sequence++;
  app->packet.t_us = t_us;
  bool sent = false;
  if (wire_encode(layout, &app->packet, app->out, &length) == FT_OK) {
    while (length % 4 != 0) { /* whole words are queued faster; more delimiters are legal */
      app->out[length++] = 0;
    }
    sent = cdc_write(app->out, length) == FT_OK;
  }
  if (sent) {
    app->packets_sent++;
  } else {
    app->packets_dropped++;
  }
}

static void copy_text(char to[WIRE_TEXT_BYTES], const char *from) {
  memset(to, 0, WIRE_TEXT_BYTES);
  for (int i = 0; i < WIRE_TEXT_BYTES && from[i]; i++) {
    to[i] = from[i];
  }
}

void packets_send_info(struct app *app, uint64_t now_us) {
  struct wire_info *info = &app->packet.body.info;
  memset(info, 0, sizeof *info);
  memcpy(info->firmware_version, build_info.version, sizeof info->firmware_version);
  info->sensor_count = geometry.sensor_count;
  info->capabilities = CAPABILITIES;
  copy_text(info->git_hash, build_info.git_hash);
  copy_text(info->board, build_info.board);
  copy_text(info->scene, build_info.scene);
  char serial[17];
  port_serial_number(serial);
  copy_text(info->serial, serial);
  info->rate_mHz = app->rate_mHz;
  info->measured_rate_mHz = app->measured_rate_mHz;
  info->osr = app->osr;
  info->temperature_interval_ms = SCAN_TEMPERATURE_INTERVAL_ms;
  info->streams = app->streams;
#if FT_WITH_FIT
  info->fit_iterations = app->fit_settings.iterations;
#endif
#if FT_WITH_SLIP
  info->slip_window_ms = (uint16_t)(app->contact_settings.slip_window_us / 1000u);
  info->slip_threshold_mm = app->contact_settings.slip_threshold_mm;
#endif
  info->pitch_mm = geometry.pitch_mm;
  memcpy(info->x_mm, geometry.x_mm, sizeof info->x_mm);
  memcpy(info->y_mm, geometry.y_mm, sizeof info->y_mm);
#if FT_WITH_FIT
  info->prior_sigma_mm = app->set_sigma_mm;
  info->prior_width_mm = app->set_sigma_sd_mm;
  info->location_limit_mm = app->fit_settings.location_sd_limit_mm;
  if (app->calibration) {
    info->stored |= WIRE_STORED_CALIBRATION;
    info->calibration = *app->calibration;
  }
#endif
#if FT_WITH_SYNC
  info->sync = app->sync.mode;
#endif
#if FT_WITH_TANGENTIAL
  if (app->pad) {
    info->stored |= WIRE_STORED_PAD;
    info->pad = *app->pad;
  }
#endif
  info->stored |= app->store.content.has_settings ? (uint32_t)WIRE_STORED_SETTINGS : 0;
  info->stored |= store_is_writing(&app->store) ? (uint32_t)WIRE_STORED_WRITING : 0;
  info->stored |= app->store.damaged ? (uint32_t)WIRE_STORED_DAMAGED : 0;
  send_packet(app, &wire_info_layout, now_us);
}

void packets_send_health(struct app *app, uint64_t now_us) {
  const struct scan *scan = &app->scan;
  size_t stack_free = port_stack_free_bytes();
  app->packet.body.health = (struct wire_health) {
    .capabilities = CAPABILITIES, .uptime_s = app->uptime_s, .frames = read_counter(&scan->counters.frames),
    .frames_incomplete = read_counter(&scan->counters.frames_incomplete),
    .frames_skipped = read_counter(&scan->counters.frames_skipped), .packets_sent = app->packets_sent,
    .packets_dropped = app->packets_dropped, .commands_done = app->commands_done,
    .commands_rejected = app->commands_rejected, .bus_nacks = read_counter(&scan->counters.bus_nacks),
    .bus_timeouts = read_counter(&scan->counters.bus_timeouts),
    .bus_recoveries = read_counter(&scan->counters.bus_recoveries),
    .zero_readings = read_counter(&scan->counters.zero_readings),
    .implausible_readings = read_counter(&scan->counters.implausible_readings),
    .sensors_present = read_counter(&scan->present), .sensors_prom_bad = read_counter(&scan->prom_bad),
    .watchdog_resets = port_watchdog_resets(), .cpu_busy_permille = app->cpu_busy_permille,
    .stack_free_bytes = saturate_u16(stack_free),
#if FT_WITH_FIT
    .fit_failures = app->fit_failures,
#endif
  };
  send_packet(app, &wire_health_layout, now_us);
}

void packets_send_crash(struct app *app, uint64_t now_us) {
  app->packet.body.crash = *port_last_crash();
  send_packet(app, &wire_crash_layout, now_us);
}

#if FT_WITH_RAW_STREAM
void packets_send_raw(struct app *app) {
  struct wire_raw *raw = &app->packet.body.raw;
  const struct frame *frame = &app->frame;
  raw->frame = frame->number;
  raw->flags = app->contact.flags;
  raw->valid = frame->held ? 0 : frame->valid;
  raw->saturated = frame->saturated;
  raw->doubtful = frame->held ? 0 : frame->doubtful;
  raw->temperature_cC = frame->temperature_cC;
  raw->sensor_count = frame->sensor_count;
  size_t length = frame->sensor_count * sizeof raw->pressure_Pa_q10[0];
  memcpy(raw->pressure_Pa_q10, frame->pressure_Pa_q10, length);
  memcpy(raw->baseline_Pa_q10, app->condition.zero_Pa_q10, length);
  send_packet(app, &wire_raw_layout, frame->t_us);
}
#endif

#if FT_WITH_SYNC
void packets_send_sync(struct app *app, const struct port_sync_edge *edge) {
  app->packet.body.sync = (struct wire_sync){.number = edge->number, .level = edge->number & 1u};
  send_packet(app, &wire_sync_layout, edge->t_us);
}
#endif

#if FT_WITH_TANGENTIAL
/* Where its flags are off this is zero. */
static void put_shape(const struct app *app, struct wire_contact *contact) {
  const struct shapes_report *shapes = &app->shapes;
  contact->shape_age_ms = shapes->shape ? 1e-3f * (float)(uint32_t)(app->frame.t_us - shapes->t_us) : 0.0f;
  contact->x1_mm = shapes->contact[0].x_mm;
  contact->y1_mm = shapes->contact[0].y_mm;
  contact->location1_sd_mm = shapes->contact[0].location_sd_mm;
  contact->force1_N = shapes->contact[0].force_N;
  contact->force1_sd_N = shapes->contact[0].force_sd_N;
  contact->x2_mm = shapes->contact[1].x_mm;
  contact->y2_mm = shapes->contact[1].y_mm;
  contact->location2_sd_mm = shapes->contact[1].location_sd_mm;
  contact->force2_N = shapes->contact[1].force_N;
  contact->force2_sd_N = shapes->contact[1].force_sd_N;
  contact->edge_angle_deg = shapes->edge_angle_deg;
  contact->edge_angle_sd_deg = shapes->edge_angle_sd_deg;
  contact->edge_length_mm = shapes->edge_length_mm;
}
#endif

#if FT_WITH_FIT
void packets_send_contact(struct app *app, const struct wire_stages *stages) {
  struct wire_contact *contact = &app->packet.body.contact;
  contact->frame = app->frame.number;
  contact->flags = app->contact.flags;
  contact->stages = *stages;
  contact->sensors_used = app->fit.used;
  contact->x_mm = app->fit.x_mm;
  contact->y_mm = app->fit.y_mm;
  contact->p0_Pa = app->fit.p0_Pa;
  contact->sigma_mm = app->fit.sigma_mm;
  contact->force_N = app->force.force_N;
  contact->residual_rms_Pa = app->fit.residual_rms_Pa;
  contact->location_sd_mm = app->fit.location_sd_mm;
  contact->force_sd_N = app->force.force_sd_N;
  contact->slip_mm = app->contact.slip_mm;
  contact->sigma_x_mm = app->fit.sigma_x_mm;
  contact->sigma_y_mm = app->fit.sigma_y_mm;
  contact->width_correlation = app->fit.width_correlation;
#if FT_WITH_TANGENTIAL
  if (app->contact.flags & CONTACT_FLAG_TANGENTIAL_VALID) {
    const struct tangential_load *load = &app->load;
    contact->force_N = load->force_N;
    contact->force_sd_N = load->force_sd_N;
    contact->qx_N = load->qx_N;
    contact->qy_N = load->qy_N;
    contact->q_sd_N = load->q_sd_N;
    contact->tangential_ratio = load->ratio;
  }
  contact->x_mm = app->place.x_mm;
  contact->y_mm = app->place.y_mm;
  contact->location_sd_mm = app->place.location_sd_mm;
  contact->vx_mm_s = app->motion.vx_mm_s;
  contact->vy_mm_s = app->motion.vy_mm_s;
  put_shape(app, contact);
#endif
  send_packet(app, &wire_contact_layout, app->frame.t_us);
}
#endif

void packets_send_ack(struct app *app, const struct wire_ack *ack, uint64_t now_us) {
  app->packet.body.ack = *ack;
  send_packet(app, &wire_ack_layout, now_us);
}
