/* The DMA controller (RP2040 datasheet 2.5). */
#pragma once

#include "rp2040/reg.h"

#define DMA_BASE 0x50000000u
#define DMA_READ_ADDR(channel) REG32(DMA_BASE + 0x40u * (channel) + 0x00u)
#define DMA_WRITE_ADDR(channel) REG32(DMA_BASE + 0x40u * (channel) + 0x04u)
#define DMA_TRANS_COUNT(channel) REG32(DMA_BASE + 0x40u * (channel) + 0x08u)
#define DMA_CTRL_TRIG(channel) REG32(DMA_BASE + 0x40u * (channel) + 0x0cu) /* starts it */
#define DMA_CTRL(channel) REG32(DMA_BASE + 0x40u * (channel) + 0x10u)      /* does not */
#define DMA_INTE0 REG32(DMA_BASE + 0x404u)
#define DMA_INTS0 REG32(DMA_BASE + 0x40cu) /* writing a 1 clears */

#define DMA_CTRL_EN (1u << 0)
#define DMA_CTRL_WORDS (2u << 2)
#define DMA_CTRL_INCR_READ (1u << 4)
#define DMA_CTRL_INCR_WRITE (1u << 5)
#define DMA_CTRL_RING_WRITE(log2_bytes) (1u << 10 | (uint32_t)(log2_bytes) << 6)
#define DMA_CTRL_CHAIN_TO(channel) ((uint32_t)(channel) << 11) /* to itself: to none */
#define DMA_CTRL_TREQ(dreq) ((uint32_t)(dreq) << 15)
#define DMA_CTRL_IRQ_QUIET (1u << 21)
#define DMA_CTRL_BUSY (1u << 24)

#define DMA_DREQ_PIO0_TX0 0u
#define DMA_DREQ_PIO0_RX0 4u
#define DMA_DREQ_PIO1_RX0 12u
#define DMA_DREQ_NONE 63u
