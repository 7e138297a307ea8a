/* What both processors see of each other (RP2040 datasheet 2.3.1), and the reset of the second one (2.13 power-on state machine). */
#pragma once

#include "rp2040/reg.h"

/* 0xd0000000 is CPUID: fault.S reads it */
#define SIO_FIFO_ST REG32(0xd0000050u)
#define SIO_FIFO_ST_VALID (1u << 0) /* there is a word to read */
#define SIO_FIFO_ST_READY (1u << 1) /* there is room to write */
#define SIO_FIFO_WR REG32(0xd0000054u)
#define SIO_FIFO_RD REG32(0xd0000058u)

#define PSM_FRCE_OFF 0x40010004u
#define PSM_PROC1 (1u << 16)
