/* The fingertip: frames in, packets out, commands obeyed. Everything below it is wired here and only here. A frame goes
 * from the scan through the stages (stages.h) to its packets (line.h).
 *
 * One instance per image, static. The board's main installs an event handler (port.h) that calls app_on_event, calls
 * app_start once and then app_run for ever. */
#pragma once

#include "app/commands.h"
#include "app/findings.h"
#include "app/line.h"
#include "app/stages.h"
#include "array_bus/array_bus.h"
#include "scan/scan.h"
#include "store/store.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

/* What the event context sets from time to time, so that the main loop runs although nothing else wakes it. */
struct tick {
  _Atomic uint32_t is_due;
  _Atomic uint32_t interval_us;
  uint64_t next_us; /* event context only */
};

/* The second under way, and what the one before it measured. */
struct statistics {
  uint64_t began_us;
  uint64_t idle_since_us; /* unless app.active */
  uint64_t asleep_us;
  uint32_t frames;            /* at its beginning */
  uint32_t timeouts, skipped; /* of the scan, at its beginning */
  sensor_map present;         /* the same */
  uint32_t uptime_s, uptime_rest_us;
  uint32_t rate_mHz;
  uint16_t busy_permille;
};

struct app {
  uint32_t usb_events, close_count; /* of the port, in the last round */
  bool active;                      /* the last round had bytes of the host, so there may be more */
  bool saves_power;
  uint64_t saving_since_us; /* if .saves_power */
  struct tick tick;         /* shared with the event context, and so is .scan, under its own rules */
  struct commands commands;
  struct statistics statistics;
  struct findings found; /* of the frame under way */
  struct line line;
  struct store store;
  struct scan scan;
  struct stages stages; /* its end is the second processor's */
};

/* Starts the pipeline on this bus, which must outlive it. Attaches to USB. */
void app_start(struct app *app, const struct array_bus *bus);

/* Event context: moves the scan on and arms the next alarm. */
void app_on_event(struct app *app);

/* Takes app->found.frame through the stages and sends what the open streams ask for; app->found keeps what was found,
 * and app->line.packet the last packet. A held frame has no new readings: what was found in the frame before is sent
 * again. app_run calls it with the time at which it took the frame; so may a host that has frames of its own. */
void app_process_frame(struct app *app, uint64_t taken_us);

/* One round of the main loop: does what is due, or sleeps until something happens. */
void app_run(struct app *app);
