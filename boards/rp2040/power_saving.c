#include "port/port.h"
#include "rp2040/clocks_regs.h"
#include "rp2040/pico.h"
#include "rp2040/resets.h"

/* At 12 MHz or more a poll takes 5 us at most; a PLL locks within 50 us. */
enum { POLLS = 100000 };

static bool saves;

static void wait_for(uint32_t address, uint32_t bits) {
  for (int polls = 0; polls < POLLS; polls++) {
    if (REG32(address) & bits)
      return;
  }
  port_panic();
}

#define SCB_SCR 0xe000ed10u
#define SCB_SCR_SLEEPDEEP (1u << 2)

/* clk_usb and its PLL stay: the controller needs them to see the bus wake up, and may hang when the PLL is started again below it (pico-sdk
 * issue 1746). Else as MicroPython's machine.lightsleep(): the crystal drives clk_sys, and asleep nothing has a clock but what can end the
 * sleep. The other core sleeps deeply too, in the boot ROM or in second_core.c. It is written nowhere what the controller does with traffic
 * while clk_sys is slower than its own 48 MHz. There is none: a host signals a resume for 20 ms and a reset for 10 (USB 2.0, 7.1.7), and
 * clk_sys is fast again within 1. */
static void begin_saving(void) {
  REG32_CLEAR(CLK_SYS_CTRL) = CLK_SYS_SRC_AUX;
  wait_for(CLK_SYS_SELECTED, 1u << CLK_SYS_SRC_REF);
  resets_assert(RESETS_PLL_SYS); /* which takes its power too, and its lock */
  CLOCKS_SLEEP_EN0 = SLEEP_EN0_PLL_USB;
  CLOCKS_SLEEP_EN1 = SLEEP_EN1_TIMER | SLEEP_EN1_USBCTRL | SLEEP_EN1_WATCHDOG;
  REG32(SCB_SCR) = SCB_SCR_SLEEPDEEP;
  pico_set_supply(PICO_SUPPLY_PFM);
}

static void end_saving(void) {
  pico_set_supply(PICO_SUPPLY_PWM);
  REG32(SCB_SCR) = 0;
  CLOCKS_SLEEP_EN0 = SLEEP_EN_ALL;
  CLOCKS_SLEEP_EN1 = SLEEP_EN_ALL;
  if (resets_release(RESETS_PLL_SYS) != FT_OK)
    port_panic();
  pll_begin(PLL_SYS_BASE, PLL_SYS_FEEDBACK);
  wait_for(PLL_SYS_BASE + PLL_CS, PLL_CS_LOCK);
  pll_end(PLL_SYS_BASE, PLL_SYS_POST_DIVIDERS);
  REG32_SET(CLK_SYS_CTRL) = CLK_SYS_SRC_AUX;
  wait_for(CLK_SYS_SELECTED, 1u << CLK_SYS_SRC_AUX);
}

void port_save_power(bool saving) {
  if (saves == saving)
    return;
  saves = saving;
  if (saving)
    begin_saving();
  else
    end_saving();
}
