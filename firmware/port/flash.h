/* The seam between the store and the flash that keeps it, which the board provides at link time: a few sectors of NOR
 * flash that no image reaches. Erasing makes all bits of a sector 1, programming makes some of them 0.
 *
 * Nothing here waits: one operation at a time is begun, and port_flash_poll() takes it a step further. No call takes
 * longer than a few microseconds. Power lost in the middle leaves the bits that were to change undefined, and such that
 * they need not read the same twice. Main context only. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
  PORT_FLASH_SECTORS = 2,
  PORT_FLASH_SECTOR_BYTES = 4096,
  PORT_FLASH_PAGE_BYTES = 256,
  PORT_FLASH_READ_BYTES = 12, /* at most, at once */
};

/* An operation may begin only while none is under way; addresses count from the first sector on. */

void port_flash_erase(unsigned sector);

/* At least one byte, all within one page. They must stay until the operation has ended. */
void port_flash_program(uint32_t at, const uint8_t *bytes, size_t length);

/* Whether an operation is still under way. */
bool port_flash_poll(void);

/* Bytes of no meaning if the flash does not answer. */
void port_flash_read(uint32_t at, uint8_t *bytes, size_t length);
