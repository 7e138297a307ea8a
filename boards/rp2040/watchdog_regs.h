/* Watchdog with the tick generator, and what its reset reaches (RP2040 datasheet 4.7 watchdog, 2.13
 * power-on state machine). */
#ifndef RP2040_WATCHDOG_REGS_H
#define RP2040_WATCHDOG_REGS_H

#include "rp2040/reg.h"

#define WATCHDOG_BASE 0x40058000u
#define WATCHDOG_CTRL (WATCHDOG_BASE + 0x00u)
#define WATCHDOG_CTRL_ENABLE (1u << 30)
#define WATCHDOG_CTRL_TRIGGER (1u << 31)
/* Counts down twice a tick: erratum RP2040-E1 */
#define WATCHDOG_LOAD REG32(WATCHDOG_BASE + 0x04u)
#define WATCHDOG_REASON REG32(WATCHDOG_BASE + 0x08u)   /* 0: this start was no watchdog's */
#define WATCHDOG_SCRATCH0 REG32(WATCHDOG_BASE + 0x0cu) /* survives everything but power-off */
#define WATCHDOG_TICK REG32(WATCHDOG_BASE + 0x2cu)
#define WATCHDOG_TICK_ENABLE (1u << 9) /* below it: cycles of clk_ref in a tick */

#define PSM_WDSEL REG32(0x40010008u)
#define PSM_WDSEL_ALL_BUT_OSCILLATORS 0x1fffcu

#endif
