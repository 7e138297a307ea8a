/* The unique id of the flash chip. */
#ifndef RP2040_FLASH_ID_H
#define RP2040_FLASH_ID_H

#include "common/status.h"

#include <stdint.h>

enum { FLASH_ID_BYTES = 8 };

/* Reads it (command 4Bh of the W25Q16JV and its kin; about 4 us). Execution in place stops
 * meanwhile, so nothing else may run from flash. FT_ERR_TIMEOUT: the interface did not finish. */
enum ft_status flash_read_id(uint8_t id[FLASH_ID_BYTES]);

#endif
