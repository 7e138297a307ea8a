/* The memory protection unit of the core (ARMv6-M Architecture Reference Manual B3.5). */
#ifndef RP2040_MPU_REGS_H
#define RP2040_MPU_REGS_H

#include "rp2040/reg.h"

#define MPU_CTRL REG32(0xe000ed94u)
#define MPU_CTRL_DEFAULT_MAP (1u << 2) /* where no region is */
#define MPU_CTRL_ENABLE (1u << 0)      /* but in fault handlers */
#define MPU_RBAR REG32(0xe000ed9cu)    /* base address, aligned to the size */
#define MPU_RBAR_REGION(number) (1u << 4 | (number))
#define MPU_RASR REG32(0xe000eda0u)
#define MPU_RASR_NO_ACCESS (1u << 28) /* and no execution */
#define MPU_RASR_READ_ONLY (6u << 24)
#define MPU_RASR_NORMAL (1u << 17)                           /* memory, from which code runs */
#define MPU_RASR_EIGHTHS(count) (0xff00u << (count)&0xff00u) /* in force: the first of them */
#define MPU_RASR_BYTES(log2) (((log2)-1u) << 1)
#define MPU_RASR_ENABLE (1u << 0)

#endif
