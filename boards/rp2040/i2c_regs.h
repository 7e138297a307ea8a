/* I2C0, a Synopsys DW_apb_i2c: the registers and bits used here (RP2040 datasheet 4.3.17). */
#pragma once

#include "rp2040/reg.h"

#define I2C0_BASE 0x40044000u

#define IC_CON REG32(I2C0_BASE + 0x00u) /* written only while disabled */
#define IC_CON_MASTER_MODE (1u << 0)
#define IC_CON_SPEED_FAST (2u << 1)
#define IC_CON_RESTART_EN (1u << 5)
#define IC_CON_SLAVE_DISABLE (1u << 6)

#define IC_TAR REG32(I2C0_BASE + 0x04u) /* written only while disabled */

#define IC_DATA_CMD REG32(I2C0_BASE + 0x10u)
#define IC_DATA_CMD_READ (1u << 8)
#define IC_DATA_CMD_STOP (1u << 9)

#define IC_FS_SCL_HCNT REG32(I2C0_BASE + 0x1cu) /* written only while disabled */
#define IC_FS_SCL_LCNT REG32(I2C0_BASE + 0x20u) /* written only while disabled */

#define IC_INTR_MASK REG32(I2C0_BASE + 0x30u) /* 1: may interrupt */
#define IC_RAW_INTR_STAT REG32(I2C0_BASE + 0x34u)
#define IC_INTR_TX_ABRT (1u << 6)
#define IC_INTR_STOP_DET (1u << 9)

/* Reading clears every interrupt and the abort source. */
#define IC_CLR_INTR REG32(I2C0_BASE + 0x40u)
/* Until it is read, an abort keeps the transmit FIFO flushed (IC_RAW_INTR_STAT.TX_ABRT). */
#define IC_CLR_TX_ABRT REG32(I2C0_BASE + 0x54u)

#define IC_ENABLE REG32(I2C0_BASE + 0x6cu) /* bit 0; 0 flushes both FIFOs */
#define IC_RXFLR REG32(I2C0_BASE + 0x78u)
#define IC_SDA_HOLD REG32(I2C0_BASE + 0x7cu) /* written only while disabled */
/* 0 has the controller lose arbitration to a target that pulls SDA right after SCL falls (Linux,
 * i2c-designware: "avoid aborted transfers with fast reacting I2C slaves"). */
#define IC_SDA_HOLD_RX(cycles) ((cycles) << 16)

#define IC_TX_ABRT_SOURCE REG32(I2C0_BASE + 0x80u)
#define IC_TX_ABRT_7B_ADDR_NOACK (1u << 0)
#define IC_TX_ABRT_TXDATA_NOACK (1u << 3)

#define IC_ENABLE_STATUS REG32(I2C0_BASE + 0x9cu)
#define IC_ENABLE_STATUS_IC_EN (1u << 0) /* follows IC_ENABLE to 0 once the bus is idle */

#define IC_FS_SPKLEN REG32(I2C0_BASE + 0xa0u) /* written only while disabled */
