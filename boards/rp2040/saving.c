#include "port/port.h"
#include "rp2040/clocks_regs.h"
#include "rp2040/pico.h"

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

/* clk_usb and its PLL stay: the controller needs them to see the bus wake up, and may hang when the
 * PLL is started again below it (pico-sdk issue 1746). Else as MicroPython's machine.lightsleep():
 * the crystal drives clk_sys, and asleep nothing has a clock but what can end the sleep. The other
 * core sleeps in the boot ROM, deeply. */
static void begin_saving(void) {
  REG32_CLEAR(CLK_SYS_CTRL) = CLK_SYS_SRC_AUX;
  wait_for(CLK_SYS_SELECTED, 1u << CLK_SYS_SRC_REF);
  REG32_SET(PLL_SYS_BASE + PLL_PWR) = PLL_PWR_PD | PLL_PWR_VCOPD | PLL_PWR_POSTDIVPD;
  CLOCKS_SLEEP_EN0 = SLEEP_EN0_PLL_USB;
  CLOCKS_SLEEP_EN1 = SLEEP_EN1_TIMER | SLEEP_EN1_USBCTRL | SLEEP_EN1_WATCHDOG;
  REG32(SCB_SCR) = SCB_SCR_SLEEPDEEP;
  pico_set_supply(PICO_SUPPLY_FRUGAL);
}

static void end_saving(void) {
  pico_set_supply(PICO_SUPPLY_STEADY);
  REG32(SCB_SCR) = 0;
  CLOCKS_SLEEP_EN0 = SLEEP_EN_ALL;
  CLOCKS_SLEEP_EN1 = SLEEP_EN_ALL;
  REG32_CLEAR(PLL_SYS_BASE + PLL_PWR) = PLL_PWR_PD | PLL_PWR_VCOPD;
  wait_for(PLL_SYS_BASE + PLL_CS, PLL_CS_LOCK);
  REG32_CLEAR(PLL_SYS_BASE + PLL_PWR) = PLL_PWR_POSTDIVPD;
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
