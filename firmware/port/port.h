/* What exists exactly once per image and that the board provides at link time: time, the event interrupt, sleep,
 * watchdog, identity, and the way out to the boot loader. */
#pragma once

#include "common/crash.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Microseconds since start; never goes back. Any context. */
uint64_t port_now_us(void);

/* The event handler runs in interrupt context, never nested with itself: when the alarm is due and
 * whenever the array bus has made progress. */
void port_set_event_handler(void (*handler)(void *context), void *context);

/* Arms the one alarm. A time that has passed fires at once. Replaces an earlier setting. */
void port_alarm_at_us(uint64_t t_us);

/* Sleeps until an interrupt has run since the last return of this function, so that a condition
 * checked just before it cannot be missed. Main context only. */
void port_sleep(void);

/* Saving: the processor is slow, and what costs current is off unless USB needs it to wake up; time and alarms go on. The array bus must
 * rest, and is not to be used until the saving has ended, which takes 0.1 ms. Main context only; no effect if it is so already. */
void port_save_power(bool saving);

/* Must be called at least once each PORT_WATCHDOG_PERIOD_us from the main loop, else the chip is reset. It counts only
 * while every part that is watched is alive. Costs some 60 Cortex-M0+ cycles. */
#define PORT_WATCHDOG_PERIOD_us 500000u
void port_watchdog_feed(void);

/* A part has made progress, or waits for what is sure to come. From its first call on it is watched, and must be alive
 * again each PORT_PART_LIMIT_us. Its own context. Costs some 20 cycles. */
enum port_part { PORT_PART_SCAN, PORT_PART_USB, PORT_PARTS };
#define PORT_PART_LIMIT_us 400000u
void port_report_alive(enum port_part part);

/* For the record of a crash: what the main loop does, and what happened (common/crash.h has the details). Main context only. */
void port_set_activity(enum crash_activity activity);
void port_log_event(enum crash_event event, uint8_t detail);

/* A second processor that shares the memory: from now on it calls serve(context) whenever it is woken, until that returns false. Whatever
 * it did before has ended. False: there is none, or it does not start. Takes some 20 us. It writes
 * to what is before context at no time: there it may fault. Main context only. */
bool port_worker_start(bool (*serve)(void *context), void *context);

/* Wakes it; port_sleep() returns once it has served. */
void port_worker_wake(void);

/* It does nothing more, in the middle of what it does. No effect if there is none. */
void port_worker_stop(void);

/* Resets by the watchdog since power-on; faults and panics end in one too. */
uint32_t port_watchdog_resets(void);

/* How the firmware last came to an end since power-on; CRASH_NONE, and all 0: it did not. */
const struct crash_record *port_last_crash(void);

/* Sixteen upper-case hexadecimal digits and a terminating zero: the unique id of the flash chip. */
void port_serial_number(char text[17]);

/* Bytes of the main stack that were never touched since start. Cost grows with the result. */
size_t port_stack_free_bytes(void);

/* Leaves for the boot ROM's USB loader. Does not return. */
_Noreturn void port_reboot_to_loader(void);

/* A failed assertion: leaves a record and resets the chip. Does not return. */
_Noreturn void port_panic(void);
