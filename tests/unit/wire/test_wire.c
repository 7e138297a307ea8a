#include "support/unit.h"
#include "wire_samples.h"

/* Body length by PROTOCOL.md. */
static size_t body_length(const struct wire_packet *packet) {
  static const struct {
    uint32_t flag;
    uint8_t length;
  } of_flags[] = {{CONTACT_FLAG_FIT_VALID, 28},    {CONTACT_FLAG_UNCERTAINTY_VALID, 8}, {CONTACT_FLAG_SLIP_VALID, 4},
                  {CONTACT_FLAG_WIDTHS_VALID, 12}, {CONTACT_FLAG_TANGENTIAL_VALID, 16}, {CONTACT_FLAG_VELOCITY_VALID, 8},
                  {CONTACT_FLAG_SHAPE_VALID, 4},   {CONTACT_FLAG_TWO_CONTACTS, 40},     {CONTACT_FLAG_EDGE, 12}};
  static const uint8_t fixed[256] = {
      [WIRE_ACK] = 12,      [WIRE_CRASH] = 97,    [WIRE_SYNC] = 5,     [WIRE_CMD_STREAM] = 1, [WIRE_CMD_TARE] = 1,
      [WIRE_CMD_KEEP] = 1,  [WIRE_CMD_SYNC] = 1,  [WIRE_CMD_RATE] = 4, [WIRE_CMD_LOADER] = 4, [WIRE_CMD_LOCATION_LIMIT] = 4,
      [WIRE_CMD_PRIOR] = 8, [WIRE_CMD_PAD] = 177, [WIRE_CMD_OSR] = 2,  [WIRE_CMD_SLIP] = 6};
  const struct wire_info *info = &packet->body.info;
  size_t length = 22;
  switch (packet->type) {
  case WIRE_CONTACT:
    for (size_t i = 0; i < sizeof of_flags / sizeof of_flags[0]; i++) {
      length += packet->body.contact.flags & of_flags[i].flag ? of_flags[i].length : 0u;
    }
    return length;
  case WIRE_RAW: return 23 + 8u * packet->body.raw.sensor_count;
  case WIRE_INFO:
    return 93u + (info->capabilities & WIRE_CAPABILITY_FIT ? 13 : 0) + (info->capabilities & WIRE_CAPABILITY_SLIP ? 6 : 0) +
           (info->capabilities & WIRE_CAPABILITY_SYNC ? 1 : 0) + 8u * info->sensor_count +
           (info->stored & WIRE_STORED_CALIBRATION ? 23 + 14u * info->sensor_count : 0) + (info->stored & WIRE_STORED_PAD ? 177 : 0);
  case WIRE_HEALTH: return 72u + (packet->body.health.capabilities & WIRE_CAPABILITY_FIT ? 4 : 0);
  case WIRE_CMD_CALIBRATE: return 24 + 14u * packet->body.cmd_calibrate.sensor_count;
  default: return fixed[packet->type];
  }
}

static struct wire_packet untouched(void) {
  struct wire_packet packet;
  memset(&packet, 0x5A, sizeof packet);
  return packet;
}

/* Decodes bytes that have no CRC yet; a refusal must leave the packet alone. */
static enum ft_status decode_sealed(uint8_t *bytes, size_t length, struct wire_packet *packet) {
  uint8_t frame[2 * WIRE_MAX_FRAME_BYTES];
  *packet = untouched();
  enum ft_status status = wire_decode(wire_all_layouts, frame, seal(bytes, length, frame), packet);
  if (status != FT_OK && status != FT_ERR_TYPE) {
    struct wire_packet before = untouched();
    TEST_ASSERT_EQUAL_MEMORY(&before, packet, sizeof before);
  }
  return status;
}

TEST(test_round_trip_of_every_type) {
  for (int kind = 0; kind < SAMPLE_KINDS; kind++) {
    struct sampler sampler = {(enum sample_kind)kind, {11}};
    for (size_t i = 0; i < WIRE_TYPES; i++) {
      for (int repeat = 0; repeat < (kind == SAMPLE_RANDOM ? 500 : 1); repeat++) {
        struct wire_packet packet;
        sample_packet(&sampler, wire_types[i], &packet);
        uint8_t frame[WIRE_MAX_FRAME_BYTES];
        size_t length = 0;
        TEST_ASSERT_EQUAL_INT(FT_OK, encode(&packet, frame, &length));
        TEST_ASSERT_NULL(memchr(frame, 0, length - 1));
        TEST_ASSERT_EQUAL_HEX8(0, frame[length - 1]);

        uint8_t bytes[WIRE_MAX_PACKET_BYTES];
        size_t used = unseal(frame, length - 1, bytes);
        TEST_ASSERT_EQUAL_size_t(12 + body_length(&packet), used);
        uint8_t again[WIRE_MAX_FRAME_BYTES];
        TEST_ASSERT_EQUAL_size_t(length - 1, seal(bytes, used, again));
        TEST_ASSERT_EQUAL_MEMORY(frame, again, length - 1);

        struct wire_packet decoded = untouched();
        TEST_ASSERT_EQUAL_INT(FT_OK, wire_decode(wire_all_layouts, frame, length - 1, &decoded));
        TEST_ASSERT_EQUAL_MEMORY(&packet, &decoded, sizeof packet);
      }
    }
  }
}

/* What a device decodes: its commands, and nothing that itself sends. */
TEST(test_sets_of_commands) {
  static const struct {
    const struct wire_layout *layouts[20];
    uint8_t types[8]; /* of a capability; none: those of no capability */
  } sets[] = {{{WIRE_COMMANDS_OF_FIT}, {WIRE_CMD_CALIBRATE, WIRE_CMD_ERASE_CALIBRATION, WIRE_CMD_PRIOR, WIRE_CMD_LOCATION_LIMIT}},
              {{WIRE_COMMANDS_OF_SLIP}, {WIRE_CMD_SLIP}},
              {{WIRE_COMMANDS_OF_TANGENTIAL}, {WIRE_CMD_PAD, WIRE_CMD_ERASE_PAD}},
              {{WIRE_COMMANDS_OF_SYNC}, {WIRE_CMD_SYNC}},
              {{WIRE_COMMANDS}, {0}}};
  const struct wire_layout *const *of_fit = sets[0].layouts;
  for (size_t i = 0; i < WIRE_TYPES; i++) {
    const uint8_t type = wire_types[i];
    bool left = type >= 0x80;
    TEST_ASSERT_NOT_NULL(wire_find_layout(wire_all_layouts, type));
    TEST_ASSERT_EQUAL(left, wire_find_layout(wire_commands, type) != NULL);
    for (size_t k = 0; k < sizeof sets / sizeof sets[0]; k++) {
      const bool in_set = sets[k].types[0] ? memchr(sets[k].types, type, sizeof sets[k].types) != NULL : left;
      TEST_ASSERT_EQUAL(in_set, wire_find_layout(sets[k].layouts, type) != NULL);
      left = left && !in_set;
    }
  }
  struct sampler sampler = {SAMPLE_RANDOM, {12}};
  struct wire_packet packet, decoded;
  sample_packet(&sampler, WIRE_CMD_SLIP, &packet);
  uint8_t frame[WIRE_MAX_FRAME_BYTES];
  size_t length = 0;
  TEST_ASSERT_EQUAL_INT(FT_OK, encode(&packet, frame, &length));
  TEST_ASSERT_EQUAL_INT(FT_ERR_TYPE, wire_decode(of_fit, frame, length - 1, &decoded));
  TEST_ASSERT_EQUAL_HEX8(WIRE_CMD_SLIP, decoded.type);
  TEST_ASSERT_EQUAL_UINT16(packet.sequence, decoded.sequence);
}

static void assert_float_guarded(uint8_t type, size_t body_offset, float *field, struct wire_packet *packet) {
  static const uint32_t refused[] = {0x7F800000, 0xFF800000, 0x7FC00000, 0x7F800001, 0xFFFFFFFF};
  uint8_t frame[WIRE_MAX_FRAME_BYTES];
  size_t length = 0;
  *field = 1.0f;
  TEST_ASSERT_EQUAL_INT(FT_OK, encode(packet, frame, &length));
  uint8_t bytes[WIRE_MAX_PACKET_BYTES];
  size_t used = unseal(frame, length - 1, bytes);
  TEST_ASSERT_EQUAL_HEX8(type, bytes[1]);
  TEST_ASSERT_EQUAL_HEX32(0x3F800000, bytes_get_u32(bytes + 12 + body_offset));
  for (size_t i = 0; i < sizeof refused / sizeof refused[0]; i++) {
    memcpy(field, &refused[i], sizeof *field);
    TEST_ASSERT_EQUAL_INT(FT_ERR_ARGUMENT, encode(packet, frame, &length));
    bytes_put_u32(bytes + 12 + body_offset, refused[i]);
    struct wire_packet decoded;
    TEST_ASSERT_EQUAL_INT(FT_ERR_FORMAT, decode_sealed(bytes, used, &decoded));
  }
  *field = 0.0f;
}

/* PROTOCOL.md says how long a frame may be. */
TEST(test_the_longest_frame_is_as_documented) {
  TEST_ASSERT_EQUAL(1127, WIRE_MAX_FRAME_BYTES);
  struct sampler sampler = {SAMPLE_GREATEST, {16}};
  struct wire_packet packet;
  sample_packet(&sampler, WIRE_INFO, &packet);
  packet.body.info.sensor_count = FT_MAX_SENSORS;
  TEST_ASSERT_EQUAL_size_t(WIRE_MAX_BODY_BYTES, body_length(&packet));
}

TEST(test_infinity_and_nan_are_refused_both_ways) {
  unsigned floats = 0;
  for (size_t i = 0; i < WIRE_TYPES; i++) {
    struct sampler sampler = {SAMPLE_GREATEST, {13}};
    struct wire_packet packet;
    sample_packet(&sampler, wire_types[i], &packet);
    struct walk walk = walk_begin(&packet);
    for (struct value value; walk_on(&walk, &value);) {
      if (value.kind == F32) {
        assert_float_guarded(packet.type, value.offset, (float *)(void *)value.field, &packet);
        floats++;
      }
    }
  }
  TEST_ASSERT_GREATER_THAN_UINT(32 + 2 * (2 + 2 * WIRE_SENSORS_OF_WORD + PAD_PROFILE_FLOATS), floats);
}

/* A packet that is 0 but for this byte at this place of its body. */
static void assert_byte_guarded(bool legal, const struct wire_packet *packet, size_t offset, uint8_t value, size_t body) {
  uint8_t frame[WIRE_MAX_FRAME_BYTES];
  size_t length;
  TEST_ASSERT_EQUAL_INT(legal ? FT_OK : FT_ERR_ARGUMENT, encode(packet, frame, &length));
  uint8_t bytes[WIRE_MAX_PACKET_BYTES + 2048] = {WIRE_VERSION, packet->type};
  bytes[12 + 3] = packet->type == WIRE_INFO;
  bytes[12 + offset] = value;
  struct wire_packet decoded;
  TEST_ASSERT_EQUAL_INT(legal ? FT_OK : FT_ERR_FORMAT, decode_sealed(bytes, 12 + body, &decoded));
}

TEST(test_sensor_counts_outside_their_range_are_refused_both_ways) {
  struct wire_packet packet;
  const struct {
    uint8_t type, *sensor_count;
    size_t offset;
  } cases[] = {{WIRE_RAW, &packet.body.raw.sensor_count, 22},
               {WIRE_INFO, &packet.body.info.sensor_count, 3},
               {WIRE_CMD_CALIBRATE, &packet.body.cmd_calibrate.sensor_count, 0}};
  for (int i = 0; i < 3; i++) {
    for (int count = 0; count < 256; count++) {
      memset(&packet, 0, sizeof packet);
      packet.type = cases[i].type;
      *cases[i].sensor_count = (uint8_t)(count > 40 ? 32 : count);
      const size_t body = body_length(&packet);
      *cases[i].sensor_count = (uint8_t)count;
      assert_byte_guarded(count >= 1 && count <= FT_MAX_SENSORS, &packet, cases[i].offset, (uint8_t)count, body);
    }
  }
}

TEST(test_text_is_printable) {
  static const size_t offsets[] = {8, 24, 40, 56};
  for (int text = 0; text < 4; text++) {
    for (int value = 0; value < 256; value++) {
      struct wire_packet packet = {.type = WIRE_INFO, .body.info.sensor_count = 1};
      char *texts[] = {packet.body.info.git_hash, packet.body.info.board, packet.body.info.scene, packet.body.info.serial};
      texts[text][0] = (char)(uint8_t)value;
      const bool legal = value == 0 || (value >= 0x20 && value <= 0x7E);
      assert_byte_guarded(legal, &packet, offsets[text], (uint8_t)value, 93 + 8);
    }
  }
}

TEST(test_wrong_lengths_are_refused) {
  struct sampler sampler = {SAMPLE_RANDOM, {14}};
  for (size_t i = 0; i < WIRE_TYPES; i++) {
    struct wire_packet packet;
    sample_packet(&sampler, wire_types[i], &packet);
    uint8_t frame[WIRE_MAX_FRAME_BYTES];
    size_t length = 0;
    TEST_ASSERT_EQUAL_INT(FT_OK, encode(&packet, frame, &length));
    uint8_t original[2 * WIRE_MAX_PACKET_BYTES] = {0};
    size_t right = unseal(frame, length - 1, original);
    memset(original + right, 0, 8);
    for (size_t used = 0; used <= right + 8; used++) {
      uint8_t bytes[sizeof original];
      memcpy(bytes, original, sizeof bytes);
      struct wire_packet decoded;
      TEST_ASSERT_EQUAL_INT(used == right ? FT_OK : FT_ERR_FORMAT, decode_sealed(bytes, used, &decoded));
    }
  }
}

TEST(test_unknown_types_keep_their_header) {
  struct random random = {15};
  for (int type = 0; type < 256; type++) {
    bool known = memchr(wire_types, type, sizeof wire_types) != NULL;
    struct wire_packet packet;
    memset(&packet, 0, sizeof packet);
    packet.type = (uint8_t)type;
    if (!known) {
      uint8_t frame[WIRE_MAX_FRAME_BYTES];
      size_t length;
      TEST_ASSERT_EQUAL_INT(FT_ERR_ARGUMENT, encode(&packet, frame, &length));
    }
    for (size_t body = 0; body <= WIRE_MAX_BODY_BYTES; body += 50) {
      uint8_t bytes[WIRE_MAX_PACKET_BYTES] = {WIRE_VERSION, (uint8_t)type, 0x34, 0x12, 1, 2, 3, 4, 5, 6, 7, 8};
      for (size_t i = 0; i < body; i++) {
        bytes[12 + i] = (uint8_t)random_u32(&random);
      }
      struct wire_packet decoded;
      enum ft_status status = decode_sealed(bytes, 12 + body, &decoded);
      if (known) {
        TEST_ASSERT_NOT_EQUAL_INT(FT_ERR_TYPE, status);
        continue;
      }
      TEST_ASSERT_EQUAL_INT(FT_ERR_TYPE, status);
      TEST_ASSERT_EQUAL_HEX8(type, decoded.type);
      TEST_ASSERT_EQUAL_HEX16(0x1234, decoded.sequence);
      TEST_ASSERT_EQUAL_HEX64(UINT64_C(0x0807060504030201), decoded.t_us);
    }
  }
}

TEST(test_other_versions_are_told_from_damage) {
  for (int version = 0; version < 256; version++) {
    uint8_t bytes[32] = {(uint8_t)version, WIRE_CMD_INFO};
    struct wire_packet decoded;
    TEST_ASSERT_EQUAL_INT((version & ~WIRE_WIDE) == WIRE_VERSION ? FT_OK : FT_ERR_VERSION, decode_sealed(bytes, 12, &decoded));
    bytes[12] ^= 1; /* of the CRC that is there by now */
    uint8_t frame[40];
    TEST_ASSERT_EQUAL_INT(FT_ERR_CRC, wire_decode(wire_all_layouts, frame, reference_cobs(bytes, 16, frame), &decoded));
  }
}

TEST(test_bytes_that_are_not_cobs_are_refused) {
  struct wire_packet packet;
  uint8_t empty[1] = {1};
  TEST_ASSERT_EQUAL_INT(FT_ERR_FORMAT, wire_decode(wire_all_layouts, empty, 0, &packet));
  TEST_ASSERT_EQUAL_INT(FT_ERR_FORMAT, wire_decode(wire_all_layouts, empty, 1, &packet));
  for (int code = 0; code < 256; code++) { /* a code that reaches beyond the end, or is 0 */
    uint8_t frame[255];
    memset(frame, 0x11, sizeof frame);
    frame[0] = (uint8_t)code;
    size_t reach = code == 0 ? 20 : (size_t)code - 1;
    TEST_ASSERT_EQUAL_INT(FT_ERR_FORMAT, wire_decode(wire_all_layouts, frame, reach, &packet));
  }
  uint8_t inner_zero[20] = {20, 1, 1, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1};
  TEST_ASSERT_EQUAL_INT(FT_ERR_FORMAT, wire_decode(wire_all_layouts, inner_zero, 20, &packet));
}

/* Runs without a zero of 250 to 279 bytes, so around the 254 at which a block is full, ended by a
 * zero or by the end of the packet, where the CRC's own bytes decide. */
TEST(test_cobs_blocks_at_their_limit) {
  unsigned full_at_end = 0;
  for (size_t run = 1; run <= 279; run++) {
    for (uint16_t sequence = 0; sequence < 300; sequence++) {
      struct wire_packet packet;
      memset(&packet, 0, sizeof packet);
      packet.type = WIRE_RAW;
      packet.sequence = sequence;
      struct wire_raw *raw = &packet.body.raw;
      raw->frame = raw->flags = 0x01010101;
      raw->valid = raw->saturated = raw->doubtful = 0x01010101;
      raw->temperature_cC = 0x0101;
      raw->sensor_count = 32;
      for (size_t k = 0; k < 32; k++) {
        raw->pressure_Pa_q10[k] = raw->baseline_Pa_q10[k] = 0x01010101;
      }
      /* Byte 12 + run of the packet becomes 0: the run begins after the time's last byte. */
      size_t zero_at = run;
      if (zero_at >= 23 && zero_at < 279) {
        size_t value = (zero_at - 23) / 4;
        int32_t *at = value % 2 ? raw->baseline_Pa_q10 : raw->pressure_Pa_q10;
        at[value / 2] &= (int32_t) ~(0xFFu << 8 * ((zero_at - 23) % 4));
      }
      uint8_t frame[WIRE_MAX_FRAME_BYTES];
      size_t length = 0;
      TEST_ASSERT_EQUAL_INT(FT_OK, encode(&packet, frame, &length));
      uint8_t bytes[WIRE_MAX_PACKET_BYTES];
      size_t used = unseal(frame, length - 1, bytes);
      TEST_ASSERT_EQUAL_size_t(12 + 279, used);
      uint8_t expected[WIRE_MAX_FRAME_BYTES];
      TEST_ASSERT_EQUAL_size_t(length - 1, seal(bytes, used, expected));
      TEST_ASSERT_EQUAL_MEMORY(expected, frame, length - 1);
      if (zero_at >= 23 && zero_at < 279) {
        TEST_ASSERT_EQUAL_HEX8(0, bytes[12 + zero_at]);
      }
      /* 12 + 279 + 4 = 295 bytes: with the zero at 40 the last run of 254 ends the packet. */
      full_at_end += length >= 256 && frame[length - 256] == 0xFF && zero_at == 28;
      struct wire_packet decoded;
      TEST_ASSERT_EQUAL_INT(FT_OK, wire_decode(wire_all_layouts, frame, length - 1, &decoded));
      TEST_ASSERT_EQUAL_MEMORY(&packet, &decoded, sizeof packet);
    }
  }
  TEST_ASSERT_GREATER_THAN_UINT(250, full_at_end);
}
