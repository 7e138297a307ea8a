/* PIO0 (RP2040 datasheet 3.7) and the encoding of its instructions (3.4). */
#ifndef RP2040_PIO_REGS_H
#define RP2040_PIO_REGS_H

#include "rp2040/reg.h"

#define PIO0_BASE 0x50200000u
#define PIO0_CTRL REG32(PIO0_BASE + 0x00u)
#define PIO0_TXF0_ADDRESS (PIO0_BASE + 0x10u)
#define PIO0_RXF0_ADDRESS (PIO0_BASE + 0x20u)
#define PIO0_INSTR_MEM(i) REG32(PIO0_BASE + 0x48u + 4u * (i))
#define PIO0_SM0_CLKDIV REG32(PIO0_BASE + 0xc8u)
#define PIO0_SM0_EXECCTRL REG32(PIO0_BASE + 0xccu)
#define PIO0_SM0_SHIFTCTRL REG32(PIO0_BASE + 0xd0u)
#define PIO0_SM0_INSTR REG32(PIO0_BASE + 0xd8u) /* executes what is written */
#define PIO0_SM0_PINCTRL REG32(PIO0_BASE + 0xdcu)

#define PIO_CTRL_SM0_ENABLE (1u << 0)
#define PIO_CLKDIV_INT(divider) ((uint32_t)(divider) << 16)
#define PIO_EXECCTRL_WRAP(bottom, top) ((uint32_t)(top) << 12 | (uint32_t)(bottom) << 7)
/* Shifts to the right, refilled and emptied a whole word (threshold 0) at a time */
#define PIO_SHIFTCTRL_OUT_RIGHT (1u << 19)
#define PIO_SHIFTCTRL_IN_RIGHT (1u << 18)
#define PIO_SHIFTCTRL_AUTOPULL (1u << 17)
#define PIO_SHIFTCTRL_AUTOPUSH (1u << 16)
#define PIO_PINCTRL_OUT(base, count) ((uint32_t)(count) << 20 | (uint32_t)(base))
#define PIO_PINCTRL_IN(base) ((uint32_t)(base) << 15)

#define PIO_OUT_PINDIRS(count, delay) (0x6080u | (uint32_t)(delay) << 8 | (uint32_t)(count))
#define PIO_IN_PINS(count, delay) (0x4000u | (uint32_t)(delay) << 8 | (uint32_t)(count))
#define PIO_MOV_PINS_NULL 0xa003u

#endif
