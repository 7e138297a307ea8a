#include "app/app.h"

#include "app/acting.h"
#include "app/commands.h"
#include "app/packets.h"
#include "app/sync.h"
#include "app/working.h"
#include "common/contact_flags.h"
#include "config/build_info.h"
#include "config/defaults.h"
#include "config/geometry.h"
#include "port/port.h"
#include "usb/cdc.h"

#include <string.h>

/* Delay the once-a-second work until a frame has just been sent, at most by this, so that it never
 * delays one. */
#define FRAME_WAIT_us 100000u
/* A zero that is not followed may be off by 30 Pa after so long: condition.h. */
#define ZERO_LASTS_us 60000000u
/* Frames so far apart leave time for all parts of fit_doubt.h, and for fit_gains.h. */
#define LOOK_AT_ONCE_us 4500u
/* Frames so far apart have time for a search for an outlier in each. */
#define WATCH_APART_us 2000u
/* Up to this pitch the neighbours feel what one sensor feels: see READINGS_STILL_NOISES. */
#define SHARED_PITCH_mm 9.0f

#if FT_WITH_FIT_GENERAL
#define INIT_FIT_ARRAY fit_array_init
#define FIT fit_gaussian_follow
#else
#define INIT_FIT_ARRAY fit_array_init_grid
#define FIT fit_gaussian_grid_follow
_Static_assert(DEFAULT_FIT_N_LARGEST == 0, "n_largest needs FINGERTIP_FIT_GENERAL");
#endif

void app_on_event(struct app *app) {
  uint64_t now_us = port_now_us();
  uint64_t wake_us = scan_step(&app->scan, now_us);
#if FT_WITH_SYNC
  sync_show_scan(app);
#endif
  uint64_t tick_us = now_us + atomic_load_explicit(&app->tick_interval_us, memory_order_relaxed);
  if (now_us >= app->next_tick_us) {
    app->next_tick_us = tick_us;
    atomic_store_explicit(&app->tick, 1, memory_order_relaxed);
  } else if (tick_us < app->next_tick_us) { /* the interval has become shorter */
    app->next_tick_us = tick_us;
  }
  port_alarm_at_us(wake_us < app->next_tick_us ? wake_us : app->next_tick_us);
  if (scan_is_well(&app->scan, now_us)) {
    port_alive(PORT_PART_SCAN);
  }
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
  if (INIT_FIT_ARRAY(&app->fit_array, geometry.sensor_count, geometry.x_mm, geometry.y_mm, geometry.pitch_mm) !=
      FT_OK) {
    port_panic();
  }
  app->fit_settings.iterations = DEFAULT_FIT_ITERATIONS;
  app->fit_settings.n_largest = DEFAULT_FIT_N_LARGEST;
  app->set_sigma_mm = DEFAULT_PRIOR_SIGMA_mm;
  app->set_sigma_sd_mm = DEFAULT_PRIOR_WIDTH_mm;
  fit_set_errors(&app->fit_settings, DEFAULT_GAIN_SD, DEFAULT_MODEL_SD);
  app->fit_settings.location_sd_limit_mm = DEFAULT_LOCATION_LIMIT_mm;
  app->rest.apart_Pa = MS58XX_APART_Pa;
#endif
#if FT_WITH_TANGENTIAL
  app->tangential_job.array = &app->fit_array;
  app->shapes_job.array = &app->fit_array;
  working_start(app);
#endif
#if FT_WITH_SLIP
  app->contact_settings.slip_threshold_mm = DEFAULT_SLIP_THRESHOLD_mm;
  app->contact_settings.slip_window_us = DEFAULT_SLIP_WINDOW_ms * 1000u;
#endif
  store_init(&app->store, geometry.sensor_count);
  condition_start(&app->condition);
  app->active = true;
  app->second_began_us = port_now_us();

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

  commands_start(app);
  port_alarm_at_us(port_now_us());
}

#if FT_WITH_FIT
static void fit_frame(struct app *app) {
  const uint32_t t_us = (uint32_t)app->frame.t_us;
  if (!app->conditioned.contact || t_us - app->fit_frame_us >= WATCH_APART_us) {
    memset(&app->fit_watch, 0, sizeof app->fit_watch);
  }
  app->fit_frame_us = t_us;
  if (!app->conditioned.contact) {
    memset(&app->fit, 0, sizeof app->fit);
    return;
  }
  app->fit_settings.noise_Pa_q10 = app->frame.noise_Pa_q10;
  FIT(&app->fit_array, app->conditioned.pressure_Pa_q10, app->conditioned.usable, &app->fit_settings, &app->fit_watch,
      &app->fit);
  if (!(app->fit.flags & CONTACT_FLAG_FIT_VALID)) {
    app->fit_failures++;
  }
}
#endif

#if FT_WITH_TANGENTIAL_DOUBT
static bool is_load_estimated(const struct app *app) {
#if FT_WITH_TANGENTIAL
  return app->tangential && app->tangential->valid;
#else
  (void)app;
  return false;
#endif
}

static void doubt_load(struct app *app) {
  if (app->conditioned.contact && !is_load_estimated(app)) {
    fit_doubt_widen(&app->load_doubt, &app->fit_array, &app->fit_settings, &app->fit);
  }
}

static void learn_gains(struct app *app) {
  if (fit_gains_learn(&app->learnt_gains, &app->fit_array, app->conditioned.pressure_Pa_q10, &app->fit_settings,
                      &app->fit)) {
    const float gain_sd = fit_gains_sd(&app->learnt_gains);
    for (unsigned k = 0; k < geometry.sensor_count; k++) {
      app->fit_settings.gain_sd_q16[k] = (uint16_t)(65536.0f * gain_sd + 0.5f);
    }
  }
}

/* For the frames that follow. Where they are far apart there is time for all. */
static void look_for_load(struct app *app) {
  const uint32_t t_us = (uint32_t)app->frame.t_us;
  const bool slow = t_us - app->load_frame_us >= LOOK_AT_ONCE_us;
  app->load_frame_us = t_us;
  if (!app->conditioned.contact || is_load_estimated(app)) {
    fit_doubt_begin(&app->load_doubt);
    fit_gains_lift(&app->learnt_gains);
    app->gains_due = false;
  } else {
    for (int parts = slow ? FIT_DOUBT_PARTS + 1 : 1; parts > 0; parts--) {
      if (app->gains_due) {
        learn_gains(app);
        app->gains_due = false;
        continue;
      }
      fit_doubt_follow(&app->load_doubt, &app->fit_array, app->conditioned.pressure_Pa_q10, &app->fit_settings,
                       &app->fit);
      app->gains_due = app->load_doubt.part == 0 && !app->calibration;
    }
  }
}
#endif

static bool is_sensor_doubtful(const struct app *app) {
  return (app->frame.doubtful & app->conditioned.usable) != 0;
}

static struct contact_input input_of(const struct app *app) {
  const struct frame *frame = &app->frame;
  return (struct contact_input) {
    .t_us = frame->t_us, .contact = app->conditioned.contact, .tared = app->conditioned.tared,
    .zero_doubtful = app->conditioned.zero_doubtful, .sensor_doubtful = is_sensor_doubtful(app),
    .masked = app->conditioned.usable != UINT32_MAX >> (FT_MAX_SENSORS - frame->sensor_count),
    .saturated = frame->saturated,
#if FT_WITH_FIT
    .fit = app->conditioned.contact ? &app->fit : NULL, .calibrated = app->calibration != NULL,
#endif
#if FT_WITH_TANGENTIAL
    .tangential = app->tangential,
#endif
  };
}

/* What the load changes nothing of. */
static void judge_fit(struct app *app) {
  const struct contact_input input = input_of(app);
#if FT_WITH_FIT
  app->force = contact_weigh(&app->contact_settings, &app->fit);
#endif
#if FT_WITH_SLIP
  contact_update(&app->slip_history, &app->contact_settings, &input, &app->contact);
#else
  contact_judge(&input, &app->contact);
#endif
}

#if FT_WITH_TANGENTIAL
static void judge_shapes(struct app *app) {
  const bool has_load = (app->contact.flags & CONTACT_FLAG_TANGENTIAL_VALID) != 0;
  app->contact.flags |= shapes_flags(&app->shapes);
  app->place = shapes_locate(&app->shapes, &app->fit, has_load ? &app->load : NULL);
  app->contact.flags &= ~(uint32_t)CONTACT_FLAG_UNCERTAIN;
  if (app->place.location_sd_mm > app->fit_settings.location_sd_limit_mm) {
    app->contact.flags |= CONTACT_FLAG_UNCERTAIN;
  }
}

static void judge_load(struct app *app) {
  const struct contact_input input = input_of(app);
  app->tangential_settings.location_sd_limit_mm = app->fit_settings.location_sd_limit_mm;
  tangential_update(&app->tangential_history, &app->tangential_settings, &input, &app->contact, &app->load);
  motion_update(&app->motion_history, &app->tangential_settings, &input, &app->contact, &app->motion);
  judge_shapes(app);
  app->contact.flags |= app->tangential_is_late ? (uint32_t)CONTACT_FLAG_TANGENTIAL_LATE : 0;
}
#endif

/* A sensor whose supply dipped reads some 17 kPa less until it is reset. What tells that is its
 * temperature, which is to be looked at before the zero gives in (condition.h). */
static void watch_below(struct app *app) {
  const bool below = (app->condition.below & app->conditioned.usable) != 0;
  if (below && !app->reads_below) {
    scan_ask_temperature(&app->scan);
  }
  app->reads_below = below;
}

void app_process_frame(struct app *app, uint64_t taken_us) {
  const struct frame *frame = &app->frame;
  if (taken_us < frame->t_read_us) { /* it came between the look at the clock and the taking */
    taken_us = frame->t_read_us;
  }
  port_at(CRASH_AT_CONDITION);
  if (!frame->held) {
#if FT_WITH_FIT
    const struct condition_gains *gains = app->calibration ? &app->gains : NULL;
#else
    const struct condition_gains *gains = NULL; /* nothing here tells how hard or where */
#endif
    condition_frame(&app->condition, frame, gains, &app->conditioned);
  }
#if FT_WITH_FIT
  port_at(CRASH_AT_FIT);
  uint64_t conditioned_us = port_now_us();
  if (!frame->held) {
    fit_frame(app);
#if FT_WITH_TANGENTIAL
    working_ask(app);
    judge_fit(app);
    working_wait(app);
#endif
#if FT_WITH_TANGENTIAL_DOUBT
    doubt_load(app);
#endif
  }
  uint64_t fitted_us = port_now_us();
#endif
  port_at(CRASH_AT_CONTACT);
  if (frame->held) {
    app->contact.flags |= CONTACT_FLAG_HELD;
    app->contact.flags |= is_sensor_doubtful(app) ? (uint32_t)CONTACT_FLAG_SENSOR_DOUBTFUL : 0;
  } else {
#if FT_WITH_TANGENTIAL
    judge_load(app);
#else
    judge_fit(app);
#endif
  }
  port_at(CRASH_AT_PACKET);
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
    packets_send_contact(app, &stages);
  }
#endif
#if FT_WITH_RAW_STREAM
  if (app->streams & WIRE_STREAM_RAW) {
    packets_send_raw(app);
  }
#endif
#if FT_WITH_TANGENTIAL
  port_at(CRASH_AT_FIT);
  working_follow(app);
#endif
  port_at(CRASH_AT_CONDITION);
  if (!frame->held) {
    condition_follow(&app->condition, frame, &app->conditioned);
#if FT_WITH_FIT
    if (rest_follow(&app->rest, frame, &app->conditioned)) {
      readings_doubt(&app->scan.readings, app->rest.apart);
    }
#endif
    watch_below(app);
#if FT_WITH_TANGENTIAL_DOUBT
    look_for_load(app);
#endif
  }
}

/* While the bus sleeps so do the sensors, and once they do, the chip. */
static bool may_save_power(const struct app *app) {
  return cdc_is_suspended() && scan_rests(&app->scan);
}

static void follow_suspend(struct app *app) {
  const bool saves = may_save_power(app);
  if (saves != app->saves_power) {
#if FT_WITH_SYNC
    if (saves) {
      sync_pause(app, true);
      commands_set_pace(app);
    }
#endif
    port_save_power(saves);
    port_event(saves ? CRASH_EVENT_ASLEEP : CRASH_EVENT_AWAKE, 0);
    const uint64_t now_us = port_now_us();
    if (saves) {
      app->saving_since_us = now_us;
    } else if (now_us - app->saving_since_us >= ZERO_LASTS_us) {
      condition_start(&app->condition);
    }
    app->saves_power = saves;
#if FT_WITH_SYNC
    if (!saves) {
      sync_pause(app, false);
      commands_set_pace(app);
    }
#endif
  }
  scan_rest(&app->scan, cdc_is_suspended());
}

static void follow_port(struct app *app) {
  uint32_t close_count = cdc_close_count();
  if (close_count != app->close_count) {
    app->close_count = close_count;
    port_event(CRASH_EVENT_CLOSED, 0);
    commands_end_session(app);
  }
  if (cdc_loader_requested() && app->loader_at_us == 0) {
    app->loader_at_us = port_now_us() + LOADER_DELAY_us;
  }
}

static uint8_t saturate_u8(uint32_t value) {
  return value < UINT8_MAX ? (uint8_t)value : UINT8_MAX;
}

static void note_more(uint32_t *before, uint32_t now, enum crash_event event) {
  if (now != *before) {
    port_event(event, saturate_u8(now - *before));
    *before = now;
  }
}

/* What went wrong in a second, should worse follow. */
static void note_second(struct app *app) {
  const struct scan *scan = &app->scan;
  note_more(&app->noted.timeouts, read_counter(&scan->counters.bus_timeouts), CRASH_EVENT_BUS);
  note_more(&app->noted.skipped, read_counter(&scan->counters.frames_skipped), CRASH_EVENT_SKIPPED);
  const uint32_t present = read_counter(&scan->present);
  if (present != app->noted.present) {
    app->noted.present = present;
    port_event(CRASH_EVENT_SENSORS, 0);
  }
}

/* after_frame: the next one is some time off. */
static void each_second(struct app *app, uint64_t now_us, bool after_frame) {
  uint32_t elapsed_us = (uint32_t)(now_us - app->second_began_us);
  if (elapsed_us < (after_frame ? 1000000u : 1000000u + FRAME_WAIT_us)) {
    return;
  }
  port_at(CRASH_AT_HEALTH);
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
  note_second(app);
#if FT_WITH_FIT
  app_use_air(app);
#endif
  if (app->streams & WIRE_STREAM_HEALTH) {
    packets_send_health(app, now_us);
  }
}

/* The round that follows a sleep costs a few dozen cycles unless there is something to do: bus
 * interrupts wake the core many times a frame. */
void app_run(struct app *app) {
  uint32_t news = cdc_news();
  bool tick = atomic_load_explicit(&app->tick, memory_order_relaxed) != 0;
  if (!app->active && !tick && news == app->news && !scan_has_news(&app->scan) &&
      may_save_power(app) == app->saves_power) {
    port_sleep();
    return;
  }
  port_watchdog_feed();
  if (!app->active) {
    app->asleep_us += port_now_us() - app->idle_since_us;
  }
  atomic_store_explicit(&app->tick, 0, memory_order_relaxed);
  follow_suspend(app);
  if (news != app->news || tick || app->active) {
    app->news = news;
    port_at(CRASH_AT_COMMANDS);
    app->active = commands_receive(app);
    /* After the commands: one sent just before the port closed must not outlive it. */
    follow_port(app);
  }
  port_at(CRASH_AT_READINGS);
  uint64_t taken_us = port_now_us(); /* taking compensates the readings */
  bool has_frame = scan_take(&app->scan, &app->frame);
  if (has_frame) {
    app_process_frame(app, taken_us);
    app->active = true;
  }
  uint64_t now_us = port_now_us();
  each_second(app, now_us, has_frame);
  commands_follow_store(app, now_us); /* after the frame, which it must not keep waiting */
#if FT_WITH_SYNC
  sync_follow(app, now_us);
#endif
  if (app->loader_at_us != 0 && now_us >= app->loader_at_us && !store_is_writing(&app->store)) {
    port_reboot_to_loader();
  }
  app->idle_since_us = now_us;
  port_at(CRASH_AT_REST);
}
