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
/* So long the end of a second waits for a frame to follow, rather than keep one waiting. */
#define FRAME_WAIT_us 100000u
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
#else
#define COMMANDS wire_commands_without_slip
#endif

void app_on_event(struct app *app) {
  uint64_t now_us = port_now_us();
  uint64_t wake_us = scan_step(&app->scan, now_us);
  if (now_us >= app->next_tick_us) {
    app->next_tick_us = now_us + TICK_us;
    atomic_store_explicit(&app->tick, 1, memory_order_relaxed);
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

void app_start(struct app *app, const struct array_bus *bus) {
  memset(app, 0, sizeof *app);
  const struct scan_settings scan_settings = {
      .sensor_count = geometry.sensor_count,
      .osr = DEFAULT_OSR,
      .rate_mHz = DEFAULT_RATE_mHz,
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
#endif
#if FT_WITH_SLIP
  app->contact_settings.slip_threshold_mm = DEFAULT_SLIP_THRESHOLD_mm;
  app->contact_settings.slip_window_us = DEFAULT_SLIP_WINDOW_ms * 1000u;
#endif
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
  contact->force_N = app->fit.force_N;
  contact->residual_rms_Pa = app->fit.residual_rms_Pa;
  contact->location_sd_mm = app->fit.location_sd_mm;
  contact->force_sd_N = app->fit.force_sd_N;
  contact->slip_mm = app->contact.slip_mm;
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

static void judge_frame(struct app *app) {
  const struct frame *frame = &app->frame;
  const struct contact_input input = {
    .t_us = frame->t_us,
    .contact = app->conditioned.contact,
    .tared = app->conditioned.tared,
    .masked = app->conditioned.usable != UINT32_MAX >> (FT_MAX_SENSORS - frame->sensor_count),
    .saturated = frame->saturated,
#if FT_WITH_FIT
    .fit = app->conditioned.contact ? &app->fit : NULL,
#endif
  };
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
    condition_frame(&app->condition, frame, NULL, &app->conditioned);
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
}

#if FT_WITH_SLIP
static enum wire_result set_slip(struct app *app, const struct wire_cmd_slip *slip) {
  if (slip->threshold_mm < WIRE_SLIP_THRESHOLD_MIN_mm ||
      slip->threshold_mm > WIRE_SLIP_THRESHOLD_MAX_mm ||
      slip->window_ms < WIRE_SLIP_WINDOW_MIN_ms || slip->window_ms > WIRE_SLIP_WINDOW_MAX_ms) {
    return WIRE_RESULT_OUT_OF_RANGE;
  }
  app->contact_settings.slip_threshold_mm = slip->threshold_mm;
  app->contact_settings.slip_window_us = slip->window_ms * 1000u;
  slip_reset(&app->slip_history);
  return WIRE_RESULT_DONE;
}
#endif

static enum wire_result obey(struct app *app, const struct wire_packet *command, uint64_t now_us) {
  switch (command->type) {
  case WIRE_CMD_STREAM:
    if (command->body.cmd_stream.streams & ~STREAMS) {
      return WIRE_RESULT_OUT_OF_RANGE;
    }
    app->streams = command->body.cmd_stream.streams;
    return WIRE_RESULT_DONE;
  case WIRE_CMD_TARE:
    if (read_counter(&app->scan.admitted) == 0) {
      return WIRE_RESULT_NOT_NOW;
    }
    condition_tare(&app->condition);
    return WIRE_RESULT_DONE;
  case WIRE_CMD_RATE: {
    uint32_t rate_mHz = command->body.cmd_rate.rate_mHz;
    if (rate_mHz != 0 && (rate_mHz < WIRE_RATE_MIN_mHz || rate_mHz > WIRE_RATE_MAX_mHz)) {
      return WIRE_RESULT_OUT_OF_RANGE;
    }
    app->rate_mHz = rate_mHz;
    scan_set_rate_mHz(&app->scan, rate_mHz);
    return WIRE_RESULT_DONE;
  }
  case WIRE_CMD_OSR:
    if (scan_set_osr(&app->scan, command->body.cmd_osr.osr) != FT_OK) {
      return WIRE_RESULT_OUT_OF_RANGE;
    }
    app->osr = command->body.cmd_osr.osr;
    return WIRE_RESULT_DONE;
#if FT_WITH_SLIP
  case WIRE_CMD_SLIP:
    return set_slip(app, &command->body.cmd_slip);
#endif
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

/* app->packet holds the command and is used up. */
static void answer_command(struct app *app, uint64_t now_us) {
  uint8_t command = app->packet.type;
  enum wire_result result = obey(app, &app->packet, now_us);
  app->packet.body.ack = (struct wire_ack){
      .command = command,
      .result = (uint8_t)result,
      .sequence = app->packet.sequence,
      .host_time_us = app->packet.t_us,
  };
  send_packet(app, &wire_ack_layout, now_us);
  if (result != WIRE_RESULT_DONE) {
    app->commands_rejected++;
    return;
  }
  app->commands_done++;
  if (command == WIRE_CMD_INFO) {
    send_info(app, now_us);
  } else if (command == WIRE_CMD_HEALTH) {
    send_health(app, now_us);
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
  app->news = news;
  atomic_store_explicit(&app->tick, 0, memory_order_relaxed);
  app->active = receive_commands(app);
  /* After the commands: one sent just before the port closed must not outlive it. */
  follow_port(app);
  uint64_t taken_us = port_now_us(); /* taking compensates the readings */
  bool has_frame = scan_take(&app->scan, &app->frame);
  if (has_frame) {
    app_process_frame(app, taken_us);
    app->active = true;
  }
  uint64_t now_us = port_now_us();
  each_second(app, now_us, has_frame);
  if (app->loader_at_us != 0 && now_us >= app->loader_at_us) {
    port_reboot_to_loader();
  }
  app->idle_since_us = now_us;
}
