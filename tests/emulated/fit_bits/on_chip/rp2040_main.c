/* An image for the emulated RP2040: run_on_chip.mjs plays the debugger that its breakpoint calls,
 * takes the last CRC and names the next press, and the processor that fits it. */
#include "fit_bits.h"
#include "port/port.h"
#include "worker/worker.h"

/* In this order, as run_on_chip.mjs reads and writes them. second: on the second processor. */
static struct { uint32_t kernel, press, crc, second; } job;
static struct worker worker;

static void fit(void *context) {
  (void)context;
  job.crc = fit_bits_of((enum fit_bits_kernel)job.kernel, job.press);
}

static bool serve(void *context) {
  (void)context;
  return worker_serve(&worker);
}

int main(void) {
  extern uint32_t __bss_start[]; /* the second processor writes to what lies behind */
  bool is_started = false;
  fit_bits_init();
  worker_init(&worker, fit, &job);
  for (;;) {
    register void *argument __asm("r0") = &job;
    __asm volatile("bkpt 1" : : "r"(argument) : "memory");
    port_watchdog_feed();
    if (job.kernel >= FIT_BITS_KERNELS) {
      port_panic();
    }
    if (job.second && !is_started) {
      is_started = port_worker_start(serve, __bss_start);
    }
    worker_ask(&worker);
    if (is_started) {
      port_worker_wake();
      while (!worker_is_free(&worker)) {
        __asm volatile("wfe");
      }
    } else {
      worker_serve(&worker);
    }
  }
}
