/* An image for the emulated RP2040: run_on_chip.mjs plays the debugger that its breakpoint calls,
 * takes the last CRC and names the next press. */
#include "fit_bits.h"
#include "port/port.h"

/* In this order, as run_on_chip.mjs reads and writes them. */
static struct { uint32_t kernel, press, crc; } job;

int main(void) {
  fit_bits_init();
  for (;;) {
    register void *argument __asm("r0") = &job;
    __asm volatile("bkpt 1" : : "r"(argument) : "memory");
    port_watchdog_feed();
    if (job.kernel >= FIT_BITS_KERNELS) {
      port_panic();
    }
    job.crc = fit_bits_of((enum fit_bits_kernel)job.kernel, job.press);
  }
}
