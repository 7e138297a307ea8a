/* Fixed-point arithmetic of the condition. Pressures are in 1/1024 Pa (_q10), times in units of 1.024 ms (_ms), which a
 * shift makes of microseconds. A share is a factor below 1, in 1/65536. */
#pragma once

#include "common/limits.h"

#include <stdbool.h>
#include <stdint.h>

#define MS(ms) ((int32_t)((ms)*INT64_C(1000) / 1024))
#define SECONDS(s) MS(INT64_C(1000) * (s))
#define Pa_q10(Pa) (1024 * (Pa))

static inline int32_t clamp(int32_t value, int32_t lowest, int32_t highest) {
  return value < lowest ? lowest : value > highest ? highest : value;
}

static inline int32_t size_of(int32_t value) { return value < 0 ? -value : value; }

static inline int32_t larger(int32_t a, int32_t b) { return a > b ? a : b; }

static inline int32_t and_half(int32_t value) { return value + (value >> 1); }

/* a - b, or the end of the range. */
int32_t clamped_difference(int32_t a, int32_t b);

/* value times a share, to the nearest. */
int32_t part_of(int32_t value, int32_t share_q16);

/* Share of a difference that a low pass of this time constant takes over in this time. */
int32_t share_in(int32_t ms, int32_t time_constant_ms);

/* Change in this time at a rate per second. */
int32_t in_step(int32_t each_second, int32_t ms);

static inline void set_bit(sensor_map *bitmap, uint8_t k, bool set) { *bitmap = (*bitmap & ~sensor_bit(k)) | (sensor_map)set << k; }
