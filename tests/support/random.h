/* Repeatable random numbers for tests: xorshift64* (Vigna, 2016). The same seed gives the same
 * sequence everywhere, so that a failure can be repeated. */
#pragma once

#include <math.h>
#include <stdint.h>

struct random {
  uint64_t state; /* not 0 */
};

static inline uint64_t random_u64(struct random *random) {
  random->state ^= random->state >> 12;
  random->state ^= random->state << 25;
  random->state ^= random->state >> 27;
  return random->state * UINT64_C(2685821657736338717);
}

static inline uint32_t random_u32(struct random *random) { return (uint32_t)(random_u64(random) >> 32); }

/* In [0, limit), limit at least 1. */
static inline uint32_t random_below(struct random *random, uint32_t limit) {
  return (uint32_t)((uint64_t)random_u32(random) * limit >> 32);
}

/* In [low, high). */
static inline double random_between(struct random *random, double low, double high) {
  return low + (high - low) * ((double)(random_u64(random) >> 11) * 0x1p-53);
}

/* Standard normal, by Box and Muller. */
static inline double random_normal(struct random *random) {
  double u = 1.0 - random_between(random, 0.0, 1.0);
  return sqrt(-2.0 * log(u)) * cos(6.283185307179586 * random_between(random, 0.0, 1.0));
}
