#include "rp2040/crash.h"

#include "common/crash.h"
#include "common/crc32.h"
#include "port/port.h"
#include "rp2040/flash.h"
#include "rp2040/nvic.h"
#include "rp2040/progress.h"
#include "rp2040/resets.h"
#include "rp2040/timer_regs.h"
#include "rp2040/watchdog_regs.h"

#include <string.h>

/* In scratch 0 from the first start on: a watchdog reset after that was ours, and not the boot
 * ROM's, which leaves its USB loader in the same way. */
#define STARTED_MAGIC UINT32_C(0x46546970)
#define RECORD_MAGIC UINT32_C(0x63726173)
#define NOINIT __attribute__((noinit))

/* Time from the warning to the reset */
#define LAST_WORDS_us 20000u

enum { VECTOR_PANIC = 0, VECTOR_HARD_FAULT = 3, VECTOR_UNFED = 16 + RP2040_IRQ_TIMER_2 };
#define XPSR_EXCEPTION 0x3fu
#define XPSR_STACK_WAS_ODD (1u << 9) /* by a word, ARMv6-M B1.5.7 */

/* fault.S */
struct fault_frame {
  uint32_t r0, r1, r2, r3, r12, lr, pc, xpsr;
  uint32_t address; /* where it lay */
  uint32_t vector;
};
extern const struct fault_frame rp2040_fault_frame;
extern uint32_t __stack_guard[], __stack_limit[];

struct event {
  uint64_t t_us;
  uint8_t code, detail;
};

/* State of this run; the next one may find it. A part that reports progress interrupts the others. */
static NOINIT struct {
  volatile uint32_t alive_us[PORT_PARTS]; /* the timer's low word */
  volatile bool watched[PORT_PARTS];
  uint32_t main_us; /* when the main loop last wanted to feed */
  uint64_t fed_us;
  uint8_t activity;
  uint32_t event_count;
  struct event events[CRASH_EVENTS];
} trace;

static NOINIT struct {
  uint32_t magic;
  struct crash_record record;
  uint32_t crc;
} kept;

static struct crash_record last;
static uint32_t resets;

static uint32_t kept_crc(void) { return crc32_iso_hdlc((const uint8_t *)&kept.record, sizeof kept.record); }

static void put_events(struct crash_record *record) {
  for (uint32_t i = 0; i < CRASH_EVENTS && i < trace.event_count; i++) {
    const struct event *event = &trace.events[(trace.event_count - 1 - i) % CRASH_EVENTS];
    const uint64_t age_us = record->t_us > event->t_us ? record->t_us - event->t_us : 0;
    record->event_codes[i] = event->code;
    record->event_details[i] = event->detail;
    record->event_ages_1024us[i] = age_us >> 42 == 0 ? (uint32_t)(age_us >> 10) : UINT32_MAX;
  }
}

static uint8_t stuck_parts(uint32_t now_us) {
  static const uint8_t bits[] = {[PORT_PART_SCAN] = CRASH_STUCK_SCAN, [PORT_PART_USB] = CRASH_STUCK_USB};
  uint8_t stuck = 0;
  for (unsigned part = 0; part < PORT_PARTS; part++) {
    if (trace.watched[part] && is_overdue(now_us, trace.alive_us[part], PORT_PART_LIMIT_us))
      stuck |= bits[part];
  }
  return stuck;
}

/* A main loop that rests waits for the scan, which wakes it from time to time. */
static uint8_t all_stuck(uint32_t now_us) {
  uint8_t stuck = stuck_parts(now_us);
  if (is_overdue(now_us, trace.main_us, PORT_PART_LIMIT_us) && trace.activity != CRASH_AT_REST)
    stuck |= CRASH_STUCK_MAIN;
  return stuck ? stuck : CRASH_STUCK_MAIN;
}

static bool timer_runs(void) { return (REG32(RESETS_RESET_DONE) & RESETS_TIMER) != 0; }

_Noreturn void rp2040_take_crash(void);
_Noreturn void rp2040_take_crash(void) {
  const struct fault_frame *frame = &rp2040_fault_frame;
  struct crash_record *record = &kept.record;
  memset(record, 0, sizeof *record);
  const uint32_t guard = (uint32_t)(uintptr_t)__stack_guard;
  const bool is_below = frame->address >= guard && frame->address < (uint32_t)(uintptr_t)__stack_limit;
  record->kind = frame->vector == VECTOR_PANIC        ? CRASH_PANIC
                 : is_below                           ? CRASH_OVERFLOW
                 : frame->vector == VECTOR_HARD_FAULT ? CRASH_FAULT
                 : frame->vector == VECTOR_UNFED      ? CRASH_WATCHDOG
                                                      : CRASH_EXCEPTION;
  record->exception = frame->xpsr & XPSR_EXCEPTION;
  record->vector = (uint8_t)frame->vector;
  record->activity = trace.activity;
  memcpy(&record->r0, frame, offsetof(struct fault_frame, address));
  record->sp = frame->address + (uint32_t)offsetof(struct fault_frame, address) + (frame->xpsr & XPSR_STACK_WAS_ODD ? 4 : 0);
  record->t_us = timer_runs() ? port_now_us() : 0;
  if (record->kind == CRASH_WATCHDOG)
    record->stuck = all_stuck((uint32_t)record->t_us);
  put_events(record);
  kept.crc = kept_crc();
  kept.magic = RECORD_MAGIC;
  __asm volatile("dsb" ::: "memory");

  if (flash_may_erase()) {
    WATCHDOG_LOAD = 2 * (FLASH_ERASE_MAX_us + LAST_WORDS_us);
  } else if (record->kind != CRASH_WATCHDOG) {
    PSM_WDSEL = PSM_WDSEL_ALL_BUT_OSCILLATORS;
    REG32_SET(WATCHDOG_CTRL) = WATCHDOG_CTRL_TRIGGER;
  }
  for (;;) {
  }
}

/* The last life left no record. */
static void reconstruct(bool had_run) {
  memset(&last, 0, sizeof last);
  if (had_run && (WATCHDOG_REASON & WATCHDOG_REASON_TIMER) != 0) {
    last.kind = CRASH_WATCHDOG;
    last.activity = trace.activity;
    last.stuck = CRASH_STUCK_INTERRUPTS;
    last.t_us = trace.fed_us + PORT_WATCHDOG_PERIOD_us;
    put_events(&last);
  } else {
    last.kind = CRASH_START;
  }
}

void crash_start(void) {
  const bool was_ours = WATCHDOG_REASON != 0 && WATCHDOG_SCRATCH0 == STARTED_MAGIC;
  const bool had_run = WATCHDOG_SCRATCH2 == 1; /* before this start */
  resets = was_ours ? WATCHDOG_SCRATCH1 + 1 : 0;
  if (kept.magic == RECORD_MAGIC && kept.crc == kept_crc())
    last = kept.record;
  else if (was_ours)
    reconstruct(had_run);
  kept.magic = 0;
  WATCHDOG_SCRATCH0 = STARTED_MAGIC;
  WATCHDOG_SCRATCH1 = resets;
  WATCHDOG_SCRATCH2 = 0;
  memset(&trace, 0, sizeof trace);
  /* A Cortex-M3 runs the handler of a fault though it could not stack the registers (ARM DDI 0337E
   * 5.12.1); should this core do so too, what is read in their place must have no meaning. */
  // cppcheck-suppress comparePointers ; by the linker script they are of one array
  for (uint32_t *word = __stack_guard; word < __stack_limit; word++)
    *word = 0;
  trace.events[0].code = CRASH_EVENT_START;
  trace.event_count = 1;
  WATCHDOG_LOAD = 2 * PORT_WATCHDOG_PERIOD_us;
}

void crash_watch(void) {
  port_watchdog_feed();
  REG32_SET(TIMER_INTE) = TIMER_ALARM2_BIT;
  rp2040_irq_enable(RP2040_IRQ_TIMER_2);
}

void port_report_alive(enum port_part part) {
  trace.alive_us[part] = TIMER_TIMERAWL;
  trace.watched[part] = true;
}

void port_watchdog_feed(void) {
  const uint64_t now_us = port_now_us();
  trace.main_us = (uint32_t)now_us;
  if (stuck_parts((uint32_t)now_us) != 0)
    return;
  trace.fed_us = now_us;
  WATCHDOG_LOAD = 2 * (PORT_WATCHDOG_PERIOD_us + LAST_WORDS_us);
  TIMER_ALARM2 = (uint32_t)now_us + PORT_WATCHDOG_PERIOD_us;
}

void port_set_activity(enum crash_activity activity) { trace.activity = (uint8_t)activity; }

/* One of a kind at a time, so that what goes on does not push out what led to it. */
void port_log_event(enum crash_event event, uint8_t detail) {
  struct event *newest = &trace.events[(trace.event_count - 1) % CRASH_EVENTS];
  if (newest->code != event)
    newest = &trace.events[trace.event_count++ % CRASH_EVENTS];
  *newest = (struct event){.t_us = port_now_us(), .code = (uint8_t)event, .detail = detail};
}

uint32_t port_watchdog_resets(void) { return resets; }

const struct crash_record *port_last_crash(void) { return &last; }
