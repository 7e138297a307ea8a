#include "draw.h"

/* xorshift64* (Vigna, 2016) */
static uint64_t state;

void draw_from(uint64_t seed) { state = seed; }

uint32_t draw(void) {
  state ^= state >> 12;
  state ^= state << 25;
  state ^= state >> 27;
  return (uint32_t)((state * UINT64_C(2685821657736338717)) >> 32);
}

int32_t draw_between(int32_t low, int32_t high) {
  uint64_t span = (uint64_t)((int64_t)high - low) + 1;
  return (int32_t)(low + (int64_t)(span * draw() >> 32));
}
