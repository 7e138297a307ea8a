/* port/flash.h on the host: in memory, with power that can be lost at any step. Each beginning of an operation and each poll of it is a
 * step; an operation takes a few. What it changes when power is lost is random: some bits have changed, some have not, and some read
 * differently from now on, at each reading or at each power-up, until they are programmed or erased again.
 *
 * What a real flash would punish stops the test program: two operations at once, bytes beyond a page. */
#pragma once

#include "port/flash.h"

enum { NATIVE_FLASH_BYTES = PORT_FLASH_SECTORS * PORT_FLASH_SECTOR_BYTES };

struct native_flash {
  uint8_t bytes[NATIVE_FLASH_BYTES];
  uint8_t unstable[NATIVE_FLASH_BYTES]; /* bits that read as they like */
};

extern struct native_flash native_flash;

/* Erased and with power. The seed is that of every random choice. */
void native_flash_reset(uint64_t seed);

/* Steps until power is lost: 0 at the next one. */
void native_flash_cut_after(uint64_t steps);

/* Whether it has been lost. Reads then give ones, operations never end. */
bool native_flash_is_dead(void);

/* Power comes back, or goes and comes back: what was under way has been cut short. */
void native_flash_power_up(void);

/* From now on bits cannot be programmed any more: a flash that has worn out. */
void native_flash_wear_out(void);
