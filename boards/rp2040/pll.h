/* Starting a PLL, in the order of pico-sdk's pll_init() (RP2040 datasheet 2.18). Its block comes
 * out of a reset: the status of a PLL that ran before may still report a lock. */
#ifndef RP2040_PLL_H
#define RP2040_PLL_H

#include "rp2040/clocks_regs.h"

/* Then wait for PLL_CS_LOCK; 50 us. */
static inline void pll_begin(uint32_t base, uint32_t feedback_divider) {
  REG32(base + PLL_CS) = 1; /* reference divider */
  REG32(base + PLL_FBDIV_INT) = feedback_divider;
  REG32_CLEAR(base + PLL_PWR) = PLL_PWR_PD | PLL_PWR_VCOPD;
}

static inline void pll_end(uint32_t base, uint32_t post_dividers) {
  REG32(base + PLL_PRIM) = post_dividers;
  REG32_CLEAR(base + PLL_PWR) = PLL_PWR_POSTDIVPD;
}

#endif
