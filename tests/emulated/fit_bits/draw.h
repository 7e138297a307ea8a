/* Numbers by chance, the same on every machine: xorshift64* (Vigna, 2016), integers alone. */
#pragma once

#include <stdint.h>

static uint64_t draw_state;

static inline void draw_from(uint64_t seed) { draw_state = seed; }

static inline uint32_t draw(void) {
  draw_state ^= draw_state >> 12;
  draw_state ^= draw_state << 25;
  draw_state ^= draw_state >> 27;
  return (uint32_t)((draw_state * UINT64_C(2685821657736338717)) >> 32);
}

/* low..high, both included. */
static inline int32_t draw_between(int32_t low, int32_t high) {
  uint64_t span = (uint64_t)((int64_t)high - low) + 1;
  return (int32_t)(low + (int64_t)(span * draw() >> 32));
}
