/* port_divide() on the divider of the SIO: 8 cycles after the divisor is written (RP2040 datasheet
 * 2.3.1.5). One per core and not saved by interrupts, so no handler may divide with it:
 * port/divide.h leaves it to the main context, and libgcc's own division does not use it.
 */
#ifndef RP2040_DIVIDE_H
#define RP2040_DIVIDE_H

#include <stdint.h>

static inline __attribute__((always_inline)) int32_t port_divide(int32_t numerator,
                                                                 int32_t denominator) {
  volatile int32_t *const divider = (volatile int32_t *)0xd0000068; /* DIV_SDIVIDEND */
  divider[0] = numerator;
  divider[1] = denominator;                                           /* DIV_SDIVISOR starts it */
  __asm volatile("b 1f\n1: b 1f\n1: b 1f\n1: b 1f\n1:" ::: "memory"); /* 4 x 2 cycles */
  return divider[2];                                                  /* DIV_QUOTIENT */
}

#endif
