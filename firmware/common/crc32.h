/* CRC-32/ISO-HDLC (polynomial 0x04C11DB7 reflected, init and xor-out 0xFFFFFFFF): the CRC of Ethernet, zlib and PNG.
 * Check value of "123456789": 0xCBF43926. By half bytes: a byte costs some fourteen Cortex-M0+ cycles. */
#pragma once

#include <stddef.h>
#include <stdint.h>
#include <string.h>

uint32_t crc32_iso_hdlc(const uint8_t *bytes, size_t length);

/* Value by value, as little-endian bytes: begin with CRC32_BEGIN; the CRC is the complement of the last. */
#define CRC32_BEGIN UINT32_MAX

extern const uint32_t crc32_table[16];

/* The entry's address by two shifts: a Cortex-M0+ takes three instructions for an index. */
static inline __attribute__((always_inline)) uint32_t crc32_half_step(uint32_t crc) {
  const uint8_t *entry = (const uint8_t *)crc32_table + (crc << 28 >> 26);
  uint32_t remainder;
  memcpy(&remainder, __builtin_assume_aligned(entry, 4), sizeof remainder);
  return (crc >> 4) ^ remainder;
}

static inline __attribute__((always_inline)) uint32_t crc32_step(uint32_t crc) { return crc32_half_step(crc32_half_step(crc)); }

static inline __attribute__((always_inline)) uint32_t crc32_add_u8(uint32_t crc, uint8_t value) { return crc32_step(crc ^ value); }

static inline __attribute__((always_inline)) uint32_t crc32_add_u16(uint32_t crc, uint16_t value) {
  return crc32_step(crc32_step(crc ^ value));
}

static inline __attribute__((always_inline)) uint32_t crc32_add_u32(uint32_t crc, uint32_t value) {
  return crc32_step(crc32_step(crc32_step(crc32_step(crc ^ value))));
}
