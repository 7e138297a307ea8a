/* Watchdog with the tick generator, and what its reset reaches (RP2040 datasheet 4.7 watchdog, 2.13 power-on state machine). */
#pragma once

#include "rp2040/reg.h"

#define WATCHDOG_BASE 0x40058000u
#define WATCHDOG_CTRL (WATCHDOG_BASE + 0x00u)
#define WATCHDOG_CTRL_ENABLE (1u << 30)
#define WATCHDOG_CTRL_TRIGGER (1u << 31)
/* Counts down twice a tick: erratum RP2040-E1 */
#define WATCHDOG_LOAD REG32(WATCHDOG_BASE + 0x04u)
#define WATCHDOG_REASON REG32(WATCHDOG_BASE + 0x08u) /* 0: this start was no watchdog's */
#define WATCHDOG_REASON_TIMER (1u << 0)              /* not fed; else triggered */
/* Survive the watchdog's reset, and nothing else. The boot ROM reads 4 to 7, of which 4 makes it start from elsewhere,
 * and writes 0 and 1 on its way into the USB loader (pico-bootrom-rp2040, bootrom_rt0.S "Check watchdog scratch" and
 * bootrom_main.c reset_usb_boot(); the SDK uses 4 in watchdog_enable()). */
#define WATCHDOG_SCRATCH0 REG32(WATCHDOG_BASE + 0x0cu)
#define WATCHDOG_SCRATCH1 REG32(WATCHDOG_BASE + 0x10u)
#define WATCHDOG_SCRATCH2 REG32(WATCHDOG_BASE + 0x14u)
#define WATCHDOG_TICK REG32(WATCHDOG_BASE + 0x2cu)
#define WATCHDOG_TICK_ENABLE (1u << 9) /* below it: cycles of clk_ref in a tick */

#define PSM_WDSEL REG32(0x40010008u)
#define PSM_WDSEL_ALL_BUT_OSCILLATORS 0x1fffcu
