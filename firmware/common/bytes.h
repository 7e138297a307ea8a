/* Explicit little-endian access to byte buffers, for any alignment and any host byte order. */
#pragma once

#include <stdint.h>
#include <string.h>

static inline void bytes_put_u16(uint8_t *to, uint16_t value) {
  to[0] = (uint8_t)value;
  to[1] = (uint8_t)(value >> 8);
}

static inline void bytes_put_u32(uint8_t *to, uint32_t value) {
  to[0] = (uint8_t)value;
  to[1] = (uint8_t)(value >> 8);
  to[2] = (uint8_t)(value >> 16);
  to[3] = (uint8_t)(value >> 24);
}

static inline uint16_t bytes_get_u16(const uint8_t *from) { return (uint16_t)(from[0] | (uint16_t)from[1] << 8); }

static inline uint32_t bytes_get_u32(const uint8_t *from) { return bytes_get_u16(from) | (uint32_t)bytes_get_u16(from + 2) << 16; }

static inline uint64_t bytes_get_u64(const uint8_t *from) { return bytes_get_u32(from) | (uint64_t)bytes_get_u32(from + 4) << 32; }

/* IEEE 754 binary32 by its bits. */
static inline uint32_t bytes_from_f32(float value) {
  uint32_t bits;
  memcpy(&bits, &value, sizeof bits);
  return bits;
}

static inline float bytes_to_f32(uint32_t bits) {
  float value;
  memcpy(&value, &bits, sizeof value);
  return value;
}
