#include "rp2040/clocks.h"

#include "port/port.h"
#include "rp2040/clocks_regs.h"
#include "rp2040/resets.h"
#include "rp2040/watchdog_regs.h"

/* A poll takes about ten cycles and the ring oscillator gives at most 12 MHz: at least 80 ms. The crystal needs 6 ms, a PLL 50 us. */
enum { POLLS = 100000 };

/* Some crystals swing in full after 1 ms of cycles only, and what they drive before stops the chip; the SDK counts 6 ms (pico-sdk
 * hardware/xosc.h, issue 2234; rp2040_hal issue 44). A slower one is left to the watchdog, whose reset does not stop the crystal. */
enum { CRYSTAL_kHz = 12000, CRYSTAL_STARTUP_ms = 6 };

_Noreturn void clocks_reset_chip(void) {
  PSM_WDSEL = PSM_WDSEL_ALL_BUT_OSCILLATORS;
  REG32_SET(WATCHDOG_CTRL) = WATCHDOG_CTRL_TRIGGER;
  for (;;) {
  }
}

/* Counts ticks of clk_ref, which are up to seven times as long until the crystal drives it. */
static void start_watchdog(void) {
  PSM_WDSEL = PSM_WDSEL_ALL_BUT_OSCILLATORS;
  WATCHDOG_TICK = WATCHDOG_TICK_ENABLE | CRYSTAL_kHz / 1000;
  WATCHDOG_LOAD = 2 * PORT_WATCHDOG_PERIOD_us;
  REG32_SET(WATCHDOG_CTRL) = WATCHDOG_CTRL_ENABLE;
}

static void wait_for(uint32_t address, uint32_t bits) {
  for (int polls = 0; polls < POLLS; polls++) {
    if (REG32(address) & bits)
      return;
  }
  clocks_reset_chip();
}

static void start_pll(uint32_t base, uint32_t feedback_divider, uint32_t post_dividers) {
  pll_begin(base, feedback_divider);
  wait_for(base + PLL_CS, PLL_CS_LOCK);
  pll_end(base, post_dividers);
}

void clocks_start(void) {
  /* A debugger may come here with everything running, and whatever ran before may have left other
   * sources and dividers, as pico-sdk's clock_configure() expects too. */
  REG32(CLK_SYS_RESUS_CTRL) = 0;
  REG32_CLEAR(CLK_SYS_CTRL) = CLK_SYS_SRC_AUX;
  wait_for(CLK_SYS_SELECTED, 1u << CLK_SYS_SRC_REF);
  REG32(CLK_SYS_CTRL) = CLK_SYS_SRC_REF;
  REG32(CLK_REF_CTRL) = CLK_REF_SRC_ROSC;
  wait_for(CLK_REF_SELECTED, 1u << CLK_REF_SRC_ROSC);
  REG32_CLEAR(CLK_PERI_CTRL) = CLK_CTRL_ENABLE;
  REG32_CLEAR(CLK_USB_CTRL) = CLK_CTRL_ENABLE;
  REG32(CLK_REF_DIV) = CLK_DIV_1;
  REG32(CLK_SYS_DIV) = CLK_DIV_1;
  REG32(CLK_USB_DIV) = CLK_DIV_1;
  REG32(CLK_PERI_CTRL) = 0;
  REG32(CLK_USB_CTRL) = 0;
  resets_assert(RESETS_ALL & ~(RESETS_IO_QSPI | RESETS_PADS_QSPI));
  WATCHDOG_SCRATCH2++; /* starts since the firmware last ran: crash.c */
  start_watchdog();

  if ((REG32(XOSC_STATUS) & XOSC_STATUS_STABLE) == 0) {
    REG32(XOSC_CTRL) = XOSC_CTRL_1_TO_15_MHZ;
    XOSC_STARTUP = (CRYSTAL_kHz + 128) / 256 * CRYSTAL_STARTUP_ms;
    REG32_SET(XOSC_CTRL) = XOSC_CTRL_ENABLE;
    wait_for(XOSC_STATUS, XOSC_STATUS_STABLE);
  }

  if (resets_release(RESETS_PLL_SYS | RESETS_PLL_USB) != FT_OK)
    clocks_reset_chip();
  start_pll(PLL_SYS_BASE, PLL_SYS_FEEDBACK, PLL_SYS_POST_DIVIDERS);
  start_pll(PLL_USB_BASE, PLL_USB_FEEDBACK, PLL_USB_POST_DIVIDERS);

  REG32(CLK_REF_CTRL) = CLK_REF_SRC_XOSC;
  wait_for(CLK_REF_SELECTED, 1u << CLK_REF_SRC_XOSC);
  REG32_SET(CLK_SYS_CTRL) = CLK_SYS_SRC_AUX;
  wait_for(CLK_SYS_SELECTED, 1u << CLK_SYS_SRC_AUX);
  REG32(CLK_PERI_CTRL) = CLK_CTRL_ENABLE;
  REG32(CLK_USB_CTRL) = CLK_CTRL_ENABLE;
}
