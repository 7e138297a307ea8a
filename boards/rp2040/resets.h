/* Subsystem resets (RP2040 datasheet 2.14). A block is unusable, and its registers must not be
 * touched, until it has been released.
 */
#ifndef RP2040_RESETS_H
#define RP2040_RESETS_H

#include "common/status.h"

#include <stdint.h>

/* Bits of RESET and RESET_DONE */
#define RESETS_DMA (UINT32_C(1) << 2)
#define RESETS_I2C0 (UINT32_C(1) << 3)
#define RESETS_IO_BANK0 (UINT32_C(1) << 5)
#define RESETS_PADS_BANK0 (UINT32_C(1) << 8)
#define RESETS_PIO0 (UINT32_C(1) << 10)
#define RESETS_PLL_SYS (UINT32_C(1) << 12)
#define RESETS_PLL_USB (UINT32_C(1) << 13)
#define RESETS_TIMER (UINT32_C(1) << 21)
#define RESETS_USBCTRL (UINT32_C(1) << 24)

/* Puts the blocks into reset, at once and whatever they are doing. */
void resets_assert(uint32_t blocks);

/* Releases the blocks and waits, a few cycles, until all report that they are out of reset.
 * FT_ERR_TIMEOUT: a block did not, because its clock does not run. */
enum ft_status resets_release(uint32_t blocks);

#endif
