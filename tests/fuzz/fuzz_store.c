/* The store, on a flash that holds anything and loses its power at any step. */
#include "flash_record.h"
#include "fuzz.h"

enum { PROFILE_BYTES = 4 * PAD_PROFILE_FLOATS + 1 };

static struct store store;
static uint8_t sensors; /* 3, or 20: they have long slots */
static uint64_t now_us;

static bool is_same(const struct store_content *a, const struct store_content *b) {
  return a->has_calibration == b->has_calibration && a->has_settings == b->has_settings && a->has_profile == b->has_profile &&
         memcmp(&a->calibration, &b->calibration, sizeof a->calibration) == 0 &&
         memcmp(&a->settings, &b->settings, sizeof a->settings) == 0 && memcmp(&a->profile, &b->profile, PROFILE_BYTES) == 0;
}

/* What is not there is zero, what is there is valid. */
static void check_content(void) {
  static const struct store_content none;
  struct store_content content = store.content;
  FUZZ_CHECK(!content.has_calibration || calibration_is_valid(&content.calibration, sensors));
  FUZZ_CHECK(content.has_calibration || memcmp(&content.calibration, &none.calibration, sizeof none.calibration) == 0);
  FUZZ_CHECK(content.has_settings || memcmp(&content.settings, &none.settings, sizeof none.settings) == 0);
  FUZZ_CHECK(content.has_profile || memcmp(&content.profile, &none.profile, PROFILE_BYTES) == 0);
  FUZZ_CHECK(store.next_slot <= STORE_SLOTS && store.sealed_slot <= STORE_SLOTS && store.sector < PORT_FLASH_SECTORS);
}

/* Until nothing is under way, or power is lost. */
static enum ft_status finish(void) {
  enum ft_status status = FT_PENDING;
  for (unsigned polls = 0; status == FT_PENDING && !native_flash_is_dead(); polls++) {
    FUZZ_CHECK(polls < 2000);
    now_us += 1000;
    status = store_poll(&store, now_us);
  }
  return status;
}

static void start(void) {
  native_flash_power_up();
  store_init(&store, sensors);
  check_content();
}

/* What is kept after the change that these bytes say, begun. */
static enum ft_status begin_change(struct fuzz_input *input, struct store_content *after) {
  *after = store.content;
  const uint8_t kind = fuzz_u8(input);
  struct calibration calibration = {.date_s = fuzz_u8(input), .placements = 20, .force_scale = 1.0f};
  for (int k = 0; k < sensors; k++) {
    struct sensor_calibration *sensor = &calibration.sensors[k];
    sensor->gain = 0.5f + (float)fuzz_u8(input) / 255.0f;
    sensor->gain_sd = 0.1f;
    sensor->off_x_um = sensor->wider_q15 = fuzz_u8(input);
    sensor->off_y_um = (int16_t)-sensor->off_x_um;
  }
  struct store_settings settings = {.rate_mHz = fuzz_u32(input), .osr = fuzz_u16(input), .slip_threshold_mm = 1.0f};
  struct pad_profile profile = {.thickness_mm = (float)fuzz_u8(input)};
  memset((uint8_t *)&profile + PROFILE_BYTES, 0, sizeof profile - PROFILE_BYTES);
  const bool erases = (kind & 0x80) != 0;
  switch (kind % 3) {
  case 0:
    after->has_calibration = !erases;
    after->calibration = erases ? (struct calibration){0} : calibration;
    return store_put_calibration(&store, erases ? NULL : &calibration);
  case 1:
    after->has_settings = !erases;
    after->settings = erases ? (struct store_settings){0} : settings;
    return store_put_settings(&store, erases ? NULL : &settings);
  default:
    after->has_profile = !erases;
    after->profile = erases ? (struct pad_profile){0} : profile;
    return store_put_profile(&store, erases ? NULL : &profile);
  }
}

/* What start-up decides for stays, once it is mended. */
static void check_settles(void) {
  const struct store_content decided = store.content;
  const bool damaged = store.damaged;
  FUZZ_CHECK(finish() == FT_OK);
  start();
  FUZZ_CHECK(is_same(&store.content, &decided) && store.damaged == damaged);
}

/* Without a cut it is kept, whatever the flash held. Cut short at the step that the input says, in
 * a flash that only the store has written, there is the old or the new, and it stays. */
static void change(struct fuzz_input *input, bool may_cut) {
  const struct store_content before = store.content;
  const uint8_t cut_after = fuzz_u8(input);
  if (store_is_writing(&store)) {
    finish();
  }
  if (may_cut && cut_after & 0x80) {
    native_flash_cut_after(cut_after & 0x3F); /* a change takes some thirty */
  }
  struct store_content after;
  const enum ft_status began = begin_change(input, &after);
  FUZZ_CHECK(began == FT_OK || began == FT_PENDING);
  const enum ft_status ended = began == FT_PENDING ? finish() : began;
  const bool was_cut = native_flash_is_dead();
  FUZZ_CHECK(was_cut || (ended == FT_OK && is_same(&store.content, &after) && !store.damaged));
  start();
  FUZZ_CHECK(is_same(&store.content, &after) || (was_cut && is_same(&store.content, &before)));
  if (was_cut) {
    check_settles();
  }
}

static void soil(struct fuzz_input *input) {
  const uint32_t at = fuzz_u16(input) % NATIVE_FLASH_BYTES;
  size_t length = fuzz_u8(input);
  length = length < NATIVE_FLASH_BYTES - at ? length : NATIVE_FLASH_BYTES - at;
  const uint8_t *bytes = fuzz_bytes(input, &length);
  memcpy(native_flash.bytes + at, bytes, length);
}

void fuzz_one(const uint8_t *bytes, size_t length) {
  struct fuzz_input input = {bytes, bytes + length};
  const uint16_t seed = fuzz_u16(&input);
  const uint32_t generation = seed & 1 ? 1 : UINT32_MAX - 1;
  sensors = seed & 2 ? 20 : 3;
  native_flash_reset(seed);
  now_us = 0;
  bool ours = true;
  for (uint8_t records = fuzz_u8(&input) % 8; records > 0; records--) {
    fuzz_put_record(&input, generation, sensors);
    ours = false;
  }
  start();
  while (fuzz_left(&input) > 0) {
    switch (fuzz_u8(&input) % 8) {
    case 0:
    case 1:
      soil(&input);
      ours = false;
      start();
      break;
    case 2: /* bits that read as they like: of no record, so it must only end */
      native_flash.unstable[fuzz_u16(&input) % NATIVE_FLASH_BYTES] = fuzz_u8(&input);
      ours = false;
      start();
      finish();
      memset(native_flash.unstable, 0, sizeof native_flash.unstable);
      start();
      break;
    case 3: /* power lost while it mends */
      native_flash_cut_after(fuzz_u8(&input));
      finish();
      start();
      break;
    default: change(&input, ours);
    }
    check_content();
  }
  start();
}
