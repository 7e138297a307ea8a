/* Records in the flash as store.h says, with whatever payload: what a later firmware, or a bug, may have left. */
#pragma once

#include "common/bytes.h"
#include "common/crc32.h"
#include "fuzz.h"
#include "native/native_flash.h"
#include "store/store.h"

/* Its CRC is right. generation: of the first sector; that of the other is one more, as in any log.
 * sensor_count: of the payload, whose parts and all the rest are the input's. */
static inline void fuzz_put_record(struct fuzz_input *input, uint32_t generation, uint8_t sensor_count) {
  const unsigned sector = fuzz_u8(input) % PORT_FLASH_SECTORS;
  const unsigned slot = fuzz_u8(input) % STORE_SLOTS;
  const uint8_t how = fuzz_u8(input);
  const uint16_t version = how & 1 ? 2 : how & 2 ? 1 : fuzz_u8(input);
  const unsigned usual = 4 + 14 + 8u * sensor_count + 24 + (version >= 2 ? 4 * PAD_PROFILE_FLOATS + 1 : 0) + (version >= 3 ? 9 : 0) +
                         (version >= 4 ? 6u * sensor_count : 0);
  const size_t slot_bytes = usual > STORE_SHORT_SLOT_BYTES - 28 ? STORE_LONG_SLOT_BYTES : STORE_SHORT_SLOT_BYTES;
  uint8_t *at = native_flash.bytes + sector * PORT_FLASH_SECTOR_BYTES + slot * slot_bytes % PORT_FLASH_SECTOR_BYTES;
  size_t length = how & 4 ? fuzz_u16(input) % (slot_bytes - 28) : usual;
  memset(at, 0, slot_bytes);
  bytes_put_u32(at + 4, UINT32_C(0x74665346));
  bytes_put_u16(at + 8, version);
  bytes_put_u16(at + 10, (uint16_t)length);
  bytes_put_u32(at + 12, generation + sector);
  size_t given = length;
  const uint8_t *payload = fuzz_bytes(input, &given);
  memcpy(at + 20, payload, given);
  if (!(how & 16)) {
    at[21] = sensor_count;
    at[20] &= 7;
  }
  uint32_t crc = CRC32_BEGIN;
  for (unsigned i = 4; i < 20 + length; i++) {
    if (i < 16 || i >= 20) {
      crc = crc32_add_u8(crc, at[i]);
    }
  }
  bytes_put_u32(at + 16, ~crc);
  if (how & 32) {
    bytes_put_u32(at + slot_bytes - 8, fuzz_u32(input));
    bytes_put_u32(at + slot_bytes - 4, fuzz_u32(input));
  }
}
