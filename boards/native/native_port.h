/* port/port.h on the host, in virtual time: time passes only in native_run_until() and port_sleep(), from one event to
 * the next, so a run is exact, repeatable and as fast as the host.
 *
 * Events are the alarm and those of one source, such as the simulated bus. At each, the event handler runs; computing
 * takes no time. What the target cannot survive stops the test program with a message: a main loop that sleeps with no
 * event to come, and a program that never lets time pass. */
#pragma once

#include "common/crash.h"

#include <stdbool.h>
#include <stdint.h>

/* Start-up: time 0, no alarm, no handler, no source. */
void native_start(bool by_watchdog);

/* Right after a start: the clock shows this. */
void native_set_time(uint64_t now_us);

/* Sixteen characters, to distinguish several; kept over starts. */
void native_set_serial_number(const char *text);

/* How the firmware ended before; kept over starts. */
void native_set_last_crash(const struct crash_record *crash);

/* The last argument of port_log_event(). */
enum crash_event native_last_event(uint8_t *detail);

/* next_us returns when the source has its next event, UINT64_MAX for never. */
void native_set_event_source(uint64_t (*next_us)(const void *context), const void *context);

/* Whether there is a second processor, which needs this time for what it is woken for; UINT64_MAX:
 * for ever. Kept over starts. At first there is none. */
void native_set_worker(bool exists, uint64_t takes_us);

/* How often it was started since the start. */
unsigned native_worker_starts(void);

enum native_end {
  NATIVE_TIME_UP,
  NATIVE_LOADER, /* the program left by port_reboot_to_loader() */
  NATIVE_PANIC,  /* by port_panic() */
};

/* Runs until t_us: main_round again and again, one round of a main loop that sleeps when it has nothing to do. NULL: only events. */
enum native_end native_run_until(uint64_t t_us, void (*main_round)(void *context), void *context);

/* The watchdog would have struck: it was not fed for PORT_WATCHDOG_PERIOD_us, or in vain. */
bool native_watchdog_expired(void);
