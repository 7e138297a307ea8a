/* Sections that no interrupt cuts (ARMv6-M B1.4.3, PRIMASK). */
#pragma once

#include <stdint.h>

static inline uint32_t disable_interrupts(void) {
  uint32_t primask;
  __asm volatile("mrs %0, primask\n cpsid i" : "=r"(primask)::"memory");
  return primask;
}

/* Restores them as they were before. */
static inline void restore_interrupts(uint32_t primask) { __asm volatile("msr primask, %0" ::"r"(primask) : "memory"); }
