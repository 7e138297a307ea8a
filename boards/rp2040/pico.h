/* What a Raspberry Pi Pico wires to its own chip (pico-sdk, boards/pico.h). */
#pragma once

#include "common/status.h"

enum pico_supply {
  PICO_SUPPLY_PFM, /* the regulator of 3V3 switches when it must: it draws less itself */
  PICO_SUPPLY_PWM, /* at a fixed rate: less ripple, for it feeds the sensors */
};

/* Takes the pin into use, steady, but on a Pico W, where it is another's (FINGERTIP_PICO_W): the supply stays frugal.
 * FT_ERR_TIMEOUT: a block does not leave reset. */
enum ft_status pico_start(void);

void pico_set_supply(enum pico_supply supply);
