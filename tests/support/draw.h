/* Numbers by chance, the same on every machine, by integers alone: of one sequence in a test. */
#pragma once

#include "support/random.h"

static struct random draws;

static inline void draw_from(uint64_t seed) { draws.state = seed; }

static inline uint32_t draw(void) { return random_u32(&draws); }

/* low..high, both included. */
static inline int32_t draw_between(int32_t low, int32_t high) {
  uint64_t span = (uint64_t)((int64_t)high - low) + 1;
  return (int32_t)(low + (int64_t)(span * draw() >> 32));
}
