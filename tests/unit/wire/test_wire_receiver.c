#include "support/unit.h"
#include "wire_samples.h"

struct frame_bytes {
  uint8_t bytes[WIRE_MAX_FRAME_BYTES];
  size_t length;
};

static struct wire_receiver receiver;

void setUp(void) { wire_receiver_init(&receiver, wire_all_layouts); }
static struct frame_bytes good_frame(uint8_t type, uint16_t sequence) {
  struct sampler sampler = {SAMPLE_RANDOM, {1000u + sequence}};
  struct wire_packet packet;
  sample_packet(&sampler, type, &packet);
  packet.sequence = sequence;
  struct frame_bytes frame;
  TEST_ASSERT_EQUAL_INT(FT_OK, encode(&packet, frame.bytes, &frame.length));
  return frame;
}

/* Whether a received packet says exactly what this frame says. */
static bool is_of(const struct wire_packet *packet, const struct frame_bytes *frame) {
  struct frame_bytes again;
  return encode(packet, again.bytes, &again.length) == FT_OK && again.length == frame->length &&
         memcmp(again.bytes, frame->bytes, again.length) == 0;
}

struct tally {
  unsigned packets, errors;
  struct wire_packet last;
};

static void feed(struct tally *tally, const uint8_t *bytes, size_t length) {
  for (size_t i = 0; i < length; i++) {
    struct wire_packet packet;
    enum ft_status status = wire_receive(&receiver, bytes[i], &packet);
    if (status == FT_OK) {
      tally->packets++;
      tally->last = packet;
    } else if (status != FT_PENDING) {
      tally->errors++;
    }
    if (status != FT_PENDING) {
      TEST_ASSERT_EQUAL_HEX8(0, bytes[i]);
    }
  }
}

/* Feeds a good frame, which must come out whatever came before, provided a delimiter did. */
static void expect(const struct frame_bytes *frame) {
  struct tally tally = {0};
  feed(&tally, frame->bytes, frame->length);
  TEST_ASSERT_EQUAL_UINT(1, tally.packets);
  TEST_ASSERT_EQUAL_UINT(0, tally.errors);
  TEST_ASSERT_TRUE(is_of(&tally.last, frame));
}

TEST(test_every_type_and_empty_frames) {
  static const uint8_t fill[] = {0, 0, 0};
  for (size_t i = 0; i < WIRE_TYPES; i++) {
    struct frame_bytes frame = good_frame(wire_types[i], (uint16_t)i);
    expect(&frame);
    struct tally tally = {0};
    feed(&tally, fill, sizeof fill);
    TEST_ASSERT_EQUAL_UINT(0, tally.packets + tally.errors);
  }
}

/* The tail is missing, delimiter included: the frame and the one glued to it are lost, no more. */
TEST(test_torn_tail_at_every_position) {
  struct frame_bytes torn = good_frame(WIRE_CONTACT, 1);
  struct frame_bytes glued = good_frame(WIRE_RAW, 2);
  struct frame_bytes next = good_frame(WIRE_CONTACT, 3);
  for (size_t cut = 1; cut < torn.length - 1; cut++) {
    struct tally tally = {0};
    feed(&tally, torn.bytes, cut);
    TEST_ASSERT_EQUAL_UINT(0, tally.packets + tally.errors);
    feed(&tally, glued.bytes, glued.length);
    TEST_ASSERT_EQUAL_UINT(0, tally.packets);
    TEST_ASSERT_EQUAL_UINT(1, tally.errors);
    expect(&next);
  }
}

/* Bytes lost in the middle, any number at any place. */
TEST(test_holes_at_every_position) {
  struct frame_bytes whole = good_frame(WIRE_CONTACT, 1);
  struct frame_bytes next = good_frame(WIRE_CMD_SLIP, 2);
  for (size_t from = 0; from < whole.length - 1; from++) {
    for (size_t to = from + 1; to < whole.length - 1; to++) {
      struct tally tally = {0};
      feed(&tally, whole.bytes, from);
      feed(&tally, whole.bytes + to, whole.length - to);
      TEST_ASSERT_EQUAL_UINT(0, tally.packets);
      expect(&next);
    }
  }
}

TEST(test_every_flipped_bit) {
  for (size_t i = 0; i < WIRE_TYPES; i++) {
    struct frame_bytes frame = good_frame(wire_types[i], 1);
    struct frame_bytes second = good_frame(WIRE_CONTACT, 2);
    struct frame_bytes third = good_frame(WIRE_ACK, 3);
    for (size_t bit = 0; bit < 8 * frame.length; bit++) {
      struct frame_bytes flipped = frame;
      flipped.bytes[bit / 8] ^= (uint8_t)(1u << bit % 8);
      struct tally tally = {0};
      feed(&tally, flipped.bytes, flipped.length);
      TEST_ASSERT_EQUAL_UINT(0, tally.packets);
      if (bit / 8 == frame.length - 1) { /* the delimiter: the next frame goes with it */
        feed(&tally, second.bytes, second.length);
        TEST_ASSERT_EQUAL_UINT(0, tally.packets);
      } else {
        expect(&second);
      }
      TEST_ASSERT_GREATER_OR_EQUAL_UINT(1, tally.errors);
      expect(&third);
    }
  }
}

TEST(test_garbage_between_good_frames) {
  static const uint8_t delimiter = 0;
  struct random random = {22};
  for (int repeat = 0; repeat < 5000; repeat++) {
    struct tally tally = {0};
    uint32_t garbage = random_below(&random, 1500);
    for (uint32_t i = 0; i < garbage; i++) {
      uint8_t byte = (uint8_t)random_u32(&random);
      feed(&tally, &byte, 1);
    }
    feed(&tally, &delimiter, 1);
    TEST_ASSERT_EQUAL_UINT(0, tally.packets);
    struct frame_bytes frame = good_frame(wire_types[random_below(&random, WIRE_TYPES)], (uint16_t)repeat);
    expect(&frame);
    expect(&frame);
  }
}

TEST(test_overlong_frames) {
  static const size_t lengths[] = {WIRE_MAX_FRAME_BYTES - 1, WIRE_MAX_FRAME_BYTES,     WIRE_MAX_FRAME_BYTES + 1,
                                   WIRE_MAX_FRAME_BYTES + 2, 2 * WIRE_MAX_FRAME_BYTES, 100000};
  struct frame_bytes next = good_frame(WIRE_CONTACT, 1);
  for (size_t i = 0; i < sizeof lengths / sizeof lengths[0]; i++) {
    struct wire_packet packet;
    for (size_t at = 0; at < lengths[i]; at++) {
      TEST_ASSERT_EQUAL_INT(FT_PENDING, wire_receive(&receiver, 0x11, &packet));
    }
    enum ft_status status = wire_receive(&receiver, 0, &packet);
    TEST_ASSERT_EQUAL_INT(lengths[i] > WIRE_MAX_FRAME_BYTES ? FT_ERR_SPACE : FT_ERR_FORMAT, status);
    expect(&next);
  }
  /* A good frame directly after too many bytes is lost with them. */
  struct tally tally = {0};
  for (size_t at = 0; at <= WIRE_MAX_FRAME_BYTES; at++) {
    feed(&tally, &(uint8_t){0x11}, 1);
  }
  feed(&tally, next.bytes, next.length);
  TEST_ASSERT_EQUAL_UINT(0, tally.packets);
  TEST_ASSERT_EQUAL_UINT(1, tally.errors);
  expect(&next);
}
