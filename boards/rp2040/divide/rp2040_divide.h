/* port_divide() on the divider of the SIO: 8 cycles after the divisor is written (RP2040 datasheet 2.3.1.5). One per core and not saved by
 * interrupts, so no handler may divide with it: port/divide.h leaves it to the main context, and libgcc's own division does not use it. */
#pragma once

#include <stdint.h>

static inline __attribute__((always_inline)) int32_t port_divide(int32_t numerator, int32_t denominator) {
  const uint32_t sio = 0xd0000060;
  int32_t quotient;
  __asm("str %1, [%3, #8]\n\t"                     /* DIV_SDIVIDEND */
        "str %2, [%3, #12]\n\t"                    /* DIV_SDIVISOR starts it */
        "b 1f\n1:\tb 1f\n1:\tb 1f\n1:\tb 1f\n1:\t" /* 4 x 2 cycles */
        "ldr %0, [%3, #16]"                        /* DIV_QUOTIENT */
        : "=l"(quotient)
        : "l"(numerator), "l"(denominator), "l"(sio));
  return quotient;
}
