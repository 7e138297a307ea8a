/* What the parts of the condition share: a step of one sensor, units, and arithmetic. Pressures are
 * in 1/1024 Pa; times in units of 1.024 ms, which a shift makes of microseconds.
 */
#ifndef CONDITION_STEPS_H
#define CONDITION_STEPS_H

#include <stdbool.h>
#include <stdint.h>

#define MS(ms) ((int32_t)((ms)*INT64_C(1000) / 1024))
#define SECONDS(s) MS(INT64_C(1000) * (s))
#define Pa_q10(Pa) (1024 * (Pa))

#define AGE_MAX_ms ((uint32_t)SECONDS(86400))

/* What nothing exceeds that is multiplied by a share: 0.5 MPa. */
#define STEP_PRESSURE_MAX (INT32_C(1) << 29)

/* Every sensor is looked at once in 64 ms; at lower rates with every frame. */
struct step {
  int32_t ms; /* since it was looked at last */
  uint32_t now_ms;
  int32_t noise_Pa_q10;
  int32_t reading_Pa_q10; /* absolute */
  int32_t above_Pa_q10;   /* the zero: mean of the readings since it was looked at last */
  int32_t slow_Pa_q10;    /* how far the reading is above its own low pass of a second */
  int32_t rise_Pa_q10;    /* of that low pass */
  bool moves;             /* as a press or a release does, since it was looked at last */
};

static inline int32_t clamp(int32_t value, int32_t lowest, int32_t highest) {
  return value < lowest ? lowest : value > highest ? highest : value;
}

static inline int32_t size_of(int32_t value) {
  return value < 0 ? -value : value;
}

static inline int32_t larger(int32_t a, int32_t b) {
  return a > b ? a : b;
}

/* a - b, or the end of the range. */
int32_t clamped_difference(int32_t a, int32_t b);

/* value times a share below 1, to the nearest. */
int32_t part_of(int32_t value, int32_t share_q16);

/* What a low pass takes of a difference in this time. */
int32_t share_in(int32_t ms, int32_t time_constant_ms);

int32_t faded(int32_t value, int32_t ms, int32_t time_constant_ms);

/* So much a second makes so much in this time. */
int32_t in_step(int32_t each_second, int32_t ms);

static inline void set_bit(uint32_t *bitmap, uint8_t k, bool set) {
  *bitmap = (*bitmap & ~(UINT32_C(1) << k)) | (uint32_t)set << k;
}

#endif
