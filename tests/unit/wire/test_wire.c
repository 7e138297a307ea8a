#include "wire_samples.h"

#include <stdbool.h>
#include <unity.h>

void setUp(void) {}
void tearDown(void) {}

/* Body length by PROTOCOL.md, n being the number of sensors. */
static size_t body_length(uint8_t type, uint8_t n) {
  switch (type) {
  case WIRE_CONTACT:
    return 62;
  case WIRE_RAW:
    return 15 + 8u * n;
  case WIRE_INFO:
    return 92 + 8u * n;
  case WIRE_HEALTH:
    return 68;
  case WIRE_ACK:
    return 12;
  case WIRE_CMD_STREAM:
    return 1;
  case WIRE_CMD_RATE:
  case WIRE_CMD_LOADER:
    return 4;
  case WIRE_CMD_OSR:
    return 2;
  case WIRE_CMD_SLIP:
    return 6;
  default:
    return 0;
  }
}

static uint8_t sensors_of(const struct wire_packet *packet) {
  return packet->type == WIRE_RAW    ? packet->body.raw.sensor_count
         : packet->type == WIRE_INFO ? packet->body.info.sensor_count
                                     : 0;
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
  enum ft_status status = wire_decode(frame, seal(bytes, length, frame), packet);
  if (status != FT_OK && status != FT_ERR_TYPE) {
    struct wire_packet before = untouched();
    TEST_ASSERT_EQUAL_MEMORY(&before, packet, sizeof before);
  }
  return status;
}

static void test_round_trip_of_every_type(void) {
  for (int kind = 0; kind < SAMPLE_KINDS; kind++) {
    struct sampler sampler = {(enum sample_kind)kind, {11}};
    for (size_t i = 0; i < WIRE_TYPES; i++) {
      for (int repeat = 0; repeat < (kind == SAMPLE_RANDOM ? 500 : 1); repeat++) {
        struct wire_packet packet;
        sample_packet(&sampler, wire_types[i], &packet);
        uint8_t frame[WIRE_MAX_FRAME_BYTES];
        size_t length = 0;
        TEST_ASSERT_EQUAL_INT(FT_OK, wire_encode(&packet, frame, sizeof frame, &length));
        TEST_ASSERT_NULL(memchr(frame, 0, length - 1));
        TEST_ASSERT_EQUAL_HEX8(0, frame[length - 1]);

        uint8_t bytes[WIRE_MAX_PACKET_BYTES];
        size_t used = unseal(frame, length - 1, bytes);
        TEST_ASSERT_EQUAL_size_t(12 + body_length(packet.type, sensors_of(&packet)), used);
        uint8_t again[WIRE_MAX_FRAME_BYTES];
        TEST_ASSERT_EQUAL_size_t(length - 1, seal(bytes, used, again));
        TEST_ASSERT_EQUAL_MEMORY(frame, again, length - 1);

        struct wire_packet decoded = untouched();
        TEST_ASSERT_EQUAL_INT(FT_OK, wire_decode(frame, length - 1, &decoded));
        TEST_ASSERT_EQUAL_MEMORY(&packet, &decoded, sizeof packet);
      }
    }
  }
}

static void test_encode_wants_room(void) {
  struct sampler sampler = {SAMPLE_RANDOM, {12}};
  for (size_t i = 0; i < WIRE_TYPES; i++) {
    struct wire_packet packet;
    sample_packet(&sampler, wire_types[i], &packet);
    uint8_t frame[WIRE_MAX_FRAME_BYTES + 1];
    size_t length = 0;
    TEST_ASSERT_EQUAL_INT(FT_OK, wire_encode(&packet, frame, WIRE_MAX_FRAME_BYTES, &length));
    for (size_t capacity = 0; capacity <= WIRE_MAX_FRAME_BYTES; capacity++) {
      size_t got = 12345;
      memset(frame, 0xEE, sizeof frame);
      enum ft_status status = wire_encode(&packet, frame, capacity, &got);
      if (status == FT_OK) {
        TEST_ASSERT_EQUAL_size_t(length, got);
        TEST_ASSERT_LESS_OR_EQUAL_size_t(capacity, got);
      } else {
        TEST_ASSERT_EQUAL_INT(FT_ERR_SPACE, status);
        TEST_ASSERT_EQUAL_size_t(12345, got);
        TEST_ASSERT_LESS_THAN_size_t(length + 2, capacity); /* at most one byte too careful */
        TEST_ASSERT_EACH_EQUAL_HEX8(0xEE, frame, sizeof frame);
      }
    }
  }
}

static void assert_float_guarded(uint8_t type, size_t body_offset, float *field,
                                 struct wire_packet *packet) {
  static const uint32_t refused[] = {0x7F800000, 0xFF800000, 0x7FC00000, 0x7F800001, 0xFFFFFFFF};
  uint8_t frame[WIRE_MAX_FRAME_BYTES];
  size_t length = 0;
  *field = 1.0f;
  TEST_ASSERT_EQUAL_INT(FT_OK, wire_encode(packet, frame, sizeof frame, &length));
  uint8_t bytes[WIRE_MAX_PACKET_BYTES];
  size_t used = unseal(frame, length - 1, bytes);
  TEST_ASSERT_EQUAL_HEX8(type, bytes[1]);
  TEST_ASSERT_EQUAL_HEX32(0x3F800000, bytes_get_u32(bytes + 12 + body_offset));
  for (size_t i = 0; i < sizeof refused / sizeof refused[0]; i++) {
    memcpy(field, &refused[i], sizeof *field);
    TEST_ASSERT_EQUAL_INT(FT_ERR_ARGUMENT, wire_encode(packet, frame, sizeof frame, &length));
    bytes_put_u32(bytes + 12 + body_offset, refused[i]);
    struct wire_packet decoded;
    TEST_ASSERT_EQUAL_INT(FT_ERR_FORMAT, decode_sealed(bytes, used, &decoded));
  }
  *field = 0.0f;
}

static void test_infinity_and_nan_are_refused_both_ways(void) {
  struct sampler sampler = {SAMPLE_GREATEST, {13}};
  struct wire_packet packet;
  sample_packet(&sampler, WIRE_CONTACT, &packet);
  struct wire_contact *contact = &packet.body.contact;
  float *fields[] = {
      &contact->x_mm,      &contact->y_mm,    &contact->p0_Pa,           &contact->sigma_mm,
      &contact->force_N,   &contact->slip_mm, &contact->residual_rms_Pa, &contact->location_sd_mm,
      &contact->force_sd_N};
  for (size_t i = 0; i < 9; i++) {
    assert_float_guarded(WIRE_CONTACT, 12 + 4 * i, fields[i], &packet);
  }
  sample_packet(&sampler, WIRE_INFO, &packet);
  assert_float_guarded(WIRE_INFO, 84, &packet.body.info.slip_threshold_mm, &packet);
  assert_float_guarded(WIRE_INFO, 88, &packet.body.info.pitch_mm, &packet);
  for (size_t k = 0; k < FT_MAX_SENSORS; k++) {
    assert_float_guarded(WIRE_INFO, 92 + 8 * k, &packet.body.info.x_mm[k], &packet);
    assert_float_guarded(WIRE_INFO, 96 + 8 * k, &packet.body.info.y_mm[k], &packet);
  }
  sample_packet(&sampler, WIRE_CMD_SLIP, &packet);
  assert_float_guarded(WIRE_CMD_SLIP, 0, &packet.body.cmd_slip.threshold_mm, &packet);
}

static void test_sensor_counts_outside_their_range_are_refused_both_ways(void) {
  static const struct {
    uint8_t type;
    size_t offset;
  } cases[] = {{WIRE_RAW, 14}, {WIRE_INFO, 3}};
  for (int i = 0; i < 2; i++) {
    for (int count = 0; count < 256; count++) {
      struct wire_packet packet;
      memset(&packet, 0, sizeof packet);
      packet.type = cases[i].type;
      *(packet.type == WIRE_RAW ? &packet.body.raw.sensor_count : &packet.body.info.sensor_count) =
          (uint8_t)count;
      bool legal = count >= 1 && count <= 32;
      uint8_t frame[WIRE_MAX_FRAME_BYTES];
      size_t length;
      TEST_ASSERT_EQUAL_INT(legal ? FT_OK : FT_ERR_ARGUMENT,
                            wire_encode(&packet, frame, sizeof frame, &length));
      uint8_t bytes[WIRE_MAX_PACKET_BYTES + 2048] = {WIRE_VERSION, packet.type};
      bytes[12 + cases[i].offset] = (uint8_t)count;
      struct wire_packet decoded;
      uint8_t n = count > 40 ? 32 : (uint8_t)count;
      TEST_ASSERT_EQUAL_INT(legal ? FT_OK : FT_ERR_FORMAT,
                            decode_sealed(bytes, 12 + body_length(packet.type, n), &decoded));
    }
  }
}

static void test_text_is_printable(void) {
  static const size_t offsets[] = {4, 20, 36, 52};
  for (int text = 0; text < 4; text++) {
    for (int value = 0; value < 256; value++) {
      struct wire_packet packet;
      memset(&packet, 0, sizeof packet);
      packet.type = WIRE_INFO;
      packet.body.info.sensor_count = 1;
      char *texts[] = {packet.body.info.git_hash, packet.body.info.board, packet.body.info.scene,
                       packet.body.info.serial};
      texts[text][0] = (char)(uint8_t)value;
      bool legal = value == 0 || (value >= 0x20 && value <= 0x7E);
      uint8_t frame[WIRE_MAX_FRAME_BYTES];
      size_t length;
      TEST_ASSERT_EQUAL_INT(legal ? FT_OK : FT_ERR_ARGUMENT,
                            wire_encode(&packet, frame, sizeof frame, &length));
      uint8_t bytes[WIRE_MAX_PACKET_BYTES] = {WIRE_VERSION, WIRE_INFO};
      bytes[12 + 3] = 1;
      bytes[12 + offsets[text]] = (uint8_t)value;
      struct wire_packet decoded;
      TEST_ASSERT_EQUAL_INT(legal ? FT_OK : FT_ERR_FORMAT,
                            decode_sealed(bytes, 12 + 92 + 8, &decoded));
    }
  }
}

static void test_wrong_lengths_are_refused(void) {
  struct sampler sampler = {SAMPLE_RANDOM, {14}};
  for (size_t i = 0; i < WIRE_TYPES; i++) {
    struct wire_packet packet;
    sample_packet(&sampler, wire_types[i], &packet);
    uint8_t frame[WIRE_MAX_FRAME_BYTES];
    size_t length = 0;
    TEST_ASSERT_EQUAL_INT(FT_OK, wire_encode(&packet, frame, sizeof frame, &length));
    uint8_t original[2 * WIRE_MAX_PACKET_BYTES] = {0};
    size_t right = unseal(frame, length - 1, original);
    memset(original + right, 0, 8);
    for (size_t used = 0; used <= right + 8; used++) {
      uint8_t bytes[sizeof original];
      memcpy(bytes, original, sizeof bytes);
      struct wire_packet decoded;
      TEST_ASSERT_EQUAL_INT(used == right ? FT_OK : FT_ERR_FORMAT,
                            decode_sealed(bytes, used, &decoded));
    }
  }
}

static void test_unknown_types_keep_their_header(void) {
  struct random random = {15};
  for (int type = 0; type < 256; type++) {
    bool known = memchr(wire_types, type, sizeof wire_types) != NULL;
    struct wire_packet packet;
    memset(&packet, 0, sizeof packet);
    packet.type = (uint8_t)type;
    if (!known) {
      uint8_t frame[WIRE_MAX_FRAME_BYTES];
      size_t length;
      TEST_ASSERT_EQUAL_INT(FT_ERR_ARGUMENT, wire_encode(&packet, frame, sizeof frame, &length));
    }
    for (size_t body = 0; body <= WIRE_MAX_BODY_BYTES; body += 50) {
      uint8_t bytes[WIRE_MAX_PACKET_BYTES] = {
          WIRE_VERSION, (uint8_t)type, 0x34, 0x12, 1, 2, 3, 4, 5, 6, 7, 8};
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

static void test_other_versions_are_told_from_damage(void) {
  for (int version = 0; version < 256; version++) {
    uint8_t bytes[32] = {(uint8_t)version, WIRE_CMD_TARE};
    struct wire_packet decoded;
    TEST_ASSERT_EQUAL_INT(version == WIRE_VERSION ? FT_OK : FT_ERR_VERSION,
                          decode_sealed(bytes, 12, &decoded));
    bytes[12] ^= 1; /* of the CRC that is there by now */
    uint8_t frame[40];
    TEST_ASSERT_EQUAL_INT(FT_ERR_CRC,
                          wire_decode(frame, reference_cobs(bytes, 16, frame), &decoded));
  }
}

static void test_bytes_that_are_not_cobs_are_refused(void) {
  struct wire_packet packet;
  uint8_t empty[1] = {1};
  TEST_ASSERT_EQUAL_INT(FT_ERR_FORMAT, wire_decode(empty, 0, &packet));
  TEST_ASSERT_EQUAL_INT(FT_ERR_FORMAT, wire_decode(empty, 1, &packet));
  for (int code = 0; code < 256; code++) { /* a code that reaches beyond the end, or is 0 */
    uint8_t frame[255];
    memset(frame, 0x11, sizeof frame);
    frame[0] = (uint8_t)code;
    size_t reach = code == 0 ? 20 : (size_t)code - 1;
    TEST_ASSERT_EQUAL_INT(FT_ERR_FORMAT, wire_decode(frame, reach, &packet));
  }
  uint8_t inner_zero[20] = {20, 1, 1, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1};
  TEST_ASSERT_EQUAL_INT(FT_ERR_FORMAT, wire_decode(inner_zero, 20, &packet));
}

/* Runs without a zero of 250 to 271 bytes, so around the 254 at which a block is full, ended by a
 * zero or by the end of the packet, where the CRC's own bytes decide. */
static void test_cobs_blocks_at_their_limit(void) {
  unsigned full_at_end = 0;
  for (size_t run = 1; run <= 271; run++) {
    for (uint16_t sequence = 0; sequence < 300; sequence++) {
      struct wire_packet packet;
      memset(&packet, 0, sizeof packet);
      packet.type = WIRE_RAW;
      packet.sequence = sequence;
      struct wire_raw *raw = &packet.body.raw;
      raw->frame = raw->valid = raw->saturated = 0x01010101;
      raw->temperature_cC = 0x0101;
      raw->sensor_count = 32;
      for (size_t k = 0; k < 32; k++) {
        raw->pressure_Pa_q10[k] = raw->baseline_Pa_q10[k] = 0x01010101;
      }
      /* Byte 12 + run of the packet becomes 0: the run begins after the time's last byte. */
      size_t zero_at = run;
      if (zero_at >= 15 && zero_at < 271) {
        size_t value = (zero_at - 15) / 4;
        int32_t *at = value % 2 ? raw->baseline_Pa_q10 : raw->pressure_Pa_q10;
        at[value / 2] &= (int32_t) ~(0xFFu << 8 * ((zero_at - 15) % 4));
      }
      uint8_t frame[WIRE_MAX_FRAME_BYTES];
      size_t length = 0;
      TEST_ASSERT_EQUAL_INT(FT_OK, wire_encode(&packet, frame, sizeof frame, &length));
      uint8_t bytes[WIRE_MAX_PACKET_BYTES];
      size_t used = unseal(frame, length - 1, bytes);
      TEST_ASSERT_EQUAL_size_t(12 + 271, used);
      uint8_t expected[WIRE_MAX_FRAME_BYTES];
      TEST_ASSERT_EQUAL_size_t(length - 1, seal(bytes, used, expected));
      TEST_ASSERT_EQUAL_MEMORY(expected, frame, length - 1);
      if (zero_at >= 15 && zero_at < 271) {
        TEST_ASSERT_EQUAL_HEX8(0, bytes[12 + zero_at]);
      }
      /* 12 + 271 + 4 = 287 bytes: with the zero at 32 the last run of 254 ends the packet. */
      full_at_end += length >= 256 && frame[length - 256] == 0xFF && zero_at == 20;
      struct wire_packet decoded;
      TEST_ASSERT_EQUAL_INT(FT_OK, wire_decode(frame, length - 1, &decoded));
      TEST_ASSERT_EQUAL_MEMORY(&packet, &decoded, sizeof packet);
    }
  }
  TEST_ASSERT_GREATER_THAN_UINT(250, full_at_end);
}

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(test_round_trip_of_every_type);
  RUN_TEST(test_encode_wants_room);
  RUN_TEST(test_infinity_and_nan_are_refused_both_ways);
  RUN_TEST(test_sensor_counts_outside_their_range_are_refused_both_ways);
  RUN_TEST(test_text_is_printable);
  RUN_TEST(test_wrong_lengths_are_refused);
  RUN_TEST(test_unknown_types_keep_their_header);
  RUN_TEST(test_other_versions_are_told_from_damage);
  RUN_TEST(test_bytes_that_are_not_cobs_are_refused);
  RUN_TEST(test_cobs_blocks_at_their_limit);
  return UNITY_END();
}
