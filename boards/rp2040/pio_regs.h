/* PIO0 and PIO1 (RP2040 datasheet 3.7) and the encoding of its instructions (3.4). */
#pragma once

#include "rp2040/reg.h"

#define PIO0_BASE 0x50200000u
#define PIO1_BASE 0x50300000u
#define PIO_CTRL(base) REG32((base) + 0x00u)
#define PIO_TXF0_ADDRESS(base) ((base) + 0x10u)
#define PIO_RXF0_ADDRESS(base) ((base) + 0x20u)
#define PIO_INSTR_MEM(base, i) REG32((base) + 0x48u + 4u * (i))
#define PIO_SM0_CLKDIV(base) REG32((base) + 0xc8u)
#define PIO_SM0_EXECCTRL(base) REG32((base) + 0xccu)
#define PIO_SM0_SHIFTCTRL(base) REG32((base) + 0xd0u)
#define PIO_SM0_INSTR(base) REG32((base) + 0xd8u) /* executes what is written */
#define PIO_SM0_PINCTRL(base) REG32((base) + 0xdcu)

#define PIO_CTRL_SM0_ENABLE (1u << 0)
#define PIO_CTRL_SM0_RESTART (1u << 4)
#define PIO_CLKDIV_INT(divider) ((uint32_t)(divider) << 16)
#define PIO_EXECCTRL_JUMP_PIN(pin) ((uint32_t)(pin) << 24)
#define PIO_EXECCTRL_WRAP(bottom, top) ((uint32_t)(top) << 12 | (uint32_t)(bottom) << 7)
/* Shifts to the right, refilled and emptied a whole word (threshold 0) at a time */
#define PIO_SHIFTCTRL_OUT_RIGHT (1u << 19)
#define PIO_SHIFTCTRL_IN_RIGHT (1u << 18)
#define PIO_SHIFTCTRL_AUTOPULL (1u << 17)
#define PIO_SHIFTCTRL_AUTOPUSH (1u << 16)
#define PIO_SHIFTCTRL_JOIN_RX (1u << 31) /* eight words; a change of the bit empties the FIFO */
#define PIO_PINCTRL_OUT(base, count) ((uint32_t)(count) << 20 | (uint32_t)(base))
#define PIO_PINCTRL_IN(base) ((uint32_t)(base) << 15)

#define PIO_OUT_PINDIRS(count, delay) (0x6080u | (uint32_t)(delay) << 8 | (uint32_t)(count))
#define PIO_IN_PINS(count, delay) (0x4000u | (uint32_t)(delay) << 8 | (uint32_t)(count))
#define PIO_MOV_PINS_NULL 0xa003u
#define PIO_JMP(address) (0x0000u | (uint32_t)(address))
#define PIO_JMP_X_DECREMENTED(address, delay)                                                                                              \
  (0x0040u | (uint32_t)(delay) << 8 | (uint32_t)(address)) /* unless X is 0; then X is one less */
#define PIO_JMP_Y_DECREMENTED(address) (0x0080u | (uint32_t)(address))
#define PIO_JMP_PIN(address) (0x00c0u | (uint32_t)(address))
#define PIO_WAIT_PIN(level) (0x2020u | (uint32_t)(level) << 7)
#define PIO_PUSH_IF_ROOM 0x8000u
#define PIO_MOV_ISR_NOT_Y 0xa0cau
#define PIO_SET_X(value) (0xe020u | (uint32_t)(value))
#define PIO_SET_Y(value) (0xe040u | (uint32_t)(value))
