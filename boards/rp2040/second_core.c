/* The second processor behind port.h. It runs from SRAM, as everything does, so that the flash may
 * be busy meanwhile. It has a stack of its own in the bank below the first one's, a divider and an
 * MPU of its own, and no interrupts. A fault parks it (fault.S), and port.h's caller finds it late.
 *
 * It waits in deep sleep, or the other processor's would not stop the clocks (datasheet 2.11.5). */
#include "port/port.h"
#include "rp2040/mpu.h"
#include "rp2040/sio_regs.h"

#define SCB_SCR REG32(0xe000ed10u)
#define SCB_SCR_SLEEPDEEP (1u << 2)

/* The boot ROM answers a word within a microsecond. A poll takes 8 cycles or more. */
enum { POLLS = 1000, TRIES = 32 };

static struct {
  bool (*serve)(void *context);
  void *context;
} work;

extern uint32_t __second_stack_top[];
extern const uint32_t __second_stack_guard[], __vectors[];

static void send_event(void) { __asm volatile("sev" ::: "memory"); }

static _Noreturn void run(void) {
  mpu_protect(__second_stack_guard, 8u, work.context); /* what is before it is the first one's */
  SCB_SCR = SCB_SCR_SLEEPDEEP;
  for (;;) {
    while (work.serve(work.context))
      send_event();
    __asm volatile("wfe" ::: "memory");
  }
}

static bool wait_for(uint32_t bits) {
  int polls = 0;
  while (!(SIO_FIFO_ST & bits) && polls < POLLS)
    polls++;
  return polls < POLLS;
}

static bool is_echoed(uint32_t word) {
  if (word == 0) {
    while (SIO_FIFO_ST & SIO_FIFO_ST_VALID)
      (void)SIO_FIFO_RD;
    send_event(); /* it may wait for room */
  }
  if (!wait_for(SIO_FIFO_ST_READY))
    return false;
  SIO_FIFO_WR = word;
  send_event();
  return wait_for(SIO_FIFO_ST_VALID) && SIO_FIFO_RD == word;
}

/* The handshake of the boot ROM (pico-bootrom-rp2040, bootrom_rt0.S wait_for_vector). */
static bool launch(void) {
  const uint32_t words[] = {
      0, 0, 1, (uint32_t)(uintptr_t)__vectors, (uint32_t)(uintptr_t)__second_stack_top, (uint32_t)(uintptr_t)run,
  };
  const unsigned count = sizeof words / sizeof words[0];
  unsigned next = 0;
  for (int tries = 0; next < count && tries < TRIES; tries++)
    next = is_echoed(words[next]) ? next + 1 : 0;
  return next == count;
}

bool port_worker_start(bool (*serve)(void *context), void *context) {
  port_worker_stop();
  work.serve = serve;
  work.context = context;
  REG32_CLEAR(PSM_FRCE_OFF) = PSM_PROC1;
  const bool started = launch();
  if (!started) {
    port_worker_stop();
    port_log_event(CRASH_EVENT_WORKER, 1);
  }
  return started;
}

void port_worker_wake(void) { send_event(); }
