#include "app/app.h"

#include "common/contact_flags.h"
#include "config/build_info.h"
#include "config/defaults.h"
#include "config/geometry.h"
#include "port/port.h"
#include "usb/cdc.h"

#include <string.h>

/* How often the main loop looks at the clock if nothing else wakes it: for the watchdog. */
#define TICK_us (PORT_WATCHDOG_PERIOD_us / 5u)
/* The same while something is being stored, which takes some fifty looks and an erase. */
#define STORE_TICK_us 1000u
/* So long the end of a second waits for a frame to follow, rather than keep one waiting. */
#define FRAME_WAIT_us 100000u
/* Up to this pitch the neighbours feel what one sensor feels: see READINGS_STILL_NOISES. */
#define SHARED_PITCH_mm 9.0f
/* Lets the acknowledgement out before the device leaves. */
#define LOADER_DELAY_us 50000u

enum {
  CAPABILITIES = (FT_WITH_FIT ? WIRE_CAPABILITY_FIT : 0) |
                 (FT_WITH_SLIP ? WIRE_CAPABILITY_SLIP : 0) |
                 (FT_WITH_RAW_STREAM ? WIRE_CAPABILITY_RAW_STREAM : 0),
  STREAMS = (FT_WITH_FIT ? WIRE_STREAM_CONTACT : 0) | (FT_WITH_RAW_STREAM ? WIRE_STREAM_RAW : 0) |
            WIRE_STREAM_HEALTH,
};

#if FT_WITH_FIT_GENERAL
#define INIT_FIT_ARRAY fit_array_init
#define FIT fit_gaussian
#else
#define INIT_FIT_ARRAY fit_array_init_grid
#define FIT fit_gaussian_grid
_Static_assert(DEFAULT_FIT_N_LARGEST == 0, "n_largest needs FINGERTIP_FIT_GENERAL");
#endif

#if FT_WITH_SLIP
#define COMMANDS wire_commands
#elif FT_WITH_FIT
#define COMMANDS wire_commands_without_slip
#else
#define COMMANDS wire_commands_without_fit
#endif

void app_on_event(struct app *app) {
  uint64_t now_us = port_now_us();
  uint64_t wake_us = scan_step(&app->scan, now_us);
  uint64_t tick_us = now_us + atomic_load_explicit(&app->tick_interval_us, memory_order_relaxed);
  if (now_us >= app->next_tick_us) {
    app->next_tick_us = tick_us;
    atomic_store_explicit(&app->tick, 1, memory_order_relaxed);
  } else if (tick_us < app->next_tick_us) { /* the interval has become shorter */
    app->next_tick_us = tick_us;
  }
  port_alarm_at_us(wake_us < app->next_tick_us ? wake_us : app->next_tick_us);
}

static uint32_t read_counter(const _Atomic uint32_t *counter) {
  return atomic_load_explicit(counter, memory_order_relaxed);
}

static uint16_t saturate_u16(uint64_t value) {
  return value < UINT16_MAX ? (uint16_t)value : UINT16_MAX;
}

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

#if FT_WITH_FIT
void app_use_calibration(struct app *app, const struct calibration *calibration) {
  app->calibration = calibration;
  for (unsigned k = 0; k < geometry.sensor_count; k++) {
    float gain = calibration ? calibration->sensors[k].gain : 1.0f;
    float gain_sd = calibration ? calibration->sensors[k].gain_sd : DEFAULT_GAIN_SD;
    app->gains.inverse_q16[k] = (uint32_t)(65536.0f / gain + 0.5f);
    app->fit_settings.gain_sd_q16[k] = (uint16_t)(gain_sd * 65536.0f + 0.5f);
  }
  app->contact_settings.force_scale = calibration ? calibration->force_scale : DEFAULT_FORCE_SCALE;
  app->contact_settings.force_scale_sd =
      calibration ? calibration->force_scale_sd : DEFAULT_FORCE_SCALE_SD;
}

static enum wire_result set_prior(struct app *app, float sigma_mm, float width_mm) {
  bool none = sigma_mm == 0.0f && width_mm == 0.0f;
  bool possible = sigma_mm >= WIRE_PRIOR_SIGMA_MIN_mm && sigma_mm <= WIRE_PRIOR_SIGMA_MAX_mm &&
                  width_mm >= WIRE_PRIOR_WIDTH_MIN_mm && width_mm <= WIRE_PRIOR_WIDTH_MAX_mm;
  if (!none && !possible) {
    return WIRE_RESULT_OUT_OF_RANGE;
  }
  app->fit_settings.prior_sigma_mm = sigma_mm;
  app->fit_settings.prior_width_mm = width_mm;
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

/* While something is being stored the main loop looks after it each millisecond. The alarm that is
 * armed would come too late for that. */
static void hurry_store(struct app *app, bool is_writing) {
  atomic_store_explicit(&app->tick_interval_us, is_writing ? STORE_TICK_us : TICK_us,
                        memory_order_relaxed);
  if (is_writing) {
    port_alarm_at_us(port_now_us());
  }
}

/* What the firmware has learnt since to refuse stays as it is. */
static void use_stored(struct app *app) {
  const struct store_content *content = &app->store.content;
  const struct store_settings *settings = &content->settings;
#if FT_WITH_FIT
  app_use_calibration(app, content->has_calibration ? &content->calibration : NULL);
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
}

void app_start(struct app *app, const struct array_bus *bus) {
  memset(app, 0, sizeof *app);
  const struct scan_settings scan_settings = {
      .sensor_count = geometry.sensor_count,
      .osr = DEFAULT_OSR,
      .rate_mHz = DEFAULT_RATE_mHz,
      .presses_are_shared = geometry.pitch_mm > 0.0f && geometry.pitch_mm <= SHARED_PITCH_mm,
  };
  if (scan_init(&app->scan, bus, &scan_settings) != FT_OK) {
    port_panic();
  }
  app->osr = DEFAULT_OSR;
  app->rate_mHz = DEFAULT_RATE_mHz;
#if FT_WITH_FIT
  if (INIT_FIT_ARRAY(&app->fit_array, geometry.sensor_count, geometry.x_mm, geometry.y_mm,
                     geometry.pitch_mm) != FT_OK) {
    port_panic();
  }
  app->fit_settings.iterations = DEFAULT_FIT_ITERATIONS;
  app->fit_settings.n_largest = DEFAULT_FIT_N_LARGEST;
  app->fit_settings.prior_sigma_mm = DEFAULT_PRIOR_SIGMA_mm;
  app->fit_settings.prior_width_mm = DEFAULT_PRIOR_WIDTH_mm;
  fit_set_errors(&app->fit_settings, DEFAULT_GAIN_SD, DEFAULT_MODEL_SD);
  app->fit_settings.location_sd_limit_mm = DEFAULT_LOCATION_LIMIT_mm;
#endif
#if FT_WITH_SLIP
  app->contact_settings.slip_threshold_mm = DEFAULT_SLIP_THRESHOLD_mm;
  app->contact_settings.slip_window_us = DEFAULT_SLIP_WINDOW_ms * 1000u;
#endif
  store_init(&app->store, geometry.sensor_count);
  use_stored(app);
  condition_tare(&app->condition);
  wire_receiver_init(&app->receiver, COMMANDS);
  app->active = true;

  static char serial[17];
  port_serial_number(serial);
  static const struct cdc_identity identity_template = {
      .vendor_id = FINGERTIP_USB_VID,
      .product_id = FINGERTIP_USB_PID,
      .manufacturer = "Fingertip",
      .product = "Fingertip tactile sensor",
  };
  static struct cdc_identity identity;
  identity = identity_template;
  identity.device_version_bcd =
      (uint16_t)(build_info.version[0] << 8 | build_info.version[1] << 4 | build_info.version[2]);
  identity.serial = serial;
  cdc_start(&identity);

  hurry_store(app, store_is_writing(&app->store));
  port_alarm_at_us(port_now_us());
}

static void copy_text(char to[WIRE_TEXT_BYTES], const char *from) {
  memset(to, 0, WIRE_TEXT_BYTES);
  for (int i = 0; i < WIRE_TEXT_BYTES && from[i]; i++) {
    to[i] = from[i];
  }
}

static void send_info(struct app *app, uint64_t now_us) {
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
  info->prior_sigma_mm = app->fit_settings.prior_sigma_mm;
  info->prior_width_mm = app->fit_settings.prior_width_mm;
  info->location_limit_mm = app->fit_settings.location_sd_limit_mm;
  if (app->calibration) {
    info->stored |= WIRE_STORED_CALIBRATION;
    info->calibration = *app->calibration;
  }
#endif
  info->stored |= app->store.content.has_settings ? (uint32_t)WIRE_STORED_SETTINGS : 0;
  info->stored |= store_is_writing(&app->store) ? (uint32_t)WIRE_STORED_WRITING : 0;
  info->stored |= app->store.damaged ? (uint32_t)WIRE_STORED_DAMAGED : 0;
  send_packet(app, &wire_info_layout, now_us);
}

static void send_health(struct app *app, uint64_t now_us) {
  const struct scan *scan = &app->scan;
  size_t stack_free = port_stack_free_bytes();
  app->packet.body.health = (struct wire_health) {
    .capabilities = CAPABILITIES, .uptime_s = app->uptime_s,
    .frames = read_counter(&scan->counters.frames),
    .frames_incomplete = read_counter(&scan->counters.frames_incomplete),
    .frames_skipped = read_counter(&scan->counters.frames_skipped),
    .packets_sent = app->packets_sent, .packets_dropped = app->packets_dropped,
    .commands_done = app->commands_done, .commands_rejected = app->commands_rejected,
    .bus_nacks = read_counter(&scan->counters.bus_nacks),
    .bus_timeouts = read_counter(&scan->counters.bus_timeouts),
    .bus_recoveries = read_counter(&scan->counters.bus_recoveries),
    .zero_readings = read_counter(&scan->counters.zero_readings),
    .implausible_readings = read_counter(&scan->counters.implausible_readings),
    .sensors_present = read_counter(&scan->present),
    .sensors_prom_bad = read_counter(&scan->prom_bad),
    .watchdog_resets = port_started_by_watchdog() ? 1 : 0,
    .cpu_busy_permille = app->cpu_busy_permille, .stack_free_bytes = saturate_u16(stack_free),
#if FT_WITH_FIT
    .fit_failures = app->fit_failures,
#endif
  };
  send_packet(app, &wire_health_layout, now_us);
}

#if FT_WITH_RAW_STREAM
static void send_raw(struct app *app) {
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

#if FT_WITH_FIT
static void send_contact(struct app *app, const struct wire_stages *stages) {
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
  send_packet(app, &wire_contact_layout, app->frame.t_us);
}

static void fit_frame(struct app *app) {
  memset(&app->fit, 0, sizeof app->fit);
  if (!app->conditioned.contact) {
    return;
  }
  app->fit_settings.noise_Pa_q10 = app->frame.noise_Pa_q10;
  FIT(&app->fit_array, app->conditioned.pressure_Pa_q10, app->conditioned.usable,
      &app->fit_settings, &app->fit);
  if (!(app->fit.flags & CONTACT_FLAG_FIT_VALID)) {
    app->fit_failures++;
  }
}
#endif

static bool is_sensor_doubtful(const struct app *app) {
  return (app->frame.doubtful & app->conditioned.usable) != 0;
}

static void judge_frame(struct app *app) {
  const struct frame *frame = &app->frame;
  const struct contact_input input = {
    .t_us = frame->t_us,
    .contact = app->conditioned.contact,
    .tared = app->conditioned.tared,
    .zero_doubtful = app->conditioned.zero_doubtful,
    .sensor_doubtful = is_sensor_doubtful(app),
    .masked = app->conditioned.usable != UINT32_MAX >> (FT_MAX_SENSORS - frame->sensor_count),
    .saturated = frame->saturated,
#if FT_WITH_FIT
    .fit = app->conditioned.contact ? &app->fit : NULL,
    .calibrated = app->calibration != NULL,
#endif
  };
#if FT_WITH_FIT
  app->force = contact_weigh(&app->contact_settings, &app->fit);
#endif
#if FT_WITH_SLIP
  contact_update(&app->slip_history, &app->contact_settings, &input, &app->contact);
#else
  contact_judge(&input, &app->contact);
#endif
}

void app_process_frame(struct app *app, uint64_t taken_us) {
  const struct frame *frame = &app->frame;
  if (taken_us < frame->t_read_us) { /* it came between the look at the clock and the taking */
    taken_us = frame->t_read_us;
  }
  if (!frame->held) {
#if FT_WITH_FIT
    const struct condition_gains *gains = app->calibration ? &app->gains : NULL;
#else
    const struct condition_gains *gains = NULL; /* nothing here tells how hard or where */
#endif
    condition_frame(&app->condition, frame, gains, &app->conditioned);
  }
#if FT_WITH_FIT
  uint64_t conditioned_us = port_now_us();
  if (!frame->held) {
    fit_frame(app);
  }
  uint64_t fitted_us = port_now_us();
#endif
  if (frame->held) {
    app->contact.flags |= CONTACT_FLAG_HELD;
    app->contact.flags |= is_sensor_doubtful(app) ? (uint32_t)CONTACT_FLAG_SENSOR_DOUBTFUL : 0;
  } else {
    judge_frame(app);
  }
#if FT_WITH_FIT
  uint64_t judged_us = port_now_us();
  const struct wire_stages stages = {
      .convert_us = saturate_u16(frame->t_converted_us - frame->t_begin_us),
      .read_us = saturate_u16(frame->t_read_us - frame->t_converted_us),
      .queue_us = saturate_u16(taken_us - frame->t_read_us),
      .condition_us = saturate_u16(conditioned_us - taken_us),
      .fit_us = saturate_u16(fitted_us - conditioned_us),
      .contact_us = saturate_u16(judged_us - fitted_us),
      .total_us = saturate_u16(judged_us - frame->t_begin_us),
  };
  if (app->streams & WIRE_STREAM_CONTACT) {
    send_contact(app, &stages);
  }
#endif
#if FT_WITH_RAW_STREAM
  if (app->streams & WIRE_STREAM_RAW) {
    send_raw(app);
  }
#endif
  if (!frame->held) {
    condition_follow(&app->condition, frame, &app->conditioned);
  }
}

/* The result of a command whose acknowledgement has to wait. */
enum { LATER = -1 };

static int result_of_put(struct app *app, enum ft_status status) {
  hurry_store(app, store_is_writing(&app->store));
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
  settings.prior_sigma_mm = app->fit_settings.prior_sigma_mm;
  settings.prior_width_mm = app->fit_settings.prior_width_mm;
  settings.location_limit_mm = app->fit_settings.location_sd_limit_mm;
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
  case WIRE_CMD_KEEP:
    return keep_settings(app, command->body.cmd_keep.keep);
  case WIRE_CMD_INFO:
  case WIRE_CMD_HEALTH:
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
  app->packet.body.ack = *ack;
  send_packet(app, &wire_ack_layout, now_us);
  if (ack->result == WIRE_RESULT_DONE) {
    app->commands_done++;
  } else {
    app->commands_rejected++;
  }
}

/* app->packet holds the command and is used up. */
static void answer_command(struct app *app, uint64_t now_us) {
  struct wire_ack ack = {.command = app->packet.type,
                         .sequence = app->packet.sequence,
                         .host_time_us = app->packet.t_us};
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
    send_info(app, now_us);
  } else if (ack.command == WIRE_CMD_HEALTH) {
    send_health(app, now_us);
  }
}

static void follow_store(struct app *app, uint64_t now_us) {
  if (!store_is_writing(&app->store)) {
    return;
  }
  enum ft_status status = store_poll(&app->store, now_us);
  if (status == FT_PENDING) {
    return;
  }
  hurry_store(app, false);
#if FT_WITH_FIT
  const struct store_content *content = &app->store.content;
  app_use_calibration(app, content->has_calibration ? &content->calibration : NULL);
#endif
  if (app->owed.command != 0) {
    app->owed.result = status == FT_OK ? WIRE_RESULT_DONE : WIRE_RESULT_NOT_NOW;
    acknowledge(app, &app->owed, now_us);
    app->owed.command = 0;
  }
}

/* At most one USB packet's worth a round, so that a flood of commands cannot starve the frames.
 * Returns whether anything had arrived. Its bytes must not lie on the stack below a fit. */
static __attribute__((noinline)) bool receive_commands(struct app *app) {
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

static void follow_port(struct app *app) {
  uint32_t close_count = cdc_close_count();
  if (close_count != app->close_count) {
    app->close_count = close_count;
    app->streams = 0;
    app->owed.command = 0;
    wire_receiver_init(&app->receiver, COMMANDS);
  }
  if (cdc_loader_requested() && app->loader_at_us == 0) {
    app->loader_at_us = port_now_us() + LOADER_DELAY_us;
  }
}

/* after_frame: the next one is some time off. */
static void each_second(struct app *app, uint64_t now_us, bool after_frame) {
  uint32_t elapsed_us = (uint32_t)(now_us - app->second_began_us);
  if (elapsed_us < (after_frame ? 1000000u : 1000000u + FRAME_WAIT_us)) {
    return;
  }
  app->uptime_rest_us += elapsed_us;
  app->uptime_s += app->uptime_rest_us / 1000000u;
  app->uptime_rest_us %= 1000000u;
  uint32_t frames = read_counter(&app->scan.counters.frames);
  uint32_t elapsed_ms = elapsed_us / 1000u;
  app->measured_rate_mHz = (frames - app->frames_at_second) * 1000000u / elapsed_ms;
  uint32_t asleep_ms = (uint32_t)app->asleep_us / 1000u;
  uint32_t asleep_permille = asleep_ms < elapsed_ms ? asleep_ms * 1000u / elapsed_ms : 1000u;
  app->cpu_busy_permille = (uint16_t)(1000u - asleep_permille);
  app->second_began_us = now_us;
  app->frames_at_second = frames;
  app->asleep_us = 0;
  if (app->streams & WIRE_STREAM_HEALTH) {
    send_health(app, now_us);
  }
}

/* The round that follows a sleep costs a few dozen cycles unless there is something to do: bus
 * interrupts wake the core many times a frame. */
void app_run(struct app *app) {
  uint32_t news = cdc_news();
  bool tick = atomic_load_explicit(&app->tick, memory_order_relaxed) != 0;
  if (!app->active && !tick && news == app->news && !scan_has_news(&app->scan)) {
    port_sleep();
    return;
  }
  port_watchdog_feed();
  if (!app->active) {
    app->asleep_us += port_now_us() - app->idle_since_us;
  }
  atomic_store_explicit(&app->tick, 0, memory_order_relaxed);
  if (news != app->news || tick || app->active) {
    app->news = news;
    app->active = receive_commands(app);
    /* After the commands: one sent just before the port closed must not outlive it. */
    follow_port(app);
  }
  uint64_t taken_us = port_now_us(); /* taking compensates the readings */
  bool has_frame = scan_take(&app->scan, &app->frame);
  if (has_frame) {
    app_process_frame(app, taken_us);
    app->active = true;
  }
  uint64_t now_us = port_now_us();
  each_second(app, now_us, has_frame);
  follow_store(app, now_us); /* after the frame, which it must not keep waiting */
  if (app->loader_at_us != 0 && now_us >= app->loader_at_us && !store_is_writing(&app->store)) {
    port_reboot_to_loader();
  }
  app->idle_since_us = now_us;
}
