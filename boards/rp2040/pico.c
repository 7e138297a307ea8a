#include "rp2040/pico.h"

#include "rp2040/gpio.h"
#include "rp2040/resets.h"

enum { PIN_REGULATOR_MODE = 23 }; /* PICO_SMPS_MODE_PIN: high is PWM */

void pico_set_supply(enum pico_supply supply) { gpio_write(PIN_REGULATOR_MODE, supply == PICO_SUPPLY_PWM); }

enum ft_status pico_start(void) {
  const enum ft_status status = resets_release(RESETS_IO_BANK0 | RESETS_PADS_BANK0);
  if (status == FT_OK && !FT_PICO_W) {
    pico_set_supply(PICO_SUPPLY_PWM);
    gpio_drive(PIN_REGULATOR_MODE, true);
    gpio_set_pad(PIN_REGULATOR_MODE, GPIO_PULL_NONE);
    gpio_set_function(PIN_REGULATOR_MODE, GPIO_FUNCTION_SIO);
  }
  return status;
}
