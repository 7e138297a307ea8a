#include "app/status.h"

#include "config/build_info.h"
#include "config/geometry.h"
#include "port/port.h"

#include <string.h>

enum {
  CAPABILITIES = (FT_WITH_FIT ? WIRE_CAPABILITY_FIT : 0) | (FT_WITH_SLIP ? WIRE_CAPABILITY_SLIP : 0) |
                 (FT_WITH_RAW_STREAM ? WIRE_CAPABILITY_RAW_STREAM : 0) | (FT_WITH_TANGENTIAL ? WIRE_CAPABILITY_TANGENTIAL : 0) |
                 (FT_WITH_SYNC ? WIRE_CAPABILITY_SYNC : 0),
};

static void copy_text(char to[WIRE_TEXT_BYTES], const char *from) {
  memset(to, 0, WIRE_TEXT_BYTES);
  for (int i = 0; i < WIRE_TEXT_BYTES && from[i]; i++) {
    to[i] = from[i];
  }
}

void status_send_info(struct app *app, uint64_t now_us) {
  struct wire_info *info = &app->line.packet.body.info;
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
  info->rate_mHz = app->commands.rate_mHz;
  info->measured_rate_mHz = app->statistics.rate_mHz;
  info->osr = app->commands.osr;
  info->temperature_interval_ms = SCAN_TEMPERATURE_INTERVAL_ms;
  info->streams = app->commands.streams;
  info->pitch_mm = geometry.pitch_mm;
  memcpy(info->x_mm, geometry.x_mm, sizeof info->x_mm);
  memcpy(info->y_mm, geometry.y_mm, sizeof info->y_mm);
  info->stored |= app->store.content.has_settings ? (uint32_t)WIRE_STORED_SETTINGS : 0;
  info->stored |= store_is_writing(&app->store) ? (uint32_t)WIRE_STORED_WRITING : 0;
  info->stored |= app->store.damaged ? (uint32_t)WIRE_STORED_DAMAGED : 0;
  stages_fill_info(&app->stages, info);
  line_send(&app->line, &wire_info_layout, now_us);
}

void status_send_health(struct app *app, uint64_t now_us) {
  const struct scan *scan = &app->scan;
  const struct scan_counters *counters = &scan->counters;
  const size_t stack_free = port_stack_free_bytes();
  struct wire_health *health = &app->line.packet.body.health;
  *health = (struct wire_health){
      .capabilities = CAPABILITIES,
      .uptime_s = app->statistics.uptime_s,
      .frames = scan_read(&counters->frames),
      .frames_incomplete = scan_read(&counters->frames_incomplete),
      .frames_skipped = scan_read(&counters->frames_skipped),
      .packets_sent = app->line.sent,
      .packets_dropped = app->line.dropped,
      .commands_done = app->commands.done,
      .commands_rejected = app->commands.rejected,
      .bus_nacks = scan_read(&counters->bus_nacks),
      .bus_timeouts = scan_read(&counters->bus_timeouts),
      .bus_recoveries = scan_read(&counters->bus_recoveries),
      .zero_readings = scan_read(&counters->zero_readings),
      .implausible_readings = scan_read(&counters->implausible_readings),
      .sensors_present = scan_read_map(&scan->present),
      .sensors_prom_bad = scan_read_map(&scan->prom_bad),
      .watchdog_resets = port_watchdog_resets(),
      .cpu_busy_permille = app->statistics.busy_permille,
      .stack_free_bytes = stack_free < UINT16_MAX ? (uint16_t)stack_free : UINT16_MAX,
  };
  stages_fill_health(&app->stages, health);
  line_send(&app->line, &wire_health_layout, now_us);
}

void status_send_crash(struct line *line, uint64_t now_us) {
  line->packet.body.crash = *port_last_crash();
  line_send(line, &wire_crash_layout, now_us);
}
