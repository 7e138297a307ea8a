#include "app/commands.h"

#include "app/acting.h"
#include "app/packets.h"
#include "app/sync.h"
#include "common/contact_flags.h"
#include "config/geometry.h"
#include "port/port.h"
#include "usb/cdc.h"

/* How often the main loop looks at the clock if nothing else wakes it: for the watchdog. */
#define TICK_us (PORT_WATCHDOG_PERIOD_us / 5u)
/* The same while something is being stored, which takes some fifty looks and an erase, and while
 * edges come. */
#define FAST_TICK_us 1000u

enum {
  STREAMS = (FT_WITH_FIT ? WIRE_STREAM_CONTACT : 0) | (FT_WITH_RAW_STREAM ? WIRE_STREAM_RAW : 0) | WIRE_STREAM_HEALTH,
};

static const struct wire_layout *const known_commands[] = {WIRE_COMMANDS,
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
static enum wire_result set_prior(struct app *app, float sigma_mm, float width_mm) {
  bool none = sigma_mm == 0.0f && width_mm == 0.0f;
  bool possible = sigma_mm >= WIRE_PRIOR_SIGMA_MIN_mm && sigma_mm <= WIRE_PRIOR_SIGMA_MAX_mm &&
                  width_mm >= WIRE_PRIOR_WIDTH_MIN_mm && width_mm <= WIRE_PRIOR_WIDTH_MAX_mm;
  if (!none && !possible) {
    return WIRE_RESULT_OUT_OF_RANGE;
  }
  app->set_sigma_mm = sigma_mm;
  app->set_sigma_sd_mm = width_mm;
  app_use_shape(app);
  return WIRE_RESULT_DONE;
}

static enum wire_result set_location_limit(struct app *app, float limit_mm) {
  if (!(limit_mm >= WIRE_LOCATION_LIMIT_MIN_mm && limit_mm <= WIRE_LOCATION_LIMIT_MAX_mm)) {
    return WIRE_RESULT_OUT_OF_RANGE;
  }
  app->fit_settings.location_sd_limit_mm = limit_mm;
  return WIRE_RESULT_DONE;
}
#endif

#if FT_WITH_SLIP
static enum wire_result set_slip(struct app *app, float threshold_mm, uint16_t window_ms) {
  if (!(threshold_mm >= WIRE_SLIP_THRESHOLD_MIN_mm && threshold_mm <= WIRE_SLIP_THRESHOLD_MAX_mm) ||
      window_ms < WIRE_SLIP_WINDOW_MIN_ms || window_ms > WIRE_SLIP_WINDOW_MAX_ms) {
    return WIRE_RESULT_OUT_OF_RANGE;
  }
  app->contact_settings.slip_threshold_mm = threshold_mm;
  app->contact_settings.slip_window_us = window_ms * 1000u;
  slip_reset(&app->slip_history);
  return WIRE_RESULT_DONE;
}
#endif

static enum wire_result set_rate(struct app *app, uint32_t rate_mHz) {
  if (rate_mHz != 0 && (rate_mHz < WIRE_RATE_MIN_mHz || rate_mHz > WIRE_RATE_MAX_mHz)) {
    return WIRE_RESULT_OUT_OF_RANGE;
  }
  app->rate_mHz = rate_mHz;
  scan_set_rate_mHz(&app->scan, rate_mHz);
  return WIRE_RESULT_DONE;
}

static enum wire_result set_osr(struct app *app, uint16_t osr) {
  if (scan_set_osr(&app->scan, osr) != FT_OK) {
    return WIRE_RESULT_OUT_OF_RANGE;
  }
  app->osr = osr;
  return WIRE_RESULT_DONE;
}

void commands_set_pace(struct app *app) {
  bool is_fast = store_is_writing(&app->store);
#if FT_WITH_SYNC
  is_fast = is_fast || sync_is_stamping(app);
#endif
  atomic_store_explicit(&app->tick_interval_us, is_fast ? FAST_TICK_us : TICK_us, memory_order_relaxed);
  if (is_fast) { /* the alarm that is armed would come too late */
    port_alarm_at_us(port_now_us());
  }
}

#if FT_WITH_SYNC
static enum wire_result set_sync(struct app *app, uint8_t mode) {
  if (!sync_set(app, mode)) {
    return WIRE_RESULT_OUT_OF_RANGE;
  }
  commands_set_pace(app);
  return WIRE_RESULT_DONE;
}
#endif

#if FT_WITH_FIT
/* What is kept of the pad acts. */
static void use_stored_pad(struct app *app) {
  const struct store_content *content = &app->store.content;
  app_use_calibration(app, content->has_calibration ? &content->calibration : NULL);
#if FT_WITH_TANGENTIAL
  app_use_pad(app, content->has_profile ? &content->profile : NULL);
#endif
}
#endif

/* What the firmware has learnt since to refuse stays as it is. */
static void use_stored(struct app *app) {
  const struct store_content *content = &app->store.content;
  const struct store_settings *settings = &content->settings;
#if FT_WITH_FIT
  use_stored_pad(app);
#endif
  if (!content->has_settings) {
    return;
  }
  set_rate(app, settings->rate_mHz);
  set_osr(app, settings->osr);
#if FT_WITH_SLIP
  set_slip(app, settings->slip_threshold_mm, settings->slip_window_ms);
#endif
#if FT_WITH_FIT
  set_prior(app, settings->prior_sigma_mm, settings->prior_width_mm);
  set_location_limit(app, settings->location_limit_mm);
#endif
#if FT_WITH_SYNC
  set_sync(app, (uint8_t)settings->sync);
#endif
}

void commands_start(struct app *app) {
  use_stored(app);
  wire_receiver_init(&app->receiver, known_commands);
  commands_set_pace(app);
}

/* The result of a command whose acknowledgement has to wait. */
enum { LATER = -1 };

static int result_of_put(struct app *app, enum ft_status status) {
  commands_set_pace(app);
  return status == FT_PENDING ? LATER : status == FT_OK ? WIRE_RESULT_DONE : WIRE_RESULT_NOT_NOW;
}

#if FT_WITH_FIT
static int calibrate(struct app *app, const struct wire_cmd_calibrate *command) {
  if (command->sensor_count != geometry.sensor_count ||
      !calibration_is_valid(&command->calibration, geometry.sensor_count)) {
    return WIRE_RESULT_OUT_OF_RANGE;
  }
  return result_of_put(app, store_put_calibration(&app->store, &command->calibration));
}
#endif

#if FT_WITH_TANGENTIAL
static int put_pad(struct app *app, const struct pad_profile *profile) {
  if (!pad_profile_is_valid(profile)) {
    return WIRE_RESULT_OUT_OF_RANGE;
  }
  return result_of_put(app, store_put_profile(&app->store, profile));
}
#endif

static int keep_settings(struct app *app, uint8_t keep) {
  if (keep > 1) {
    return WIRE_RESULT_OUT_OF_RANGE;
  }
  struct store_settings settings = app->store.content.settings;
#if !FT_WITH_FIT
  if (!app->store.content.has_settings) {
    settings.prior_width_mm = -1.0f; /* no other firmware shall take it for the wish to have none */
  }
#endif
  settings.rate_mHz = app->rate_mHz;
  settings.osr = app->osr;
#if FT_WITH_SLIP
  settings.slip_threshold_mm = app->contact_settings.slip_threshold_mm;
  settings.slip_window_ms = (uint16_t)(app->contact_settings.slip_window_us / 1000u);
#endif
#if FT_WITH_FIT
  settings.prior_sigma_mm = app->set_sigma_mm;
  settings.prior_width_mm = app->set_sigma_sd_mm;
  settings.location_limit_mm = app->fit_settings.location_sd_limit_mm;
#endif
#if FT_WITH_SYNC
  settings.sync = app->sync.mode;
#endif
  return result_of_put(app, store_put_settings(&app->store, keep ? &settings : NULL));
}

static enum wire_result tare(struct app *app, uint8_t force) {
  if (force > 1) {
    return WIRE_RESULT_OUT_OF_RANGE;
  }
  if (read_counter(&app->scan.admitted) == 0 || (app->conditioned.contact && !force)) {
    return WIRE_RESULT_NOT_NOW;
  }
  condition_tare(&app->condition);
  /* A frame that is held may come first: of the one before it what stays true. */
  app->contact.flags &= CONTACT_FLAG_CALIBRATED | CONTACT_FLAG_SENSOR_MASKED;
  app->conditioned.contact = false;
  return WIRE_RESULT_DONE;
}

/* An enum wire_result, or LATER. */
static int obey(struct app *app, const struct wire_packet *command, uint64_t now_us) {
  switch (command->type) {
  case WIRE_CMD_STREAM:
    if (command->body.cmd_stream.streams & ~STREAMS) {
      return WIRE_RESULT_OUT_OF_RANGE;
    }
    app->streams = command->body.cmd_stream.streams;
    return WIRE_RESULT_DONE;
  case WIRE_CMD_TARE:
    return tare(app, command->body.cmd_tare.force);
  case WIRE_CMD_RATE:
    return set_rate(app, command->body.cmd_rate.rate_mHz);
  case WIRE_CMD_OSR:
    return set_osr(app, command->body.cmd_osr.osr);
#if FT_WITH_SLIP
  case WIRE_CMD_SLIP:
    return set_slip(app, command->body.cmd_slip.threshold_mm, command->body.cmd_slip.window_ms);
#endif
#if FT_WITH_FIT
  case WIRE_CMD_CALIBRATE:
    return calibrate(app, &command->body.cmd_calibrate);
  case WIRE_CMD_ERASE_CALIBRATION:
    return result_of_put(app, store_put_calibration(&app->store, NULL));
  case WIRE_CMD_PRIOR:
    return set_prior(app, command->body.cmd_prior.sigma_mm, command->body.cmd_prior.width_mm);
  case WIRE_CMD_LOCATION_LIMIT:
    return set_location_limit(app, command->body.cmd_location_limit.limit_mm);
#endif
#if FT_WITH_TANGENTIAL
  case WIRE_CMD_PAD:
    return put_pad(app, &command->body.cmd_pad.profile);
  case WIRE_CMD_ERASE_PAD:
    return result_of_put(app, store_put_profile(&app->store, NULL));
#endif
#if FT_WITH_SYNC
  case WIRE_CMD_SYNC:
    return set_sync(app, command->body.cmd_sync.mode);
#endif
  case WIRE_CMD_KEEP:
    return keep_settings(app, command->body.cmd_keep.keep);
  case WIRE_CMD_INFO:
  case WIRE_CMD_HEALTH:
  case WIRE_CMD_CRASH:
    return WIRE_RESULT_DONE;
  case WIRE_CMD_LOADER:
    if (command->body.cmd_loader.magic != WIRE_LOADER_MAGIC) {
      return WIRE_RESULT_OUT_OF_RANGE;
    }
    app->loader_at_us = now_us + LOADER_DELAY_us;
    return WIRE_RESULT_DONE;
  default:
    return WIRE_RESULT_UNKNOWN_COMMAND;
  }
}

static void acknowledge(struct app *app, const struct wire_ack *ack, uint64_t now_us) {
  packets_send_ack(app, ack, now_us);
  if (ack->result == WIRE_RESULT_DONE) {
    app->commands_done++;
  } else {
    app->commands_rejected++;
  }
}

/* app->packet holds the command and is used up. */
static void answer_command(struct app *app, uint64_t now_us) {
  struct wire_ack ack = {
      .command = app->packet.type, .sequence = app->packet.sequence, .host_time_us = app->packet.t_us};
  port_event(CRASH_EVENT_COMMAND, ack.command);
  int result = obey(app, &app->packet, now_us);
  if (result == LATER) {
    app->owed = ack;
    return;
  }
  ack.result = (uint8_t)result;
  acknowledge(app, &ack, now_us);
  if (result != WIRE_RESULT_DONE) {
    return;
  }
  if (ack.command == WIRE_CMD_INFO) {
    packets_send_info(app, now_us);
  } else if (ack.command == WIRE_CMD_HEALTH) {
    packets_send_health(app, now_us);
  } else if (ack.command == WIRE_CMD_CRASH) {
    packets_send_crash(app, now_us);
  }
}

void commands_follow_store(struct app *app, uint64_t now_us) {
  if (!store_is_writing(&app->store)) {
    return;
  }
  port_at(CRASH_AT_STORE);
  enum ft_status status = store_poll(&app->store, now_us);
  if (status == FT_PENDING) {
    return;
  }
  commands_set_pace(app);
  port_event(CRASH_EVENT_STORED, status != FT_OK);
#if FT_WITH_FIT
  use_stored_pad(app);
#endif
  if (app->owed.command != 0) {
    app->owed.result = status == FT_OK ? WIRE_RESULT_DONE : WIRE_RESULT_NOT_NOW;
    acknowledge(app, &app->owed, now_us);
    app->owed.command = 0;
  }
}

bool commands_receive(struct app *app) {
  uint8_t bytes[64];
  size_t count = cdc_read(bytes, sizeof bytes);
  for (size_t i = 0; i < count; i++) {
    enum ft_status status = wire_receive(&app->receiver, bytes[i], &app->packet);
    if (status == FT_OK || status == FT_ERR_TYPE) {
      answer_command(app, port_now_us());
    } else if (status != FT_PENDING) {
      app->commands_rejected++;
    }
  }
  return count > 0;
}

void commands_end_session(struct app *app) {
  app->streams = 0;
  app->owed.command = 0;
  wire_receiver_init(&app->receiver, known_commands);
}
