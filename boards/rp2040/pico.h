/* What a Raspberry Pi Pico wires to its own chip (pico-sdk, boards/pico.h). */
#ifndef RP2040_PICO_H
#define RP2040_PICO_H

#include "common/status.h"

/* Has the regulator of 3V3, which feeds the sensors, switch at a fixed rate: less ripple at the
 * little that is drawn. FT_ERR_TIMEOUT: a block does not leave reset. */
enum ft_status pico_steady_supply(void);

#endif
