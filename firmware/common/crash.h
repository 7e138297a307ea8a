/* How the firmware last ended: where it was, why, and what had happened before. The board keeps it
 * over the reset (port/port.h). The packets carry it to the host. */
#pragma once

#include <stdint.h>

enum crash_kind {
  CRASH_NONE,
  CRASH_FAULT,     /* a hard fault: pc is the instruction */
  CRASH_PANIC,     /* port_panic(): pc is the call */
  CRASH_WATCHDOG,  /* a part of the firmware made no progress; see stuck. pc is what was interrupted */
  CRASH_EXCEPTION, /* one without a handler; see vector */
  CRASH_OVERFLOW,  /* a hard fault whose registers were to be stacked below the stack: all 0 where
                      they could not be */
  CRASH_START,     /* the start gave up: clocks that do not come, a fault in the start-up code */
};

/* What the main loop was at */
enum crash_activity {
  CRASH_AT_START,
  CRASH_AT_REST, /* asleep, or looking whether there is something to do */
  CRASH_AT_COMMANDS,
  CRASH_AT_READINGS,
  CRASH_AT_CONDITION,
  CRASH_AT_FIT,
  CRASH_AT_CONTACT,
  CRASH_AT_PACKET,
  CRASH_AT_HEALTH, /* what is done once a second */
  CRASH_AT_STORE,
};

/* Bits: what had made no progress when the watchdog was to strike */
enum crash_stuck {
  CRASH_STUCK_MAIN = 1 << 0,
  CRASH_STUCK_SCAN = 1 << 1,
  CRASH_STUCK_USB = 1 << 2,
  CRASH_STUCK_INTERRUPTS = 1 << 3, /* not even the last warning ran: interrupts were off, or the
                                      processor locked up. No registers then */
};

enum crash_event {
  CRASH_EVENT_NONE,
  CRASH_EVENT_START,
  CRASH_EVENT_COMMAND, /* detail: its type */
  CRASH_EVENT_CLOSED,  /* the port, by the host */
  CRASH_EVENT_ASLEEP,  /* the bus was suspended, and sensors and clocks rest */
  CRASH_EVENT_AWAKE,
  CRASH_EVENT_STORED,  /* detail: 1 if the flash failed */
  CRASH_EVENT_SENSORS, /* others answer than before */
  CRASH_EVENT_BUS,     /* timeouts of the sensor bus; detail: number in a second */
  CRASH_EVENT_SKIPPED, /* frames that were not taken; detail: number in a second */
  CRASH_EVENT_WORKER,  /* the second processor did not answer, and was started again; detail: 1 if it does not start */
};

enum { CRASH_EVENTS = 8 };

struct crash_record {
  uint8_t kind;      /* enum crash_kind */
  uint8_t exception; /* in which the code at pc ran: 0 main loop, 16 + n interrupt n */
  uint8_t vector;    /* the exception that took note: 3 hard fault; 0 for a panic */
  uint8_t activity;  /* enum crash_activity */
  uint8_t stuck;     /* enum crash_stuck; 0 unless the watchdog struck */
  /* The last events, newest first */
  uint8_t event_codes[CRASH_EVENTS]; /* enum crash_event */
  uint8_t event_details[CRASH_EVENTS];
  /* As the exception stacked them; all 0 where sp pointed nowhere, or nothing took note. sp is that of the code at pc. */
  uint32_t r0, r1, r2, r3, r12, lr, pc, xpsr, sp;
  uint32_t event_ages_1024us[CRASH_EVENTS]; /* how long before the end, in 1024 us; saturates */
  uint64_t t_us;                            /* of the end, since the start before it */
};
