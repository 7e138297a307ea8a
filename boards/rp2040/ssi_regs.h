/* The serial interface to the flash chip, and its chip select pad (RP2040 datasheet 4.10.13, 2.19).
 * CTRLR0 and BAUDR are written only while the interface is disabled. */
#ifndef RP2040_SSI_REGS_H
#define RP2040_SSI_REGS_H

#include "rp2040/reg.h"

#define SSI_BASE 0x18000000u
#define SSI_CTRLR0 REG32(SSI_BASE + 0x00u)
#define SSI_CTRLR0_8_CLOCKS_A_FRAME (7u << 16) /* single lane, transmit and receive: 0 */
#define SSI_SSIENR REG32(SSI_BASE + 0x08u)
#define SSI_RXFLR REG32(SSI_BASE + 0x24u)
#define SSI_SR REG32(SSI_BASE + 0x28u)
#define SSI_SR_BUSY (1u << 0)
#define SSI_DR0 REG32(SSI_BASE + 0x60u)

#define IO_QSPI_SS_CTRL 0x4001800cu
#define IO_QSPI_SS_CTRL_OUTOVER_LOW (2u << 8)
#define IO_QSPI_SS_CTRL_OUTOVER_MASK (3u << 8)

#endif
