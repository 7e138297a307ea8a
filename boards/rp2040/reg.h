/* Access to memory-mapped registers, and the atomic aliases that every APB and AHB-Lite peripheral has besides its
 * plain addresses (RP2040 datasheet 2.1.2). SIO has no aliases. */
#pragma once

#include <stdint.h>

#define REG32(address) (*(volatile uint32_t *)(uintptr_t)(address))
#define REG32_SET(address) REG32((address) + 0x2000u)
#define REG32_CLEAR(address) REG32((address) + 0x3000u)
