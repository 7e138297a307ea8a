#include "common/crc32.h"

/* The remainder of a byte is the sum of those of its bits. */
#define BIT(byte, bit, remainder) ((byte) >> (bit)&1u ? (remainder) : 0u)
#define ENTRY(byte)                                                                                                    \
  (BIT(byte, 0, 0x77073096u) ^ BIT(byte, 1, 0xee0e612cu) ^ BIT(byte, 2, 0x076dc419u) ^ BIT(byte, 3, 0x0edb8832u) ^     \
   BIT(byte, 4, 0x1db71064u) ^ BIT(byte, 5, 0x3b6e20c8u) ^ BIT(byte, 6, 0x76dc4190u) ^ BIT(byte, 7, 0xedb88320u))
#define ENTRIES_4(byte) ENTRY(byte), ENTRY((byte) + 1), ENTRY((byte) + 2), ENTRY((byte) + 3)
#define ENTRIES_16(byte) ENTRIES_4(byte), ENTRIES_4((byte) + 4), ENTRIES_4((byte) + 8), ENTRIES_4((byte) + 12)
#define ENTRIES_64(byte) ENTRIES_16(byte), ENTRIES_16((byte) + 16), ENTRIES_16((byte) + 32), ENTRIES_16((byte) + 48)

const uint32_t crc32_table[256] = {ENTRIES_64(0u), ENTRIES_64(64u), ENTRIES_64(128u), ENTRIES_64(192u)};

uint32_t crc32_iso_hdlc(const uint8_t *bytes, size_t length) {
  uint32_t crc = CRC32_BEGIN;
  for (size_t i = 0; i < length; i++) {
    crc = crc32_add_u8(crc, bytes[i]);
  }
  return ~crc;
}
