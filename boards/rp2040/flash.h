/* The flash chip behind the SSI, by its own commands (W25Q16JV and its kin; RP2040 datasheet 4.10).
 *
 * Everything runs from SRAM once it is copied there, so the SSI leaves execution in place for good, and what port/flash.h asks for needs no
 * interrupt disabled and no wait: commands go out in slices that fit into the FIFOs, and the chip is busy by itself. */
#pragma once

#include "common/status.h"

#include <stdbool.h>
#include <stdint.h>

enum { FLASH_ID_BYTES = 8 };

/* To be called once, before any other function here or of port/flash.h: ends execution in place and waits until the chip is not busy. A
 * reset does not reach the chip, and it may be erasing still, for 400 ms at most. FT_ERR_TIMEOUT: it does not answer. */
enum ft_status flash_start(void);

/* The unique id of the chip. Takes 4 us. FT_ERR_TIMEOUT. */
enum ft_status flash_read_id(uint8_t id[FLASH_ID_BYTES]);

/* An erase was begun and has not been seen to end: a reset of the RP2040, which does not reach the chip, had better
 * wait for as long as one takes. The boot ROM tries to read the chip for 255 ms only if the ring oscillator is fast,
 * and then stays in its USB loader (pico-bootrom, bootrom_main.c _flash_boot()). */
#define FLASH_ERASE_MAX_us 400000u /* W25Q16JV datasheet 9.6 */
bool flash_may_erase(void);
