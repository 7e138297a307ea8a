/* Oscillators, PLLs and clock generators: the registers and bits used here (RP2040 datasheet 2.15
 * clocks, 2.16 XOSC, 2.17 ROSC, 2.18 PLL). */
#pragma once

#include "rp2040/reg.h"

#define CLOCKS_BASE 0x40008000u
#define CLK_REF_CTRL (CLOCKS_BASE + 0x30u)
#define CLK_REF_DIV (CLOCKS_BASE + 0x34u)
#define CLK_REF_SELECTED (CLOCKS_BASE + 0x38u) /* bit n: source n drives the clock */
#define CLK_REF_SRC_ROSC 0u
#define CLK_REF_SRC_XOSC 2u
#define CLK_SYS_CTRL (CLOCKS_BASE + 0x3cu)
#define CLK_SYS_DIV (CLOCKS_BASE + 0x40u)
#define CLK_SYS_SELECTED (CLOCKS_BASE + 0x44u)
#define CLK_SYS_SRC_REF 0u
#define CLK_SYS_SRC_AUX 1u                  /* AUXSRC 0: PLL_SYS */
#define CLK_PERI_CTRL (CLOCKS_BASE + 0x48u) /* AUXSRC 0: clk_sys */
#define CLK_USB_CTRL (CLOCKS_BASE + 0x54u)  /* AUXSRC 0: PLL_USB */
#define CLK_USB_DIV (CLOCKS_BASE + 0x58u)
#define CLK_CTRL_ENABLE (1u << 11)
#define CLK_DIV_1 (1u << 8)
#define CLK_SYS_RESUS_CTRL (CLOCKS_BASE + 0x78u)
/* What has a clock while the processors are in deep sleep (2.11.2) */
#define CLOCKS_SLEEP_EN0 REG32(CLOCKS_BASE + 0xa8u)
#define SLEEP_EN0_PLL_USB (1u << 15)
#define CLOCKS_SLEEP_EN1 REG32(CLOCKS_BASE + 0xacu)
#define SLEEP_EN1_TIMER (1u << 5)
#define SLEEP_EN1_USBCTRL (3u << 10) /* clk_sys and clk_usb */
#define SLEEP_EN1_WATCHDOG (1u << 12)
#define SLEEP_EN_ALL UINT32_MAX

#define XOSC_BASE 0x40024000u
#define XOSC_CTRL (XOSC_BASE + 0x00u)
#define XOSC_CTRL_1_TO_15_MHZ 0xaa0u
#define XOSC_CTRL_ENABLE (0xfabu << 12)
#define XOSC_STATUS (XOSC_BASE + 0x04u)
#define XOSC_STATUS_STABLE (1u << 31)
#define XOSC_STARTUP REG32(XOSC_BASE + 0x0cu) /* in units of 256 cycles of the crystal */

#define PLL_SYS_BASE 0x40028000u
#define PLL_USB_BASE 0x4002c000u
#define PLL_CS 0x00u
#define PLL_CS_LOCK (1u << 31)
#define PLL_PWR 0x04u
#define PLL_PWR_PD (1u << 0)
#define PLL_PWR_POSTDIVPD (1u << 3)
#define PLL_PWR_VCOPD (1u << 5)
#define PLL_FBDIV_INT 0x08u
#define PLL_PRIM 0x0cu
#define PLL_PRIM_POSTDIV1(n) ((uint32_t)(n) << 16)
#define PLL_PRIM_POSTDIV2(n) ((uint32_t)(n) << 12)
/* 1500 / 12 MHz and 1200 / 25 MHz, of a crystal of 12 MHz */
#define PLL_SYS_FEEDBACK 125u
#define PLL_SYS_POST_DIVIDERS (PLL_PRIM_POSTDIV1(6) | PLL_PRIM_POSTDIV2(2))
#define PLL_USB_FEEDBACK 100u
#define PLL_USB_POST_DIVIDERS (PLL_PRIM_POSTDIV1(5) | PLL_PRIM_POSTDIV2(5))

/* Starting a PLL, in the order of pico-sdk's pll_init(). Its block comes out of a reset: the status of a PLL that ran
 * before may still report a lock. */

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
