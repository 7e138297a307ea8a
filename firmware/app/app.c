#include "app/app.h"

#include "app/status.h"
#include "config/build_info.h"
#include "config/defaults.h"
#include "config/geometry.h"
#include "port/port.h"
#include "usb/cdc.h"

#include <string.h>

/* Longest delay of the once-a-second work, us: it waits until a frame has just been sent, so that it never delays one. */
#define FRAME_WAIT_us 100000u
/* Pause after which the zeros are taken again, us: a zero that is not followed may be off by 30 Pa then (ZERO.md). */
#define ZERO_LASTS_us 60000000u
/* Largest pitch at which neighbours measure the same press, mm: see READINGS_STILL_NOISES. */
#define SHARED_PITCH_mm 9.0f
/* Longest time between two rounds of the main loop, us: a fifth of the watchdog's period. */
#define TICK_us (PORT_WATCHDOG_PERIOD_us / 5u)
/* The same while something is being stored, which takes about a hundred rounds and an erase, and while edges of the sync pin come. */
#define FAST_TICK_us 1000u

void app_on_event(struct app *app) {
  struct tick *tick = &app->tick;
  uint64_t now_us = port_now_us();
  uint64_t wake_us = scan_step(&app->scan, now_us);
  stages_on_event(&app->stages, &app->scan);
  uint64_t tick_us = now_us + atomic_load_explicit(&tick->interval_us, memory_order_relaxed);
  if (now_us >= tick->next_us) {
    tick->next_us = tick_us;
    atomic_store_explicit(&tick->is_due, 1, memory_order_relaxed);
  } else if (tick_us < tick->next_us) { /* the interval has become shorter */
    tick->next_us = tick_us;
  }
  port_alarm_at_us(wake_us < tick->next_us ? wake_us : tick->next_us);
  if (scan_is_well(&app->scan, now_us)) {
    port_report_alive(PORT_PART_SCAN);
  }
}

static void start_usb(void) {
  static char serial[17];
  port_serial_number(serial);
  static struct cdc_identity identity;
  identity = (struct cdc_identity){
      .vendor_id = FINGERTIP_USB_VID,
      .product_id = FINGERTIP_USB_PID,
      .device_version_bcd = (uint16_t)(build_info.version[0] << 8 | build_info.version[1] << 4 | build_info.version[2]),
      .manufacturer = "Fingertip",
      .product = "Fingertip tactile sensor",
      .serial = serial,
  };
  cdc_start(&identity);
}

/* Rounds are frequent while something needs them: after what may change that. */
static void set_pace(struct app *app) {
  const bool is_fast = store_is_writing(&app->store) || stages_need_fast_rounds(&app->stages);
  const uint32_t before_us = atomic_load_explicit(&app->tick.interval_us, memory_order_relaxed);
  const uint32_t interval_us = is_fast ? FAST_TICK_us : TICK_us;
  atomic_store_explicit(&app->tick.interval_us, interval_us, memory_order_relaxed);
  if (interval_us < before_us) { /* the alarm that is armed would come too late */
    port_alarm_at_us(port_now_us());
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
  stages_start(&app->stages);
  store_init(&app->store, geometry.sensor_count);
  app->active = true;
  app->statistics.began_us = port_now_us();
  start_usb();
  commands_start(app);
  set_pace(app);
  port_alarm_at_us(port_now_us());
}

void app_process_frame(struct app *app, uint64_t taken_us) {
  struct findings *found = &app->found;
  stages_process(&app->stages, found, (uint32_t)taken_us);
  stages_send(&app->stages, found, app->commands.streams, &app->line);
  stages_after_send(&app->stages, found, &app->scan);
}

/* While the bus sleeps so do the sensors, and once they do, the chip. */
static bool may_save_power(const struct app *app) { return cdc_is_suspended() && scan_rests(&app->scan); }

static void update_suspend(struct app *app) {
  const bool saves = may_save_power(app);
  if (saves != app->saves_power) {
    if (saves) {
      stages_pause(&app->stages, true);
    }
    port_save_power(saves);
    port_log_event(saves ? CRASH_EVENT_ASLEEP : CRASH_EVENT_AWAKE, 0);
    const uint64_t now_us = port_now_us();
    if (saves) {
      app->saving_since_us = now_us;
    } else if (now_us - app->saving_since_us >= ZERO_LASTS_us) {
      condition_resume(&app->stages.condition.condition, (uint32_t)((now_us - app->saving_since_us) >> 10));
    }
    app->saves_power = saves;
    if (!saves) {
      stages_pause(&app->stages, false);
    }
    set_pace(app);
  }
  scan_rest(&app->scan, cdc_is_suspended());
}

static void update_port(struct app *app) {
  const uint32_t close_count = cdc_close_count();
  if (close_count != app->close_count) {
    app->close_count = close_count;
    port_log_event(CRASH_EVENT_CLOSED, 0);
    commands_end_session(app);
  }
  if (cdc_loader_requested() && app->commands.loader_at_us == 0) {
    commands_plan_loader(&app->commands, port_now_us());
  }
}

static uint8_t saturate_u8(uint32_t value) { return value < UINT8_MAX ? (uint8_t)value : UINT8_MAX; }

static void log_increase(uint32_t *before, uint32_t now, enum crash_event event) {
  if (now != *before) {
    port_log_event(event, saturate_u8(now - *before));
    *before = now;
  }
}

/* What went wrong in this second, for the record of a crash that may follow. */
static void log_faults(struct statistics *statistics, const struct scan *scan) {
  log_increase(&statistics->timeouts, scan_read(&scan->counters.bus_timeouts), CRASH_EVENT_BUS);
  log_increase(&statistics->skipped, scan_read(&scan->counters.frames_skipped), CRASH_EVENT_SKIPPED);
  const sensor_map present = scan_read_map(&scan->present);
  if (present != statistics->present) {
    statistics->present = present;
    port_log_event(CRASH_EVENT_SENSORS, 0);
  }
}

static void update_statistics(struct statistics *statistics, const struct scan *scan, uint64_t now_us) {
  const uint32_t elapsed_us = (uint32_t)(now_us - statistics->began_us), elapsed_ms = elapsed_us / 1000u;
  statistics->uptime_rest_us += elapsed_us;
  statistics->uptime_s += statistics->uptime_rest_us / 1000000u;
  statistics->uptime_rest_us %= 1000000u;
  const uint32_t frames = scan_read(&scan->counters.frames);
  statistics->rate_mHz = (frames - statistics->frames) * 1000000u / elapsed_ms;
  const uint32_t asleep_ms = (uint32_t)statistics->asleep_us / 1000u;
  const uint32_t asleep_permille = asleep_ms < elapsed_ms ? asleep_ms * 1000u / elapsed_ms : 1000u;
  statistics->busy_permille = (uint16_t)(1000u - asleep_permille);
  statistics->began_us = now_us;
  statistics->frames = frames;
  statistics->asleep_us = 0;
}

/* after_frame: the next one is some time off. */
static void each_second(struct app *app, uint64_t now_us, bool after_frame) {
  const uint32_t elapsed_us = (uint32_t)(now_us - app->statistics.began_us);
  if (elapsed_us < (after_frame ? 1000000u : 1000000u + FRAME_WAIT_us)) {
    return;
  }
  port_set_activity(CRASH_AT_HEALTH);
  update_statistics(&app->statistics, &app->scan, now_us);
  log_faults(&app->statistics, &app->scan);
  stages_each_second(&app->stages, &app->found);
  if (app->commands.streams & WIRE_STREAM_HEALTH) {
    status_send_health(app, now_us);
  }
}

/* The round that follows a sleep costs a few dozen cycles unless there is something to do: bus interrupts wake the core
 * many times a frame. */
void app_run(struct app *app) {
  const uint32_t usb_events = cdc_event_count();
  const bool tick = atomic_load_explicit(&app->tick.is_due, memory_order_relaxed) != 0;
  if (!app->active && !tick && usb_events == app->usb_events && !scan_has_news(&app->scan) && may_save_power(app) == app->saves_power) {
    port_sleep();
    return;
  }
  port_watchdog_feed();
  if (!app->active) {
    app->statistics.asleep_us += port_now_us() - app->statistics.idle_since_us;
  }
  atomic_store_explicit(&app->tick.is_due, 0, memory_order_relaxed);
  update_suspend(app);
  if (usb_events != app->usb_events || tick || app->active) {
    app->usb_events = usb_events;
    port_set_activity(CRASH_AT_COMMANDS);
    update_port(app); /* before what the next session asks for */
    app->active = commands_receive(app);
    set_pace(app);
  }
  port_set_activity(CRASH_AT_READINGS);
  const uint64_t taken_us = port_now_us(); /* taking compensates the readings */
  const bool has_frame = scan_take(&app->scan, &app->found.frame);
  if (has_frame) {
    app_process_frame(app, taken_us);
    app->statistics.asleep_us += app->found.slept_us;
  }
  const uint64_t now_us = port_now_us();
  each_second(app, now_us, has_frame);
  commands_poll_store(app, now_us); /* after the frame, which it must not keep waiting */
  stages_each_round(&app->stages, now_us, app->commands.streams, &app->line);
  if (app->commands.loader_at_us != 0 && now_us >= app->commands.loader_at_us && !store_is_writing(&app->store)) {
    port_reboot_to_loader();
  }
  app->statistics.idle_since_us = now_us;
  port_set_activity(CRASH_AT_REST);
}
