/* Non-volatile storage: a calibration, the pad's profile, and settings to start with. If the power
 * fails at any moment, the old or the new content remains, never a mixture and never nothing.
 *
 * The flash is a log. A sector holds eight slots of 512 bytes, or four of 1024 if the array has 19 sensors or more. A
 * record is all that is kept. It goes into the next free slot, or into the first of the other sector once that is
 * erased. The newest undamaged record counts. A slot of 512 bytes holds, in this order, each by a write of its own:
 *
 *     0    u32  begun: 0. From now on the slot is used, whatever it holds
 *     4    u32  magic 0x74665346
 *     8    u16  version 4; 1 to 3 are read too
 *     10   u16  length of the payload
 *     12   u32  generation: one more than that of the other sector when this one was erased; after
 *               2^32 - 1 comes 1
 *     16   u32  CRC-32/ISO-HDLC of bytes 4 to 15 and the payload
 *     20        payload, below
 *     504  u32  sealed: 0. The record was read back and is right
 *     508  u32  final: 0. The seal is whole
 *
 * Payload of version 1: u8 parts (bit 0 calibration, bit 1 settings), u8 n sensors, u8 sync pin (a setting, and 0 in the records of
 * firmware without one), u8 0. Then the calibration as in its command, without its n: 14 + 8 n bytes, zeros where there is none. Then the
 * other settings: u32 rate mHz, u16 OSR, u16 slip window ms, f32 slip threshold mm, f32 f32 prior mm, f32 location limit mm. Version 2 has
 * one more part, bit 2, the pad's profile, behind the settings: as in its command, 177 bytes. Version 3 has the calibration's shape and air
 * at the end: u16 sigma, its sd, the dip's share and sd, u8 kPa; as in its command, which has them before the sensors. Version 4 has one
 * more part at the end: of each sensor i16 i16 i16, its place and width, as in the command; 6 n bytes. Before it, 512 bytes were enough for
 * all arrays. A sector with such a record has slots of 512 bytes and counts as full. Later versions keep the slot as it is and change the
 * payload.
 *
 * Bits whose change was cut short may read differently each time. So a record that is not final may be there today and gone tomorrow, or
 * the other way round. When start-up meets one, it writes the content that it chose once more, behind it. A mark is all zeros, so writing
 * it again repairs one that was cut short. Before `begun` is whole no other bit of the slot is touched, and a slot without it is free. If
 * it does not hold what is written, the other sector is erased and taken. A sector is erased only while the other one holds a record whose
 * seal is whole, or if all its own records were cut short.
 *
 * Main context only. Nothing waits: store_poll() takes a write one short step further. */
#pragma once

#include "common/calibration.h"
#include "common/pad_profile.h"
#include "common/status.h"
#include "port/flash.h"

#include <stdbool.h>
#include <stdint.h>

struct store_settings {
  uint32_t rate_mHz;
  uint16_t osr;
  uint16_t slip_window_ms;
  float slip_threshold_mm;
  float prior_sigma_mm, prior_width_mm;
  float location_limit_mm;
  uint32_t sync; /* enum port_sync; judged by who uses it */
};

/* Content of the flash. */
struct store_content {
  bool has_calibration, has_settings, has_profile;
  struct calibration calibration;
  struct store_settings settings;
  struct pad_profile profile; /* every firmware stores it; its user checks it */
};

enum {
  STORE_SHORT_SLOT_BYTES = 512,
  STORE_LONG_SLOT_BYTES = 1024,
  STORE_SENSORS_OF_SHORT_SLOT = 18,                               /* with more it is long */
  STORE_SLOTS = PORT_FLASH_SECTOR_BYTES / STORE_SHORT_SLOT_BYTES, /* at most */
  STORE_RECORD_BYTES = FT_MAX_SENSORS > 32 ? 760 : 700,           /* with the mark before it, without those behind it */
};

enum store_step {
  STORE_IDLE,
  STORE_REQUESTED, /* to be begun */
  STORE_SECURE,    /* the seal of what remains while the other sector is erased */
  STORE_ERASE,
  STORE_BEGIN, /* the mark that the slot is used */
  STORE_WRITE,
  STORE_READ_BACK,
  STORE_SEAL,
  STORE_END, /* the mark that it is final */
};

struct store {
  uint8_t step;     /* enum store_step */
  uint8_t attempts; /* that have failed */
  uint8_t sensor_count;
  uint16_t slot_bytes;

  /* The log. The current sector holds the newest record, if there is any. */
  uint8_t sector;
  uint8_t next_slot;   /* of the current sector; none that there is: it is full */
  uint8_t sealed_slot; /* of the current sector: a sealed record; STORE_SLOTS: none */
  bool other_is_stale; /* the other sector holds nothing that may turn into a newer record */
  bool must_rewrite;   /* what was decided at start-up has to be written once more */
  uint16_t sealed_slot_bytes;
  uint32_t generation; /* of the current sector; 0: there is no record */

  /* The write under way. */
  uint8_t to_sector, to_slot;
  uint16_t at; /* byte of the record */
  uint16_t record_length;
  uint32_t to_generation;
  uint64_t step_ends_us;
  bool pad_changes; /* calibration or profile changes */

  bool damaged; /* what the flash holds is damaged, or of a later firmware: .content is empty */
  struct store_content content;
  uint8_t record[STORE_RECORD_BYTES];
};

/* Reads the flash; about 1 ms. sensor_count: the fingertip's, 1 to FT_MAX_SENSORS; a calibration of another array is damage. */
void store_init(struct store *store, uint8_t sensor_count);

/* Begin to keep this instead of the present content; NULL: keep none. The value may go as soon as
 * they return. FT_OK: nothing had to be written. FT_PENDING. FT_ERR_BUSY: a write is under way. */
enum ft_status store_put_calibration(struct store *store, const struct calibration *calibration);
enum ft_status store_put_settings(struct store *store, const struct store_settings *settings);
enum ft_status store_put_profile(struct store *store, const struct pad_profile *profile);

/* Call at least each millisecond or so while a write is under way. A call takes less than 10 us on
 * the RP2040. FT_PENDING: a write is under way. FT_OK: none is, and .content is what was put. After
 * FT_PENDING, once: FT_ERR_TIMEOUT, FT_ERR_CRC: the flash has failed, and .content is as before. */
enum ft_status store_poll(struct store *store, uint64_t now_us);

static inline bool store_is_writing(const struct store *store) { return store->step != STORE_IDLE || store->must_rewrite; }
