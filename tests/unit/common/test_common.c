#include "common/bytes.h"
#include "common/calibration.h"
#include "common/crc32.h"
#include "support/pad.h"
#include "support/random.h"
#include "support/unit.h"

#include <stddef.h>

/* The definition: one bit at a time, no table. */
static uint32_t crc32_bitwise(const uint8_t *bytes, size_t length) {
  uint32_t crc = UINT32_MAX;
  for (size_t i = 0; i < length; i++) {
    crc ^= bytes[i];
    for (int bit = 0; bit < 8; bit++) {
      crc = crc & 1u ? crc >> 1 ^ 0xEDB88320u : crc >> 1;
    }
  }
  return ~crc;
}

TEST(test_crc_check_value) {
  TEST_ASSERT_EQUAL_HEX32(0xCBF43926, crc32_iso_hdlc((const uint8_t *)"123456789", 9));
  TEST_ASSERT_EQUAL_HEX32(0, crc32_iso_hdlc((const uint8_t *)"", 0));
}

TEST(test_crc_equals_bitwise_at_every_length_and_alignment) {
  struct random random = {1};
  uint8_t bytes[520];
  for (size_t i = 0; i < sizeof bytes; i++) {
    bytes[i] = (uint8_t)random_u32(&random);
  }
  for (size_t length = 0; length <= 512; length++) {
    for (size_t at = 0; at < 8; at++) {
      TEST_ASSERT_EQUAL_HEX32(crc32_bitwise(bytes + at, length), crc32_iso_hdlc(bytes + at, length));
    }
  }
}

TEST(test_bytes_are_little_endian) {
  const uint8_t expected[8] = {0x88, 0x77, 0x66, 0x55, 0x44, 0x33, 0x22, 0x11};
  for (size_t at = 0; at < 8; at++) {
    uint8_t bytes[16] = {0};
    memcpy(bytes + at, expected, sizeof expected);
    TEST_ASSERT_EQUAL_HEX64(UINT64_C(0x1122334455667788), bytes_get_u64(bytes + at));
    memset(bytes, 0, sizeof bytes);
    bytes_put_u32(bytes + at, 0x55667788);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, bytes + at, 4);
    TEST_ASSERT_EQUAL_HEX8(0, bytes[at + 4]);
    TEST_ASSERT_EQUAL_HEX32(0x55667788, bytes_get_u32(bytes + at));
    memset(bytes, 0, sizeof bytes);
    bytes_put_u16(bytes + at, 0x7788);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, bytes + at, 2);
    TEST_ASSERT_EQUAL_HEX8(0, bytes[at + 2]);
    TEST_ASSERT_EQUAL_HEX16(0x7788, bytes_get_u16(bytes + at));
  }
}

TEST(test_floats_travel_by_their_bits) {
  TEST_ASSERT_EQUAL_HEX32(0x3F800000, bytes_from_f32(1.0f));
  TEST_ASSERT_EQUAL_HEX32(0x80000000, bytes_from_f32(-0.0f));
  TEST_ASSERT_EQUAL_HEX32(0x40490FDB, bytes_from_f32(3.14159265f));
  TEST_ASSERT_TRUE(bytes_to_f32(0x00000001) > 0.0f);
  struct random random = {3};
  for (int i = 0; i < 100000; i++) {
    uint32_t bits = random_u32(&random);
    if ((bits & 0x7F800000u) != 0x7F800000u) {
      TEST_ASSERT_EQUAL_HEX32(bits, bytes_from_f32(bytes_to_f32(bits)));
    }
  }
}

static struct calibration calibration;
static struct pad_profile pad;

static bool is_calibration(void) { return calibration_is_valid(&calibration, 15); }

static bool is_pad(void) { return pad_profile_is_valid(&pad); }

struct range {
  float *value;
  float least, greatest;
};

static void assert_ranges(const struct range *ranges, size_t count, bool (*is_valid)(void)) {
  for (size_t i = 0; i < count; i++) {
    const float was = *ranges[i].value;
    const float values[] = {
        ranges[i].least, ranges[i].greatest, ranges[i].least - 1e-3f, ranges[i].greatest * 1.001f, -INFINITY, INFINITY, NAN};
    for (size_t j = 0; j < sizeof values / sizeof values[0]; j++) {
      *ranges[i].value = values[j];
      TEST_ASSERT_EQUAL(j < 2, is_valid());
    }
    *ranges[i].value = was;
  }
}

TEST(test_calibrations_are_in_their_ranges) {
  calibration = (struct calibration){.force_scale = 1.0f};
  for (int k = 0; k < FT_MAX_SENSORS; k++) {
    calibration.sensors[k].gain = 1.0f;
  }
  TEST_ASSERT_TRUE(calibration_is_valid(&calibration, FT_MAX_SENSORS));
  const struct range ranges[] = {
      {&calibration.force_scale, CALIBRATION_FORCE_SCALE_MIN, CALIBRATION_FORCE_SCALE_MAX},
      {&calibration.force_scale_sd, 0.0f, CALIBRATION_FORCE_SCALE_SD_MAX},
      {&calibration.sensors[0].gain, CALIBRATION_GAIN_MIN, CALIBRATION_GAIN_MAX},
      {&calibration.sensors[14].gain_sd, 0.0f, CALIBRATION_GAIN_SD_MAX},
  };
  assert_ranges(ranges, sizeof ranges / sizeof ranges[0], is_calibration);
  const struct {
    int16_t *value;
    int16_t greatest;
  } both_sides[] = {
      {&calibration.sensors[0].off_x_um, 2000}, {&calibration.sensors[14].off_y_um, 2000}, {&calibration.sensors[7].wider_q15, 9830}};
  for (size_t i = 0; i < sizeof both_sides / sizeof both_sides[0]; i++) {
    for (int side = -1; side <= 1; side += 2) {
      *both_sides[i].value = (int16_t)(side * both_sides[i].greatest);
      TEST_ASSERT_TRUE(is_calibration());
      *both_sides[i].value = (int16_t)(side * (both_sides[i].greatest + 1));
      TEST_ASSERT_FALSE(is_calibration());
      *both_sides[i].value = side > 0 ? INT16_MAX : INT16_MIN;
      TEST_ASSERT_FALSE(is_calibration());
    }
    *both_sides[i].value = 0;
  }
  static const struct {
    uint16_t sigma_um, sigma_sd_um, dip_share_q16, dip_sd_um;
    bool valid;
  } shapes[] = {{500, 10, 0, 0, true},  {65535, 65535, 6553, 1, true}, {499, 10, 0, 0, false},
                {500, 9, 0, 0, false},  {0, 10, 0, 0, false},          {0, 0, 6554, 9000, false},
                {0, 0, 3000, 0, false}, {0, 0, 0, 9000, false},        {0, 0, 0, 0, true}};
  for (size_t i = 0; i < sizeof shapes / sizeof shapes[0]; i++) {
    calibration.sigma_um = shapes[i].sigma_um;
    calibration.sigma_sd_um = shapes[i].sigma_sd_um;
    calibration.dip_share_q16 = shapes[i].dip_share_q16;
    calibration.dip_sd_um = shapes[i].dip_sd_um;
    TEST_ASSERT_EQUAL(shapes[i].valid, is_calibration());
  }
  calibration.sensors[15] = (struct sensor_calibration){NAN, NAN, 2001, 2001, 9831}; /* of no sensor */
  TEST_ASSERT_TRUE(is_calibration());
}

TEST(test_pad_profiles_are_in_their_ranges) {
  const struct pad_profile good = pad_of_12_mm();
  memset(&pad, 0xFF, sizeof pad); /* what is behind the last coefficient is none */
  memcpy(&pad, &good, offsetof(struct pad_profile, from_touch));
  pad.from_touch = 1;
  TEST_ASSERT_TRUE(is_pad());
  const struct range ranges[] = {
      {&pad.thickness_mm, PAD_THICKNESS_MIN_mm, PAD_THICKNESS_MAX_mm},
      {&pad.overhang_mm, 0.0f, PAD_OVERHANG_MAX_mm},
      {&pad.normal[0].share, PAD_SHARE_MIN, PAD_SHARE_MAX},
      {&pad.normal[0].sd_mm, PAD_SD_MIN_mm, pad.normal[1].sd_mm},
      {&pad.normal[1].share, PAD_SHARE_MIN, PAD_SHARE_MAX},
      {&pad.normal[1].sd_mm, pad.normal[0].sd_mm, PAD_SD_MAX_mm},
      {&pad.tangential[0].moment_mm, PAD_MOMENT_MIN_mm, PAD_MOMENT_MAX_mm},
      {&pad.tangential[0].sd_mm, PAD_SD_MIN_mm, pad.tangential[1].sd_mm},
      {&pad.tangential[1].moment_mm, PAD_MOMENT_MIN_mm, PAD_MOMENT_MAX_mm},
      {&pad.tangential[1].sd_mm, pad.tangential[0].sd_mm, pad.tangential[2].sd_mm},
      {&pad.tangential[2].moment_mm, PAD_MOMENT_MIN_mm, PAD_MOMENT_MAX_mm},
      {&pad.tangential[2].sd_mm, pad.tangential[1].sd_mm, PAD_SD_MAX_mm},
      {&pad.spread_mm2, 0.0f, PAD_SPREAD_MAX_mm2},
      {&pad.spread_sd_mm2, PAD_SPREAD_SD_MIN_mm2, PAD_SPREAD_SD_MAX_mm2},
      {&pad.force_ratio, PAD_FORCE_RATIO_MIN, PAD_FORCE_RATIO_MAX},
      {&pad.tangential_scale, PAD_TANGENTIAL_SCALE_MIN, PAD_TANGENTIAL_SCALE_MAX},
      {&pad.tangential_scale_sd, 0.0f, PAD_TANGENTIAL_SCALE_SD_MAX},
  };
  TEST_ASSERT_EQUAL_size_t(PAD_PROFILE_FLOATS, sizeof ranges / sizeof ranges[0] + PAD_EDGE_FLOATS);
  for (size_t i = 0; i < PAD_EDGE_FLOATS; i++) {
    float *value = (float *)(void *)&pad.edges + i;
    const float wrong[] = {-1.001f * PAD_EDGE_MAX, 1.001f * PAD_EDGE_MAX, NAN};
    for (size_t j = 0; j < 3; j++) {
      *value = wrong[j];
      TEST_ASSERT_FALSE(is_pad());
    }
    *value = i % 2 ? PAD_EDGE_MAX : -PAD_EDGE_MAX;
    TEST_ASSERT_TRUE(is_pad());
    *value = 0.0f;
  }
  assert_ranges(ranges, sizeof ranges / sizeof ranges[0], is_pad);
  for (int from_touch = 0; from_touch < 256; from_touch++) {
    pad.from_touch = (uint8_t)from_touch;
    TEST_ASSERT_EQUAL(from_touch <= 1, is_pad());
  }
}
