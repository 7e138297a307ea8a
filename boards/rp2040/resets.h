/* Subsystem resets (RP2040 datasheet 2.14). A block is unusable, and its registers must not be touched, until it has been released. */
#pragma once

#include "common/status.h"
#include "rp2040/reg.h"

#include <stdint.h>

/* Bits of RESET and RESET_DONE */
#define RESETS_DMA (UINT32_C(1) << 2)
#define RESETS_I2C0 (UINT32_C(1) << 3)
#define RESETS_IO_BANK0 (UINT32_C(1) << 5)
#define RESETS_IO_QSPI (UINT32_C(1) << 6)
#define RESETS_PADS_BANK0 (UINT32_C(1) << 8)
#define RESETS_PADS_QSPI (UINT32_C(1) << 9)
#define RESETS_PIO0 (UINT32_C(1) << 10)
#define RESETS_PIO1 (UINT32_C(1) << 11)
#define RESETS_PLL_SYS (UINT32_C(1) << 12)
#define RESETS_PLL_USB (UINT32_C(1) << 13)
#define RESETS_SYSINFO (UINT32_C(1) << 19)
#define RESETS_TIMER (UINT32_C(1) << 21)
#define RESETS_USBCTRL (UINT32_C(1) << 24)
#define RESETS_ALL ((UINT32_C(1) << 25) - 1)

#define RESETS_RESET 0x4000c000u
#define RESETS_RESET_DONE 0x4000c008u

/* Puts the blocks into reset, at once and whatever they are doing. */
static inline void resets_assert(uint32_t blocks) { REG32_SET(RESETS_RESET) = blocks; }

/* Releases the blocks and waits, a few cycles of the slowest block's own clock, until all report
 * that they are out of reset. FT_ERR_TIMEOUT: a block did not, because its clock does not run. */
static inline enum ft_status resets_release(uint32_t blocks) {
  REG32_CLEAR(RESETS_RESET) = blocks;
  for (int polls = 0; polls < 1000; polls++) {
    if ((~REG32(RESETS_RESET_DONE) & blocks) == 0)
      return FT_OK;
  }
  return FT_ERR_TIMEOUT;
}
