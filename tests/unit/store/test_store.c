/* The store on a flash that loses its power at every step. */
#include "common/bytes.h"
#include "common/crc32.h"
#include "native/native_flash.h"
#include "store/store.h"
#include "support/pad.h"
#include "support/random.h"
#include "support/unit.h"

/* PROFILE_BYTES: without the struct's padding. */
enum { SENSORS = 15, UPDATES = 2000, PROFILE_BYTES = 4 * PAD_PROFILE_FLOATS + 1 };

static struct store store;
static struct random random;
static uint64_t now_us;
static uint8_t sensors;

/* A new fingertip of so many. */
static void begin_with(uint8_t count) {
  sensors = count;
  native_flash_reset(7);
  store_init(&store, sensors);
}

void setUp(void) {
  random = (struct random){2026};
  begin_with(SENSORS);
}

static struct calibration some_calibration(void) {
  struct calibration calibration = {0};
  calibration.date_s = random_u32(&random);
  calibration.placements = (uint16_t)random_below(&random, 100);
  calibration.force_scale = (float)random_between(&random, 0.5, 2.0);
  calibration.force_scale_sd = (float)random_between(&random, 0.0, 0.2);
  calibration.sigma_um = (uint16_t)(500 + random_below(&random, 20000));
  calibration.sigma_sd_um = (uint16_t)(10 + random_below(&random, 1000));
  calibration.dip_share_q16 = (uint16_t)(1 + random_below(&random, 6000));
  calibration.dip_sd_um = (uint16_t)(1 + random_below(&random, 60000));
  calibration.ambient_kPa = (uint8_t)random_below(&random, 256);
  for (int k = 0; k < sensors; k++) {
    struct sensor_calibration *sensor = &calibration.sensors[k];
    sensor->gain = (float)random_between(&random, 0.7, 1.3);
    sensor->gain_sd = (float)random_between(&random, 0.0, 0.1);
    sensor->off_x_um = (int16_t)((int)random_below(&random, 4001) - 2000);
    sensor->off_y_um = (int16_t)((int)random_below(&random, 4001) - 2000);
    sensor->wider_q15 = (int16_t)((int)random_below(&random, 19661) - 9830);
  }
  return calibration;
}

static struct store_settings some_settings(void) {
  return (struct store_settings){.rate_mHz = random_below(&random, 2000000),
                                 .osr = (uint16_t)(256u << random_below(&random, 6)),
                                 .slip_window_ms = (uint16_t)random_below(&random, 1000),
                                 .slip_threshold_mm = (float)random_between(&random, 0.1, 5.0),
                                 .prior_sigma_mm = (float)random_between(&random, 1.0, 5.0),
                                 .prior_width_mm = (float)random_between(&random, 0.1, 1.0),
                                 .location_limit_mm = (float)random_between(&random, 0.1, 2.0),
                                 .sync = random_below(&random, 4)};
}

static struct pad_profile some_profile(void) {
  struct pad_profile profile = pad_of_12_mm();
  profile.thickness_mm = (float)random_between(&random, 6.0, 15.0);
  profile.tangential[2].sd_mm = (float)random_between(&random, 10.0, 30.0);
  profile.tangential_scale_sd = (float)random_between(&random, 0.0, 0.5);
  profile.from_touch = (uint8_t)random_below(&random, 2);
  return profile;
}

/* A change of one part of what is kept. */
struct change {
  enum { CALIBRATION, PAD, SETTINGS } part;
  bool erases;
  struct calibration calibration;
  struct store_settings settings;
  struct pad_profile profile;
};

static struct change some_change(void) {
  struct change change = {.part = random_below(&random, 3), .erases = random_below(&random, 4) == 0};
  change.calibration = some_calibration();
  change.settings = some_settings();
  change.profile = some_profile();
  return change;
}

static struct store_content changed(const struct store_content *before, const struct change *change) {
  static const struct change nothing;
  struct store_content after = *before;
  const struct change *from = change->erases ? &nothing : change;
  if (change->part == CALIBRATION) {
    after.has_calibration = !change->erases;
    after.calibration = from->calibration;
  } else if (change->part == PAD) {
    after.has_profile = !change->erases;
    after.profile = from->profile;
  } else {
    after.has_settings = !change->erases;
    after.settings = from->settings;
  }
  return after;
}

static bool is(const struct store_content *expected) {
  return store.content.has_calibration == expected->has_calibration && store.content.has_settings == expected->has_settings &&
         store.content.has_profile == expected->has_profile &&
         memcmp(&store.content.calibration, &expected->calibration, sizeof expected->calibration) == 0 &&
         memcmp(&store.content.settings, &expected->settings, sizeof expected->settings) == 0 &&
         memcmp(&store.content.profile, &expected->profile, PROFILE_BYTES) == 0;
}

static enum ft_status put(const struct change *change) {
  return change->part == CALIBRATION ? store_put_calibration(&store, change->erases ? NULL : &change->calibration)
         : change->part == PAD       ? store_put_profile(&store, change->erases ? NULL : &change->profile)
                                     : store_put_settings(&store, change->erases ? NULL : &change->settings);
}

/* Until nothing is under way, or power is lost. */
static enum ft_status finish(void) {
  enum ft_status status;
  unsigned polls = 0;
  do {
    TEST_ASSERT_LESS_THAN_UINT_MESSAGE(1000, ++polls, "a write that does not end");
    now_us += 1000;
    status = store_poll(&store, now_us);
  } while (status == FT_PENDING && !native_flash_is_dead());
  return status;
}

static void expect_kept(enum ft_status begun) {
  TEST_ASSERT_EQUAL(FT_PENDING, begun);
  TEST_ASSERT_EQUAL(FT_OK, finish());
}

static void restart(void) {
  native_flash_power_up();
  store_init(&store, sensors);
}

TEST(a_new_fingertip_keeps_nothing) {
  TEST_ASSERT_FALSE(store.content.has_calibration || store.content.has_settings);
  TEST_ASSERT_FALSE(store.content.has_profile);
  TEST_ASSERT_FALSE(store.damaged || store_is_writing(&store));
  native_flash_cut_after(0);
  TEST_ASSERT_EQUAL(FT_OK, store_put_calibration(&store, NULL));
  TEST_ASSERT_EQUAL(FT_OK, store_put_settings(&store, NULL));
  TEST_ASSERT_EQUAL(FT_OK, store_put_profile(&store, NULL));
  TEST_ASSERT_FALSE(native_flash_is_dead());
}

TEST(what_was_put_is_there_after_a_restart) {
  struct store_content expected = {0};
  for (int i = 0; i < 200; i++) {
    struct change change = some_change();
    enum ft_status begun = put(&change);
    struct store_content before = expected;
    expected = changed(&expected, &change);
    if (begun == FT_PENDING) {
      TEST_ASSERT_TRUE_MESSAGE(is(&before), "nothing is there before it is there for good");
      TEST_ASSERT_EQUAL(FT_ERR_BUSY, put(&change));
      TEST_ASSERT_TRUE(store_is_writing(&store));
      TEST_ASSERT_EQUAL(FT_OK, finish());
    } else {
      TEST_ASSERT_EQUAL(FT_OK, begun);
    }
    TEST_ASSERT_TRUE(is(&expected));
    if (i % 3 == 0) {
      restart();
      TEST_ASSERT_TRUE(is(&expected));
      TEST_ASSERT_FALSE(store.damaged || store_is_writing(&store));
    }
  }
}

/* Power lost at every step of so many changes, and once more while start-up mends what that has
 * left: what is there is what was or what was to be, and stays so once it has been mended. */
static void lose_power_at_any_step(unsigned updates, struct store_content before) {
  unsigned long cuts = 0, new_ones = 0;
  for (unsigned update = 0; update < updates; update++) {
    const struct native_flash start = native_flash;
    struct change change = some_change();
    struct store_content after = changed(&before, &change);
    for (uint64_t step = 0;; step++) {
      native_flash = start;
      restart();
      finish(); /* the mending, where there is any */
      native_flash_cut_after(step);
      if (put(&change) == FT_PENDING) {
        finish();
      }
      if (!native_flash_is_dead()) {
        break;
      }
      cuts++;
      restart();
      TEST_ASSERT_TRUE_MESSAGE(is(&before) || is(&after), "lost or mixed");
      if (random_below(&random, 4) == 0) {
        native_flash_cut_after(random_below(&random, 24));
        finish();
        restart();
        TEST_ASSERT_TRUE_MESSAGE(is(&before) || is(&after), "lost or mixed in mending");
      }
      TEST_ASSERT_EQUAL(FT_OK, finish());
      bool is_new = is(&after);
      new_ones += is_new;
      TEST_ASSERT_TRUE(is_new || is(&before));
      for (int again = 0; again < 2; again++) {
        restart();
        TEST_ASSERT_TRUE_MESSAGE(is(is_new ? &after : &before), "it turned round");
        TEST_ASSERT_FALSE(store.damaged);
      }
    }
    TEST_ASSERT_TRUE(is(&after));
    before = after;
    /* The next update begins where one was cut short, now and then. */
    if (random_below(&random, 4) == 0) {
      struct change other = some_change();
      struct store_content then = changed(&before, &other);
      native_flash_cut_after(random_below(&random, 24));
      if (put(&other) == FT_PENDING) {
        finish();
      }
      restart();
      TEST_ASSERT_TRUE(is(&before) || is(&then));
      finish();
      TEST_ASSERT_TRUE(is(&before) || is(&then));
      before = is(&then) ? then : before;
    }
  }
  TEST_ASSERT_GREATER_THAN_UINT(8ul * updates, cuts);
  TEST_ASSERT_GREATER_THAN_UINT(updates, new_ones);
}

TEST(power_may_be_lost_at_any_step) { lose_power_at_any_step(UPDATES, (struct store_content){0}); }

/* A record of the most sensors takes three pages; the most that fit into a short slot, and one more. */
TEST(power_may_be_lost_with_large_arrays) {
  static const uint8_t counts[] = {STORE_SENSORS_OF_SHORT_SLOT, STORE_SENSORS_OF_SHORT_SLOT + 1, FT_MAX_SENSORS};
  for (size_t n = 0; n < sizeof counts; n++) {
    begin_with(counts[n]);
    lose_power_at_any_step(UPDATES / 12, (struct store_content){0});
  }
}

/* A supply that comes and goes: each mending is cut short in its turn, many times in a row, so that
 * whole sectors fill with records that were never sealed. */
TEST(power_may_come_and_go) {
  struct store_content before = {0};
  for (int storm = 0; storm < 2000; storm++) {
    struct change change = some_change();
    struct store_content after = changed(&before, &change);
    if (put(&change) != FT_PENDING) {
      continue;
    }
    for (int cut = 0; cut < 30; cut++) {
      native_flash_cut_after(4 + random_below(&random, storm % 2 ? 5 : 11));
      finish();
      if (!native_flash_is_dead()) { /* it was kept before: there was nothing to mend */
        TEST_ASSERT_TRUE(is(&before) || is(&after));
      }
      restart();
      TEST_ASSERT_TRUE_MESSAGE(is(&before) || is(&after), "lost or mixed");
    }
    TEST_ASSERT_EQUAL(FT_OK, finish());
    TEST_ASSERT_TRUE(is(&before) || is(&after));
    before = is(&after) ? after : before;
    restart();
    TEST_ASSERT_TRUE_MESSAGE(is(&before), "it turned round");
    finish();
  }
}

static struct store_content keep_something(void) {
  struct store_content content = {.has_calibration = true, .has_settings = true, .has_profile = true};
  content.calibration = some_calibration();
  content.settings = some_settings();
  content.profile = some_profile();
  expect_kept(store_put_profile(&store, &content.profile));
  expect_kept(store_put_calibration(&store, &content.calibration));
  expect_kept(store_put_settings(&store, &content.settings));
  return content;
}

/* The newest record, the third one, is damaged: the one before it is not what the user has stored last, so it is not used in its place. */
TEST(damage_is_told_and_nothing_is_used) {
  static const struct store_content nothing;
  keep_something();
  const struct native_flash whole = native_flash;
  for (uint32_t at = 2 * STORE_SHORT_SLOT_BYTES + 8; at < 2 * STORE_SHORT_SLOT_BYTES + 458; at++) {
    native_flash = whole;
    native_flash.bytes[at] ^= (uint8_t)(1u << at % 8);
    const struct native_flash damaged = native_flash;
    restart();
    TEST_ASSERT_TRUE(store.damaged);
    TEST_ASSERT_TRUE(is(&nothing));
    TEST_ASSERT_EQUAL(FT_OK, finish());
    TEST_ASSERT_EQUAL_MEMORY(&damaged, &native_flash, sizeof damaged);
  }
  struct store_content again = {.has_calibration = true, .calibration = some_calibration()};
  expect_kept(store_put_calibration(&store, &again.calibration));
  TEST_ASSERT_FALSE(store.damaged);
  restart();
  TEST_ASSERT_FALSE(store.damaged);
  TEST_ASSERT_TRUE(is(&again));
  native_flash = whole;
  native_flash.bytes[2 * STORE_SHORT_SLOT_BYTES + 100] ^= 1;
  restart();
  expect_kept(store_put_settings(&store, NULL)); /* forgetting mends it too */
  restart();
  TEST_ASSERT_FALSE(store.damaged || store.content.has_settings);
}

/* The first slot's record as another firmware would have written it. */
static void alter_record(uint32_t at, uint16_t value) {
  uint8_t *record = native_flash.bytes;
  bytes_put_u16(record + at, value);
  uint16_t length = bytes_get_u16(record + 10);
  uint32_t crc = CRC32_BEGIN;
  for (int i = 4; i < 20 + length; i++) {
    crc = i >= 16 && i < 20 ? crc : crc32_add_u8(crc, record[i]);
  }
  bytes_put_u32(record + 16, ~crc);
}

/* Of a payload of version 3, without the places of the sensors. */
#define LENGTH_OF_3(sensors) (4 + 14 + 8 * (sensors) + 24 + PROFILE_BYTES + 9)
enum { LENGTH_3 = LENGTH_OF_3(SENSORS) };

TEST(what_another_firmware_wrote_is_left_alone) {
  struct calibration calibration = some_calibration();
  expect_kept(store_put_calibration(&store, &calibration));
  const struct native_flash ours = native_flash;
  alter_record(8, 4); /* as it was: the bytes are where the header says */
  TEST_ASSERT_EQUAL_MEMORY(&ours, &native_flash, sizeof ours);
  static const struct {
    uint32_t at;
    uint16_t value;
  } others[] = {{8, 1},   {8, 2},    {8, 3},    {8, 5},       {8, UINT16_MAX},      {20, 14 << 8 | 1},
                {10, 60}, {10, 487}, {10, 162}, {32, 0x42C8}, {20 + LENGTH_3, 2001}};
  for (size_t i = 0; i < sizeof others / sizeof others[0]; i++) {
    native_flash = ours;
    alter_record(others[i].at, others[i].value);
    const struct native_flash other = native_flash;
    restart();
    TEST_ASSERT_TRUE(store.damaged);
    TEST_ASSERT_FALSE(store.content.has_calibration);
    TEST_ASSERT_EQUAL(FT_OK, finish());
    TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&other, &native_flash, sizeof other, "reading wrote");
  }
}

/* Of the newest record, of any writer. */
TEST(generations_go_round) {
  for (uint32_t generation = UINT32_MAX - 2; generation != 3; generation++) {
    native_flash_reset(7);
    restart();
    struct store_content kept = keep_something();
    alter_record(12, (uint16_t)generation);
    alter_record(14, (uint16_t)(generation >> 16));
    memset(native_flash.bytes + STORE_SHORT_SLOT_BYTES, 0xFF, NATIVE_FLASH_BYTES - STORE_SHORT_SLOT_BYTES);
    for (int i = 0; i < 3 * STORE_SLOTS; i++) {
      restart();
      finish();
      kept.has_settings = true;
      kept.settings = some_settings();
      expect_kept(store_put_settings(&store, &kept.settings));
      restart();
      TEST_ASSERT_FALSE(store.damaged || store_is_writing(&store));
      TEST_ASSERT_TRUE(store.content.has_settings);
      TEST_ASSERT_EQUAL_MEMORY(&kept.settings, &store.content.settings, sizeof kept.settings);
    }
  }
}

/* As the firmware before them knew it. */
static void forget_places(struct calibration *calibration) {
  for (int k = 0; k < FT_MAX_SENSORS; k++) {
    struct sensor_calibration *sensor = &calibration->sensors[k];
    sensor->off_x_um = sensor->off_y_um = sensor->wider_q15 = 0;
  }
}

/* The firmware before the sensors' places kept 32 of them in slots of 512 bytes. Eight records, as it wrote them: the
 * last counts, and the next goes into the other sector, whenever power is lost. */
TEST(short_slots_of_the_largest_array_are_read) {
  enum { EARLIER_MOST = 32, SLOT = STORE_SHORT_SLOT_BYTES, LENGTH = LENGTH_OF_3(EARLIER_MOST) };
  for (unsigned records = 1; records <= STORE_SLOTS; records++) {
    uint8_t earlier[STORE_SLOTS * SLOT];
    memset(earlier, 0xFF, sizeof earlier);
    struct store_content kept = {0};
    for (unsigned i = 0; i < records; i++) {
      begin_with(EARLIER_MOST);
      kept.has_calibration = true;
      kept.calibration = some_calibration();
      expect_kept(store_put_calibration(&store, &kept.calibration));
      alter_record(8, 3);
      alter_record(10, LENGTH);
      memcpy(earlier + i * SLOT, native_flash.bytes, 20 + LENGTH);
      memset(earlier + (i + 1) * SLOT - 8, 0, 8);
    }
    begin_with(EARLIER_MOST);
    memcpy(native_flash.bytes, earlier, sizeof earlier);
    forget_places(&kept.calibration);
    restart();
    TEST_ASSERT_FALSE(store.damaged || store_is_writing(&store));
    TEST_ASSERT_TRUE(is(&kept));
    TEST_ASSERT_EQUAL_MEMORY(earlier, native_flash.bytes, sizeof earlier);
    lose_power_at_any_step(12, kept);
  }
}

/* As earlier firmware wrote it, without the bytes that came later: the sensors' places, the calibration's shape, the
 * profile. The next write brings it to this version. Bit 2 of the parts meant nothing in version 1. */
TEST(records_of_earlier_versions_are_read) {
  enum { OF_1 = 4 + 14 + 8 * SENSORS + 24, OF_2 = OF_1 + PROFILE_BYTES, LENGTH = LENGTH_3 + 6 * SENSORS };
  static const uint16_t lengths[] = {OF_1, OF_2, LENGTH_3};
  for (uint16_t version = 1; version <= 3; version++) {
    struct store_content kept = keep_something();
    if (version < 3) {
      kept.calibration.sigma_um = kept.calibration.sigma_sd_um = 0;
      kept.calibration.dip_share_q16 = kept.calibration.dip_sd_um = 0;
      kept.calibration.ambient_kPa = 0;
    }
    forget_places(&kept.calibration);
    begin_with(SENSORS);
    if (version > 1) {
      expect_kept(store_put_profile(&store, &kept.profile));
    }
    expect_kept(store_put_calibration(&store, &kept.calibration));
    expect_kept(store_put_settings(&store, &kept.settings));
    const int slot = version > 1 ? 2 : 1;
    memmove(native_flash.bytes, native_flash.bytes + slot * STORE_SHORT_SLOT_BYTES, STORE_SHORT_SLOT_BYTES);
    memset(native_flash.bytes + STORE_SHORT_SLOT_BYTES, 0xFF, 2 * STORE_SHORT_SLOT_BYTES);
    memset(native_flash.bytes + 20 + lengths[version - 1], 0xFF, (size_t)(LENGTH - lengths[version - 1]));
    alter_record(8, version);
    alter_record(10, lengths[version - 1]);
    if (version == 1) {
      alter_record(20, SENSORS << 8 | 7);
      kept.has_profile = false;
      memset(&kept.profile, 0, sizeof kept.profile);
    }
    restart();
    TEST_ASSERT_FALSE(store.damaged || store_is_writing(&store));
    TEST_ASSERT_TRUE(is(&kept));
    kept.has_profile = true;
    kept.profile = some_profile();
    expect_kept(store_put_profile(&store, &kept.profile));
    restart();
    TEST_ASSERT_TRUE(is(&kept));
  }
}

/* Sectors that something else has used before. */
TEST(rubbish_is_no_damage_and_in_nobodys_way) {
  for (int kind = 0; kind < 3; kind++) {
    native_flash_reset(3);
    for (size_t i = 0; i < NATIVE_FLASH_BYTES; i++) {
      native_flash.bytes[i] = (uint8_t)(kind == 0 ? 0 : kind == 1 ? random_u32(&random) : i);
    }
    const struct native_flash rubbish = native_flash;
    restart();
    TEST_ASSERT_FALSE(store.damaged || store_is_writing(&store));
    TEST_ASSERT_EQUAL_MEMORY(&rubbish, &native_flash, sizeof rubbish);
    struct store_content kept = keep_something();
    restart();
    finish();
    restart();
    TEST_ASSERT_TRUE(is(&kept));
    TEST_ASSERT_FALSE_MESSAGE(store_is_writing(&store), "rubbish is cleared away once");
  }
}

TEST(a_flash_that_has_worn_out_is_told_and_what_was_stays) {
  struct store_content kept = keep_something();
  native_flash_wear_out();
  struct calibration other = some_calibration();
  TEST_ASSERT_EQUAL(FT_PENDING, store_put_calibration(&store, &other));
  TEST_ASSERT_EQUAL(FT_ERR_CRC, finish());
  TEST_ASSERT_TRUE(is(&kept));
  TEST_ASSERT_FALSE(store_is_writing(&store));
  restart();
  TEST_ASSERT_TRUE(is(&kept));
}

/* Bits that something else has written, in slots that no mark calls used: in how many is all one. */
TEST(slots_that_do_not_hold_what_is_written_are_given_up) {
  for (int bad = 0; bad <= 7; bad++) {
    setUp();
    keep_something();
    for (int slot = 0; slot < bad; slot++) {
      uint32_t at = store.sector * PORT_FLASH_SECTOR_BYTES;
      memset(&native_flash.bytes[at + (uint32_t)(store.next_slot + slot) * store.slot_bytes + 100], 0, 4);
    }
    struct store_content changed = store.content;
    changed.calibration = some_calibration();
    expect_kept(store_put_calibration(&store, &changed.calibration));
    TEST_ASSERT_TRUE(is(&changed));
    restart();
    TEST_ASSERT_TRUE(is(&changed));
    TEST_ASSERT_FALSE(store_is_writing(&store));
  }
}

TEST(a_flash_that_does_not_answer_is_not_waited_for) {
  native_flash_cut_after(2);
  struct store_settings settings = some_settings();
  TEST_ASSERT_EQUAL(FT_PENDING, store_put_settings(&store, &settings));
  enum ft_status status = FT_PENDING;
  for (int ms = 0; ms < 1100 && status == FT_PENDING; ms++) {
    now_us += 1000;
    status = store_poll(&store, now_us);
  }
  TEST_ASSERT_EQUAL(FT_ERR_TIMEOUT, status);
  TEST_ASSERT_EQUAL(FT_PENDING, store_put_settings(&store, &settings));
  TEST_ASSERT_EQUAL(FT_ERR_TIMEOUT, store_poll(&store, now_us));
}
