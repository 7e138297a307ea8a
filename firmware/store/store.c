#include "store/store.h"

#include "common/bytes.h"
#include "common/crc32.h"

#include <stddef.h>
#include <string.h>

#define MAGIC UINT32_C(0x74665346)
#define ERASED UINT32_MAX
#define MARK UINT32_C(0)

enum {
  VERSION = 4,
  VERSION_WITHOUT_PLACES = 3,
  VERSION_WITHOUT_SHAPE = 2,
  VERSION_WITHOUT_PROFILE = 1,
  /* In a slot */
  BEGUN_AT = 0,
  MAGIC_AT = 4,
  VERSION_AT = 8,
  LENGTH_AT = 10,
  GENERATION_AT = 12,
  CRC_AT = 16,
  PAYLOAD_AT = 20,
  /* In a payload */
  HAS_CALIBRATION = 1 << 0,
  HAS_SETTINGS = 1 << 1,
  HAS_PROFILE = 1 << 2,
  SYNC_AT = 2,
  CALIBRATION_AT = 4,
  SETTINGS_BYTES = 24,
  PROFILE_BYTES = 4 * PAD_PROFILE_FLOATS + 1,
  SHAPE_BYTES = 9,
  PLACE_BYTES = 6, /* of each sensor */
  /* A flash whose erased slots do not hold what is written so often in a row fails. */
  MAX_ATTEMPTS = 3,
};
#define RECORD_BYTES(sensors)                                                                                                              \
  (PAYLOAD_AT + CALIBRATION_AT + 14 + (8 + PLACE_BYTES) * (sensors) + SETTINGS_BYTES + PROFILE_BYTES + SHAPE_BYTES)
_Static_assert(RECORD_BYTES(STORE_SENSORS_OF_SHORT_SLOT) <= STORE_SHORT_SLOT_BYTES - 8 &&
                   RECORD_BYTES(FT_MAX_SENSORS) <= STORE_RECORD_BYTES && (int)STORE_RECORD_BYTES <= STORE_LONG_SLOT_BYTES - 8,
               "a record fits into its slot and into the buffer");

/* The longest erase of a sector takes 400 ms (W25Q16JV), and the longest write of a page 3 ms. */
#define STEP_MAX_us 1000000u

static const uint8_t mark[4] = {0, 0, 0, 0};

static uint32_t slot_address(const struct store *store, unsigned sector, unsigned slot) {
  return sector * PORT_FLASH_SECTOR_BYTES + slot * store->slot_bytes;
}

static unsigned slots_of(const struct store *store) { return PORT_FLASH_SECTOR_BYTES / store->slot_bytes; }

/* The two marks at the end of a slot. */
static unsigned sealed_at(const struct store *store) { return store->slot_bytes - 8u; }

static unsigned final_at(const struct store *store) { return store->slot_bytes - 4u; }

static uint32_t read_u32(uint32_t at) {
  uint8_t bytes[4];
  port_flash_read(at, bytes, sizeof bytes);
  return bytes_get_u32(bytes);
}

static unsigned calibration_bytes(unsigned sensor_count) { return 14 + 8 * sensor_count; }

/* Record ------------------------------------------------------------------------------------- */

static uint8_t *put_u32(uint8_t *at, uint32_t value) {
  bytes_put_u32(at, value);
  return at + 4;
}

static uint8_t *put_u16(uint8_t *at, uint16_t value) {
  bytes_put_u16(at, value);
  return at + 2;
}

/* Floats that lie behind one another, from this place of a struct on. */
static void put_floats(uint8_t *at, const void *from, size_t offset, unsigned count) {
  for (unsigned i = 0; i < count; i++) {
    float value;
    memcpy(&value, (const uint8_t *)from + offset + sizeof value * i, sizeof value);
    at = put_u32(at, bytes_from_f32(value));
  }
}

static void get_floats(const uint8_t *at, void *to, size_t offset, unsigned count) {
  for (unsigned i = 0; i < count; i++, at += 4) {
    float value = bytes_to_f32(bytes_get_u32(at));
    memcpy((uint8_t *)to + offset + sizeof value * i, &value, sizeof value);
  }
}

_Static_assert(offsetof(struct sensor_calibration, gain_sd) == sizeof(float) &&
                   offsetof(struct calibration, force_scale_sd) == offsetof(struct calibration, force_scale) + sizeof(float) &&
                   offsetof(struct store_settings, location_limit_mm) ==
                       offsetof(struct store_settings, slip_threshold_mm) + 3 * sizeof(float),
               "floats lie behind one another");

static void put_calibration(uint8_t *at, const struct calibration *calibration, unsigned count) {
  at = put_u32(at, calibration->date_s);
  at = put_u16(at, calibration->placements);
  put_floats(at, calibration, offsetof(struct calibration, force_scale), 2);
  at += 8;
  for (unsigned k = 0; k < count; k++) {
    put_floats(at + 8 * k, &calibration->sensors[k], 0, 2);
  }
}

static void get_calibration(const uint8_t *at, struct calibration *calibration, unsigned count) {
  calibration->date_s = bytes_get_u32(at);
  calibration->placements = bytes_get_u16(at + 4);
  get_floats(at + 6, calibration, offsetof(struct calibration, force_scale), 2);
  at += 14;
  for (unsigned k = 0; k < count; k++) {
    get_floats(at + 8 * k, &calibration->sensors[k], 0, 2);
  }
}

static void put_shape(uint8_t *at, const struct calibration *calibration) {
  at = put_u16(at, calibration->sigma_um);
  at = put_u16(at, calibration->sigma_sd_um);
  at = put_u16(at, calibration->dip_share_q16);
  at = put_u16(at, calibration->dip_sd_um);
  *at = calibration->ambient_kPa;
}

static void get_shape(const uint8_t *at, struct calibration *calibration) {
  calibration->sigma_um = bytes_get_u16(at);
  calibration->sigma_sd_um = bytes_get_u16(at + 2);
  calibration->dip_share_q16 = bytes_get_u16(at + 4);
  calibration->dip_sd_um = bytes_get_u16(at + 6);
  calibration->ambient_kPa = at[8];
}

static void put_places(uint8_t *at, const struct calibration *calibration, unsigned count) {
  for (unsigned k = 0; k < count; k++) {
    const struct sensor_calibration *sensor = &calibration->sensors[k];
    at = put_u16(at, (uint16_t)sensor->off_x_um);
    at = put_u16(at, (uint16_t)sensor->off_y_um);
    at = put_u16(at, (uint16_t)sensor->wider_q15);
  }
}

static void get_places(const uint8_t *at, struct calibration *calibration, unsigned count) {
  for (unsigned k = 0; k < count; k++, at += PLACE_BYTES) {
    struct sensor_calibration *sensor = &calibration->sensors[k];
    sensor->off_x_um = (int16_t)bytes_get_u16(at);
    sensor->off_y_um = (int16_t)bytes_get_u16(at + 2);
    sensor->wider_q15 = (int16_t)bytes_get_u16(at + 4);
  }
}

static void put_settings(uint8_t *at, const struct store_settings *settings) {
  at = put_u32(at, settings->rate_mHz);
  at = put_u16(at, settings->osr);
  at = put_u16(at, settings->slip_window_ms);
  put_floats(at, settings, offsetof(struct store_settings, slip_threshold_mm), 4);
}

static void get_settings(const uint8_t *at, struct store_settings *settings) {
  settings->rate_mHz = bytes_get_u32(at);
  settings->osr = bytes_get_u16(at + 4);
  settings->slip_window_ms = bytes_get_u16(at + 6);
  get_floats(at + 8, settings, offsetof(struct store_settings, slip_threshold_mm), 4);
}

static void put_profile(uint8_t *at, const struct pad_profile *profile) {
  put_floats(at, profile, 0, PAD_PROFILE_FLOATS);
  at[PROFILE_BYTES - 1] = profile->from_touch;
}

static void get_profile(const uint8_t *at, struct pad_profile *profile) {
  get_floats(at, profile, 0, PAD_PROFILE_FLOATS);
  profile->from_touch = at[PROFILE_BYTES - 1];
}

/* What a record is made of; NULL: it has none. */
struct parts {
  const struct calibration *calibration;
  const struct store_settings *settings;
  const struct pad_profile *profile;
};

/* Its generation and CRC come when its place is known. */
static void make_record(struct store *store, const struct parts *parts) {
  uint8_t *payload = store->record + PAYLOAD_AT;
  bytes_put_u32(store->record + BEGUN_AT, MARK);
  unsigned settings_at = CALIBRATION_AT + calibration_bytes(store->sensor_count);
  unsigned shape_at = settings_at + SETTINGS_BYTES + PROFILE_BYTES;
  unsigned places_at = shape_at + SHAPE_BYTES;
  unsigned length = places_at + PLACE_BYTES * store->sensor_count;
  memset(payload, 0, length);
  payload[0] =
      (uint8_t)((parts->calibration ? HAS_CALIBRATION : 0) | (parts->settings ? HAS_SETTINGS : 0) | (parts->profile ? HAS_PROFILE : 0));
  payload[1] = store->sensor_count;
  if (parts->calibration) {
    put_calibration(payload + CALIBRATION_AT, parts->calibration, store->sensor_count);
    put_shape(payload + shape_at, parts->calibration);
    put_places(payload + places_at, parts->calibration, store->sensor_count);
  }
  if (parts->settings) {
    put_settings(payload + settings_at, parts->settings);
    payload[SYNC_AT] = (uint8_t)parts->settings->sync;
  }
  if (parts->profile) {
    put_profile(payload + settings_at + SETTINGS_BYTES, parts->profile);
  }
  store->record_length = (uint16_t)(PAYLOAD_AT + length);
}

/* The CRC of the record in the buffer. */
static uint32_t record_crc(const struct store *store) {
  uint32_t crc = CRC32_BEGIN;
  for (unsigned i = MAGIC_AT; i < store->record_length; i++) {
    if (i < CRC_AT || i >= PAYLOAD_AT) {
      crc = crc32_add_u8(crc, store->record[i]);
    }
  }
  return ~crc;
}

static void address_record(struct store *store) {
  uint8_t *record = store->record;
  bytes_put_u32(record + MAGIC_AT, MAGIC);
  bytes_put_u16(record + VERSION_AT, VERSION);
  bytes_put_u16(record + LENGTH_AT, (uint16_t)(store->record_length - PAYLOAD_AT));
  bytes_put_u32(record + GENERATION_AT, store->to_generation);
  bytes_put_u32(record + CRC_AT, record_crc(store));
}

/* False: the record in the buffer is not what this firmware writes for this array. */
static bool take_record(struct store *store) {
  struct store_content *content = &store->content;
  const uint8_t *payload = store->record + PAYLOAD_AT;
  const unsigned length = store->record_length - PAYLOAD_AT;
  const unsigned version = bytes_get_u16(store->record + VERSION_AT);
  const unsigned settings_at = CALIBRATION_AT + calibration_bytes(store->sensor_count);
  const unsigned profile_at = settings_at + SETTINGS_BYTES;
  const unsigned shape_at = profile_at + PROFILE_BYTES;
  const unsigned places_at = shape_at + SHAPE_BYTES;
  const unsigned expected = version == VERSION                   ? places_at + PLACE_BYTES * store->sensor_count
                            : version == VERSION_WITHOUT_PLACES  ? places_at
                            : version == VERSION_WITHOUT_SHAPE   ? shape_at
                            : version == VERSION_WITHOUT_PROFILE ? profile_at
                                                                 : 0;
  memset(content, 0, sizeof *content);
  if (length != expected || payload[1] != store->sensor_count) {
    return false;
  }
  if (payload[0] & HAS_CALIBRATION) {
    struct calibration *calibration = &content->calibration;
    get_calibration(payload + CALIBRATION_AT, calibration, store->sensor_count);
    if (version >= VERSION_WITHOUT_PLACES) {
      get_shape(payload + shape_at, calibration);
    }
    if (version == VERSION) {
      get_places(payload + places_at, calibration, store->sensor_count);
    }
    content->has_calibration = calibration_is_valid(calibration, store->sensor_count);
    if (!content->has_calibration) {
      memset(calibration, 0, sizeof *calibration);
      return false;
    }
  }
  if (payload[0] & HAS_SETTINGS) {
    get_settings(payload + settings_at, &content->settings);
    content->settings.sync = payload[SYNC_AT];
    content->has_settings = true;
  }
  if (version != VERSION_WITHOUT_PROFILE && payload[0] & HAS_PROFILE) {
    get_profile(payload + profile_at, &content->profile);
    content->has_profile = true;
  }
  return true;
}

/* Start-up ----------------------------------------------------------------------------------- */

/* Reads the record of a slot into the buffer, as it is at this moment. False: it is damaged. */
static bool load_record(struct store *store, unsigned sector, unsigned slot) {
  const uint32_t address = slot_address(store, sector, slot);
  const unsigned room = sealed_at(store) < STORE_RECORD_BYTES ? sealed_at(store) : (unsigned)STORE_RECORD_BYTES;
  uint8_t *record = store->record;
  store->record_length = PAYLOAD_AT;
  for (unsigned at = MAGIC_AT; at < store->record_length;) {
    unsigned left = store->record_length - at;
    unsigned count = left < PORT_FLASH_READ_BYTES ? left : PORT_FLASH_READ_BYTES;
    port_flash_read(address + at, record + at, count);
    at += count;
    if (at == PAYLOAD_AT && left == count) { /* the head: now the length is known */
      unsigned length = bytes_get_u16(record + LENGTH_AT);
      if (bytes_get_u32(record + MAGIC_AT) != MAGIC || length > room - PAYLOAD_AT || bytes_get_u32(record + GENERATION_AT) == 0) {
        return false;
      }
      store->record_length = (uint16_t)(PAYLOAD_AT + length);
    }
  }
  return bytes_get_u32(record + CRC_AT) == record_crc(store);
}

/* Generations wrap, past 0, which is none: no flash lives that long, but what else has written to it may have left any. */
static bool is_older(uint32_t generation, uint32_t than) { return than != 0 && (generation == 0 || generation - than > UINT32_MAX / 2); }

static uint32_t next_generation(uint32_t generation) { return generation == UINT32_MAX ? 1 : generation + 1; }

/* What start-up finds in one sector. */
struct sector {
  uint32_t generation; /* 0: no good record */
  uint8_t used;        /* slots, counted to the last one that is */
  uint8_t sealed_slot; /* the last that is good and sealed; STORE_SLOTS: none */
  bool is_final;       /* and marked so, and no slot is used behind it */
  bool lost;           /* behind the newest good record is one that was sealed */
  bool first_is_bad;   /* the first slot is used and not good */
  bool is_earlier;     /* it holds good records of a version before this one */
};

static struct sector read_slots(struct store *store, unsigned number) {
  struct sector sector = {.sealed_slot = STORE_SLOTS};
  for (unsigned i = 0; i < slots_of(store); i++) {
    const uint32_t address = slot_address(store, number, i);
    if (read_u32(address + BEGUN_AT) == ERASED) {
      continue;
    }
    bool sealed = read_u32(address + sealed_at(store)) == MARK;
    bool good = load_record(store, number, i);
    sector.used = (uint8_t)(i + 1);
    sector.is_final = good && sealed && read_u32(address + final_at(store)) == MARK;
    bool was_record = sealed && bytes_get_u32(store->record + MAGIC_AT) == MAGIC;
    sector.lost = !good && (sector.lost || was_record);
    if (good) {
      sector.is_earlier |= bytes_get_u16(store->record + VERSION_AT) < VERSION;
      sector.generation = bytes_get_u32(store->record + GENERATION_AT);
      if (!is_older(sector.generation, store->generation)) { /* now: it need not read so again */
        store->generation = sector.generation;
        store->damaged = !take_record(store);
      }
      sector.sealed_slot = sealed ? (uint8_t)i : sector.sealed_slot;
    } else if (i == 0) {
      sector.first_is_bad = true;
    }
  }
  return sector;
}

/* Before VERSION all arrays had short slots. Such a sector is read, and counts as full. */
static struct sector read_sector(struct store *store, unsigned number) {
  const uint16_t slot_bytes = store->slot_bytes;
  if (slot_bytes != STORE_SHORT_SLOT_BYTES) {
    store->slot_bytes = STORE_SHORT_SLOT_BYTES;
    struct sector sector = read_slots(store, number);
    store->slot_bytes = slot_bytes;
    if (sector.is_earlier) {
      sector.used = STORE_SLOTS;
      return sector;
    }
  }
  return read_slots(store, number);
}

void store_init(struct store *store, uint8_t sensor_count) {
  memset(store, 0, sizeof *store);
  store->sensor_count = sensor_count;
  store->slot_bytes = sensor_count <= STORE_SENSORS_OF_SHORT_SLOT ? STORE_SHORT_SLOT_BYTES : STORE_LONG_SLOT_BYTES;
  const struct sector sectors[PORT_FLASH_SECTORS] = {read_sector(store, 0), read_sector(store, 1)};
  store->sector = is_older(sectors[0].generation, sectors[1].generation);
  const struct sector *current = &sectors[store->sector];
  const struct sector *other = &sectors[!store->sector];
  store->next_slot = current->used;
  store->sealed_slot = current->sealed_slot;
  store->sealed_slot_bytes = current->is_earlier ? STORE_SHORT_SLOT_BYTES : store->slot_bytes;
  store->other_is_stale = !other->first_is_bad;
  if (current->generation == 0) {
    /* The first record of all was cut short, and perhaps what was to settle that. */
    store->damaged = current->lost || other->lost;
    store->must_rewrite = !store->damaged && current->used > 0 && current->used < slots_of(store) && other->used == 0;
    return;
  }
  if (current->lost) {
    store->damaged = true;
    memset(&store->content, 0, sizeof store->content);
  }
  store->must_rewrite = !store->damaged && (!current->is_final || other->first_is_bad);
}

/* Writing ------------------------------------------------------------------------------------ */

static void begin_step(struct store *store, enum store_step step, uint64_t now_us) {
  store->step = (uint8_t)step;
  store->step_ends_us = now_us + STEP_MAX_us;
}

static uint32_t to_address(const struct store *store) { return slot_address(store, store->to_sector, store->to_slot); }

static void program_mark(const struct store *store, unsigned at) { port_flash_program(to_address(store) + at, mark, sizeof mark); }

static void begin_erase(struct store *store, uint64_t now_us) {
  port_flash_erase(store->to_sector);
  begin_step(store, STORE_ERASE, now_us);
}

/* Up to the end of the page. */
static unsigned write_length(const struct store *store) {
  unsigned rest = PORT_FLASH_PAGE_BYTES - store->at % PORT_FLASH_PAGE_BYTES;
  unsigned left = store->record_length - store->at;
  return left < rest ? left : rest;
}

static void begin_slot(struct store *store, uint64_t now_us) {
  program_mark(store, BEGUN_AT);
  begin_step(store, STORE_BEGIN, now_us);
}

static void begin_write(struct store *store, uint64_t now_us) {
  store->to_sector = store->sector;
  store->to_slot = store->next_slot;
  store->to_generation = store->generation;
  bool fits = store->generation != 0 && store->next_slot < slots_of(store) && store->other_is_stale;
  if (fits) {
    store->next_slot++;
    begin_slot(store, now_us);
  } else if (store->sealed_slot < STORE_SLOTS) {
    /* The seal of what remains may have been cut short itself: made good before the other goes. */
    port_flash_program(store->sector * PORT_FLASH_SECTOR_BYTES + (store->sealed_slot + 1u) * store->sealed_slot_bytes - 8, mark,
                       sizeof mark);
    begin_step(store, STORE_SECURE, now_us);
    store->to_sector = !store->sector;
    store->to_slot = 0;
    store->to_generation = next_generation(store->generation);
    store->other_is_stale = false;
  } else { /* all of this sector was cut short: what surely stays, if anything, is in the other */
    store->next_slot = STORE_SLOTS;
    store->to_slot = 0;
    store->to_generation = store->generation != 0 ? store->generation : next_generation(0);
    begin_erase(store, now_us);
  }
  address_record(store);
}

static enum ft_status fail(struct store *store, enum ft_status why) {
  store->step = STORE_IDLE;
  store->must_rewrite = false;
  return why;
}

/* A slot that did not hold what was written was not erased: the next attempt is in one that is. */
static enum ft_status try_again(struct store *store, uint64_t now_us) {
  store->next_slot = STORE_SLOTS;
  if (++store->attempts == MAX_ATTEMPTS) {
    return fail(store, FT_ERR_CRC);
  }
  begin_write(store, now_us);
  return FT_PENDING;
}

static enum ft_status finish_write(struct store *store) {
  store->sector = store->to_sector;
  store->next_slot = store->to_slot + 1;
  store->generation = store->to_generation;
  store->sealed_slot = store->to_slot;
  store->sealed_slot_bytes = store->slot_bytes;
  store->other_is_stale = true;
  store->damaged = false;
  store->must_rewrite = false;
  store->step = STORE_IDLE;
  take_record(store);
  return FT_OK;
}

/* Whether the next bytes are in the flash as they were written. */
static bool read_back(struct store *store) {
  uint8_t bytes[PORT_FLASH_READ_BYTES];
  unsigned left = store->record_length - store->at;
  unsigned count = left < sizeof bytes ? left : (unsigned)sizeof bytes;
  port_flash_read(to_address(store) + store->at, bytes, count);
  bool equal = memcmp(bytes, store->record + store->at, count) == 0;
  store->at = (uint16_t)(store->at + count);
  return equal;
}

static struct parts kept_parts(const struct store *store) {
  const struct store_content *content = &store->content;
  return (struct parts){content->has_calibration ? &content->calibration : NULL, content->has_settings ? &content->settings : NULL,
                        content->has_profile ? &content->profile : NULL};
}

/* The deadline has passed: a flash that is still busy with what has failed is not waited for. */
static void put(struct store *store, const struct parts *parts) {
  store->attempts = 0;
  make_record(store, parts);
  store->step = STORE_REQUESTED;
  store->step_ends_us = 0;
}

enum ft_status store_poll(struct store *store, uint64_t now_us) {
  if (store->step == STORE_IDLE) {
    if (!store->must_rewrite) {
      return FT_OK;
    }
    const struct parts parts = kept_parts(store);
    put(store, &parts);
  }
  if (port_flash_poll()) {
    return now_us < store->step_ends_us ? FT_PENDING : fail(store, FT_ERR_TIMEOUT);
  }
  switch (store->step) {
  case STORE_REQUESTED: begin_write(store, now_us); break;
  case STORE_SECURE: begin_erase(store, now_us); break;
  case STORE_ERASE: begin_slot(store, now_us); break;
  case STORE_BEGIN:
  case STORE_WRITE:
    store->at = store->step == STORE_BEGIN ? MAGIC_AT : (uint16_t)(store->at + write_length(store));
    if (store->at < store->record_length) {
      port_flash_program(to_address(store) + store->at, store->record + store->at, write_length(store));
      begin_step(store, STORE_WRITE, now_us);
    } else {
      store->at = BEGUN_AT; /* which the buffer holds zeros for, like the mark */
      begin_step(store, STORE_READ_BACK, now_us);
    }
    break;
  case STORE_READ_BACK:
    if (!read_back(store)) {
      return try_again(store, now_us);
    }
    if (store->at == store->record_length) {
      program_mark(store, sealed_at(store));
      begin_step(store, STORE_SEAL, now_us);
    }
    break;
  case STORE_SEAL:
    program_mark(store, final_at(store));
    begin_step(store, STORE_END, now_us);
    break;
  default:
    if (read_u32(to_address(store) + sealed_at(store)) != MARK || read_u32(to_address(store) + final_at(store)) != MARK) {
      return try_again(store, now_us);
    }
    return finish_write(store);
  }
  return FT_PENDING;
}

/* has: there is something of this part now. */
static enum ft_status change(struct store *store, const struct parts *parts, bool puts, bool has, bool pad_changes) {
  if (store_is_writing(store)) {
    return FT_ERR_BUSY;
  }
  if (!puts && !has && !store->damaged) {
    return FT_OK;
  }
  store->pad_changes = pad_changes;
  put(store, parts);
  return FT_PENDING;
}

enum ft_status store_put_calibration(struct store *store, const struct calibration *calibration) {
  struct parts parts = kept_parts(store);
  parts.calibration = calibration;
  return change(store, &parts, calibration != NULL, store->content.has_calibration, true);
}

enum ft_status store_put_settings(struct store *store, const struct store_settings *settings) {
  struct parts parts = kept_parts(store);
  parts.settings = settings;
  return change(store, &parts, settings != NULL, store->content.has_settings, false);
}

enum ft_status store_put_profile(struct store *store, const struct pad_profile *profile) {
  struct parts parts = kept_parts(store);
  parts.profile = profile;
  return change(store, &parts, profile != NULL, store->content.has_profile, true);
}
