#include "app/commands.h"

#include "app/app.h"
#include "app/status.h"
#include "common/contact_flags.h"
#include "config/defaults.h"
#include "port/port.h"
#include "usb/cdc.h"

/* Time for an acknowledgement to reach the host before the device leaves for the loader. */
#define LOADER_DELAY_us 50000u

enum {
  STREAMS = (FT_WITH_FIT ? WIRE_STREAM_CONTACT : 0) | (FT_WITH_RAW_STREAM ? WIRE_STREAM_RAW : 0) | WIRE_STREAM_HEALTH,
};

static enum ft_status set_rate(struct app *app, uint32_t rate_mHz) {
  if (rate_mHz != 0 && (rate_mHz < WIRE_RATE_MIN_mHz || rate_mHz > WIRE_RATE_MAX_mHz)) {
    return FT_ERR_ARGUMENT;
  }
  app->commands.rate_mHz = rate_mHz;
  scan_set_rate_mHz(&app->scan, rate_mHz);
  return FT_OK;
}

static enum ft_status set_osr(struct app *app, uint16_t osr) {
  if (scan_set_osr(&app->scan, osr) != FT_OK) {
    return FT_ERR_ARGUMENT;
  }
  app->commands.osr = osr;
  return FT_OK;
}

void commands_start(struct app *app) {
  const struct store_content *content = &app->store.content;
  app->commands.osr = DEFAULT_OSR;
  app->commands.rate_mHz = DEFAULT_RATE_mHz;
  stages_use_stored_pad(&app->stages, &app->found, content);
  if (content->has_settings) {
    set_rate(app, content->settings.rate_mHz);
    set_osr(app, content->settings.osr);
    stages_use_settings(&app->stages, &content->settings);
  }
  wire_receiver_init(&app->line.receiver, stages_commands);
}

static enum ft_status keep_settings(struct app *app, uint8_t keep) {
  if (keep > 1) {
    return FT_ERR_ARGUMENT;
  }
  struct store_settings settings = app->store.content.settings;
  if (!app->store.content.has_settings) {
    settings.prior_width_mm = -1.0f; /* not set, where no stage sets it: 0 would be the wish to have none */
  }
  settings.rate_mHz = app->commands.rate_mHz;
  settings.osr = app->commands.osr;
  stages_get_settings(&app->stages, &settings);
  return store_put_settings(&app->store, keep ? &settings : NULL);
}

static enum ft_status tare(struct app *app, uint8_t force) {
  if (force > 1) {
    return FT_ERR_ARGUMENT;
  }
  if (scan_read_map(&app->scan.admitted) == 0 || (app->found.conditioned.contact && !force)) {
    return FT_ERR_BUSY;
  }
  condition_tare(&app->stages.condition.condition);
  /* A held frame may come first: it repeats only what stays true. */
  app->found.contact.flags &= CONTACT_FLAG_CALIBRATED | CONTACT_FLAG_SENSOR_MASKED;
  app->found.conditioned.contact = false;
  return FT_OK;
}

static enum ft_status set_streams(struct commands *commands, uint8_t streams) {
  if (streams & ~STREAMS) {
    return FT_ERR_ARGUMENT;
  }
  commands->streams = streams;
  return FT_OK;
}

void commands_plan_loader(struct commands *commands, uint64_t now_us) { commands->loader_at_us = now_us + LOADER_DELAY_us; }

static enum ft_status obey(struct app *app, const struct wire_packet *command, uint64_t now_us) {
  switch (command->type) {
  case WIRE_CMD_STREAM: return set_streams(&app->commands, command->body.cmd_stream.streams);
  case WIRE_CMD_TARE: return tare(app, command->body.cmd_tare.force);
  case WIRE_CMD_RATE: return set_rate(app, command->body.cmd_rate.rate_mHz);
  case WIRE_CMD_OSR: return set_osr(app, command->body.cmd_osr.osr);
  case WIRE_CMD_KEEP: return keep_settings(app, command->body.cmd_keep.keep);
  case WIRE_CMD_INFO:
  case WIRE_CMD_HEALTH:
  case WIRE_CMD_CRASH: return FT_OK;
  case WIRE_CMD_LOADER:
    if (command->body.cmd_loader.magic != WIRE_LOADER_MAGIC) {
      return FT_ERR_ARGUMENT;
    }
    commands_plan_loader(&app->commands, now_us);
    return FT_OK;
  default: return stages_execute(&app->stages, command, &app->store);
  }
}

static enum wire_result result_of(enum ft_status status) {
  switch (status) {
  case FT_OK: return WIRE_RESULT_DONE;
  case FT_ERR_ARGUMENT: return WIRE_RESULT_OUT_OF_RANGE;
  case FT_ERR_TYPE: return WIRE_RESULT_UNKNOWN_COMMAND;
  default: return WIRE_RESULT_NOT_NOW;
  }
}

static void acknowledge(struct app *app, const struct wire_ack *ack, uint64_t now_us) {
  app->line.packet.body.ack = *ack;
  line_send(&app->line, &wire_ack_layout, now_us);
  if (ack->result == WIRE_RESULT_DONE) {
    app->commands.done++;
  } else {
    app->commands.rejected++;
  }
}

/* app->line.packet holds the command and is used up. Not part of commands_receive, whose stack lies below that of the decoder. */
static __attribute__((noinline)) void answer_command(struct app *app, uint64_t now_us) {
  const struct wire_packet *command = &app->line.packet;
  struct wire_ack ack = {.command = command->type, .sequence = command->sequence, .host_time_us = command->t_us};
  port_log_event(CRASH_EVENT_COMMAND, ack.command);
  const enum ft_status status = obey(app, command, now_us);
  if (status == FT_PENDING) {
    app->commands.pending = ack;
    return;
  }
  ack.result = (uint8_t)result_of(status);
  acknowledge(app, &ack, now_us);
  if (status != FT_OK) {
    return;
  }
  if (ack.command == WIRE_CMD_INFO) {
    status_send_info(app, now_us);
  } else if (ack.command == WIRE_CMD_HEALTH) {
    status_send_health(app, now_us);
  } else if (ack.command == WIRE_CMD_CRASH) {
    status_send_crash(&app->line, now_us);
  }
}

void commands_poll_store(struct app *app, uint64_t now_us) {
  if (!store_is_writing(&app->store)) {
    return;
  }
  port_set_activity(CRASH_AT_STORE);
  const enum ft_status status = store_poll(&app->store, now_us);
  if (status == FT_PENDING) {
    return;
  }
  port_log_event(CRASH_EVENT_STORED, status != FT_OK);
  if (status == FT_OK && app->store.pad_changes) {
    stages_use_stored_pad(&app->stages, &app->found, &app->store.content);
  }
  if (app->commands.pending.command != 0) {
    app->commands.pending.result = status == FT_OK ? WIRE_RESULT_DONE : WIRE_RESULT_NOT_NOW;
    acknowledge(app, &app->commands.pending, now_us);
    app->commands.pending.command = 0;
  }
}

bool commands_receive(struct app *app) {
  uint8_t bytes[64];
  const size_t count = cdc_read(bytes, sizeof bytes);
  for (size_t i = 0; i < count; i++) {
    const enum ft_status status = wire_receive(&app->line.receiver, bytes[i], &app->line.packet);
    if (status == FT_OK || status == FT_ERR_TYPE) {
      answer_command(app, port_now_us());
    } else if (status != FT_PENDING) {
      app->commands.rejected++;
    }
  }
  return count > 0;
}

void commands_end_session(struct app *app) {
  app->commands.streams = 0;
  app->commands.pending.command = 0;
  wire_receiver_init(&app->line.receiver, stages_commands);
}
