#include "native/native_port.h"

#include "port/port.h"

#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* More events, or rounds of the main loop, at one moment are a program that never lets time pass. */
enum { MAX_AT_ONCE = 10000 };

static struct {
  uint64_t now_us;
  uint64_t alarm_us; /* UINT64_MAX = off */
  void (*handler)(void *);
  void *handler_context;
  uint64_t (*source_next_us)(const void *);
  const void *source_context;
  uint64_t fed_us;
  uint64_t alive_us[PORT_PARTS];
  bool watched[PORT_PARTS];
  unsigned at_once;
  uint64_t limit_us; /* of the run; sleep ends there */
  bool watchdog_expired;
  enum crash_event last_event;
  uint8_t last_event_detail;
  bool started_by_watchdog;
  bool running;
  jmp_buf out;
} native = {.alarm_us = UINT64_MAX};

static struct {
  bool exists;
  uint64_t takes_us, due_us;
  bool (*serve)(void *context);
  void *context;
  unsigned starts;
} worker = {.due_us = UINT64_MAX};

static _Noreturn void stop(const char *why) {
  (void)fprintf(stderr, "native_port: %s at %llu us\n", why, (unsigned long long)native.now_us);
  abort();
}

void native_start(bool by_watchdog) {
  memset(&native, 0, sizeof native);
  native.alarm_us = UINT64_MAX;
  port_worker_stop();
  worker.starts = 0;
  native.started_by_watchdog = by_watchdog;
}

void native_set_time(uint64_t now_us) {
  native.now_us = now_us;
  native.fed_us = now_us;
}

void native_set_event_source(uint64_t (*next_us)(const void *context), const void *context) {
  native.source_next_us = next_us;
  native.source_context = context;
}

static uint64_t next_event_us(void) {
  uint64_t next_us = native.alarm_us;
  if (native.source_next_us) {
    const uint64_t source_us = native.source_next_us(native.source_context);
    next_us = source_us < next_us ? source_us : next_us;
  }
  return next_us < native.now_us ? native.now_us : next_us;
}

static void pass_time_to(uint64_t t_us) {
  if (t_us > native.now_us) {
    native.at_once = 0;
  }
  native.now_us = t_us;
  if (t_us - native.fed_us > PORT_WATCHDOG_PERIOD_us) {
    native.watchdog_expired = true;
  }
}

static void count_at_once(void) {
  if (++native.at_once > MAX_AT_ONCE) {
    stop("no time passes: the alarm, the bus or the main loop runs without end");
  }
}

static void take_event(uint64_t t_us) {
  pass_time_to(t_us);
  count_at_once();
  if (native.alarm_us <= native.now_us) {
    native.alarm_us = UINT64_MAX;
  }
  if (native.handler) {
    native.handler(native.handler_context);
  }
}

enum native_end native_run_until(uint64_t t_us, void (*main_round)(void *context), void *context) {
  const int left = setjmp(native.out);
  native.running = left == 0;
  if (left != 0) {
    return (enum native_end)left;
  }
  native.limit_us = t_us;
  if (main_round) {
    while (native.now_us < t_us) {
      count_at_once();
      main_round(context);
    }
  } else {
    for (uint64_t next_us; (next_us = next_event_us()) <= t_us;) {
      take_event(next_us);
    }
    pass_time_to(t_us);
  }
  native.running = false;
  return NATIVE_TIME_UP;
}

bool native_watchdog_expired(void) { return native.watchdog_expired; }

uint64_t port_now_us(void) { return native.now_us; }

void port_set_event_handler(void (*handler)(void *context), void *context) {
  native.handler = handler;
  native.handler_context = context;
}

void port_alarm_at_us(uint64_t t_us) { native.alarm_us = t_us; }

void port_sleep(void) {
  const uint64_t next_us = next_event_us();
  if (worker.due_us <= next_us) {
    pass_time_to(worker.due_us);
    worker.due_us = UINT64_MAX;
    while (worker.serve(worker.context)) {
    }
    return;
  }
  if (next_us == UINT64_MAX) {
    stop("the main loop sleeps and nothing will wake it");
  }
  if (native.running && next_us > native.limit_us && native.now_us < native.limit_us) { /* a wait may end behind it */
    pass_time_to(native.limit_us);
  } else {
    take_event(next_us);
  }
}

void native_set_worker(bool exists, uint64_t takes_us) {
  worker.exists = exists;
  worker.takes_us = takes_us;
}

unsigned native_worker_starts(void) { return worker.starts; }

bool port_worker_start(bool (*serve)(void *context), void *context) {
  port_worker_stop();
  worker.serve = serve;
  worker.context = context;
  worker.starts += worker.exists;
  return worker.exists;
}

void port_worker_wake(void) {
  const uint64_t takes_us = worker.takes_us;
  worker.due_us = takes_us == UINT64_MAX ? UINT64_MAX : native.now_us + takes_us;
}

void port_worker_stop(void) { worker.due_us = UINT64_MAX; }

void port_save_power(bool saving) { (void)saving; }

void port_watchdog_feed(void) {
  for (unsigned part = 0; part < PORT_PARTS; part++) {
    if (native.watched[part] && native.now_us - native.alive_us[part] > PORT_PART_LIMIT_us) {
      return;
    }
  }
  native.fed_us = native.now_us;
}

void port_report_alive(enum port_part part) {
  native.alive_us[part] = native.now_us;
  native.watched[part] = true;
}

void port_set_activity(enum crash_activity activity) { (void)activity; }

void port_log_event(enum crash_event event, uint8_t detail) {
  native.last_event = event;
  native.last_event_detail = detail;
}

enum crash_event native_last_event(uint8_t *detail) {
  *detail = native.last_event_detail;
  return native.last_event;
}

static struct crash_record last_crash;

void native_set_last_crash(const struct crash_record *crash) { last_crash = *crash; }

uint32_t port_watchdog_resets(void) { return native.started_by_watchdog ? 1 : 0; }

const struct crash_record *port_last_crash(void) { return &last_crash; }

static char serial_number[17] = "0000000000000001";

void native_set_serial_number(const char *text) { memcpy(serial_number, text, sizeof serial_number - 1); }

void port_serial_number(char text[17]) { memcpy(text, serial_number, sizeof serial_number); }

/* The host's stack is not watched; there is plenty. */
size_t port_stack_free_bytes(void) { return SIZE_MAX; }

static _Noreturn void leave(enum native_end how, const char *why) {
  if (!native.running) {
    stop(why);
  }
  longjmp(native.out, how);
}

void port_reboot_to_loader(void) { leave(NATIVE_LOADER, "left for the boot loader"); }

void port_panic(void) { leave(NATIVE_PANIC, "panic"); }
