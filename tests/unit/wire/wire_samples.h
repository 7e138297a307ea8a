/* Packets of every type for the tests, and a second COBS encoder, written from the paper. */
#pragma once

#include "common/bytes.h"
#include "common/contact_flags.h"
#include "common/crc32.h"
#include "support/random.h"
#include "wire/packet.h"

#include <float.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

static const uint8_t wire_types[] = {WIRE_CONTACT,    WIRE_RAW,           WIRE_INFO,
                                     WIRE_HEALTH,     WIRE_ACK,           WIRE_CMD_STREAM,
                                     WIRE_CMD_TARE,   WIRE_CMD_RATE,      WIRE_CMD_OSR,
                                     WIRE_CMD_SLIP,   WIRE_CMD_INFO,      WIRE_CMD_HEALTH,
                                     WIRE_CMD_LOADER, WIRE_CMD_CALIBRATE, WIRE_CMD_ERASE_CALIBRATION,
                                     WIRE_CMD_KEEP,   WIRE_CMD_PRIOR,     WIRE_CMD_LOCATION_LIMIT,
                                     WIRE_CMD_PAD,    WIRE_CMD_ERASE_PAD, WIRE_CRASH,
                                     WIRE_CMD_CRASH,  WIRE_SYNC,          WIRE_CMD_SYNC};
enum { WIRE_TYPES = sizeof wire_types };

enum sample_kind { SAMPLE_ZERO, SAMPLE_GREATEST, SAMPLE_LEAST, SAMPLE_RANDOM, SAMPLE_KINDS };

struct sampler {
  enum sample_kind kind;
  struct random random;
};

static inline uint32_t sample_u32(struct sampler *sampler) {
  switch (sampler->kind) {
  case SAMPLE_GREATEST: return UINT32_MAX;
  case SAMPLE_RANDOM: return random_u32(&sampler->random) >> random_below(&sampler->random, 32);
  default: return 0;
  }
}

static inline uint64_t sample_u64(struct sampler *sampler) {
  uint64_t high = sample_u32(sampler);
  return high << 32 | sample_u32(sampler);
}

/* Finite: the extremes, the smallest denormal, -0 and random bits. */
static inline float sample_f32(struct sampler *sampler) {
  switch (sampler->kind) {
  case SAMPLE_GREATEST: return FLT_MAX;
  case SAMPLE_LEAST: return -FLT_MAX;
  case SAMPLE_RANDOM:
    switch (random_below(&sampler->random, 8)) {
    case 0: return -0.0f;
    case 1: return bytes_to_f32(1);
    default: {
      uint32_t bits = random_u32(&sampler->random);
      return bytes_to_f32((bits & 0x7F800000u) == 0x7F800000u ? bits ^ 0x40000000u : bits);
    }
    }
  default: return 0.0f;
  }
}

static inline void sample_text(struct sampler *sampler, char text[WIRE_TEXT_BYTES]) {
  uint32_t length = sampler->kind == SAMPLE_RANDOM     ? random_below(&sampler->random, 17)
                    : sampler->kind == SAMPLE_GREATEST ? WIRE_TEXT_BYTES
                                                       : 0;
  for (uint32_t i = 0; i < length; i++) {
    text[i] = sampler->kind == SAMPLE_GREATEST ? '~' : (char)(' ' + (int)random_below(&sampler->random, '~' - ' ' + 1));
  }
}

static inline uint8_t sample_sensor_count(struct sampler *sampler) {
  return sampler->kind == SAMPLE_RANDOM     ? (uint8_t)(1 + random_below(&sampler->random, 32))
         : sampler->kind == SAMPLE_GREATEST ? WIRE_SENSORS_OF_WORD
                                            : 1;
}

/* The kinds of fields, and runs of them: as packet.c has them. */
enum kind { BYTES, TEXTS, SENSOR_COUNT, U16, U32, U64, F32, PAIRS, F32_PAIRS, SENSORS_F32, SENSORS_U16, WHEN, MAP };
struct run {
  uint8_t kind, count;
  uint16_t offset;
};

/* The values of a packet one by one, in the order of the line. */
struct walk {
  struct wire_packet *packet;
  const struct run *run, *end;
  unsigned next;          /* in the run */
  size_t offset;          /* in the body on the line */
  const uint8_t *sensors; /* how many there are */
};
struct value {
  enum kind kind; /* up to F32 */
  uint8_t *field;
  size_t offset;
};

#define RUN(kind, count, field)                                                                                                            \
  { kind, count, offsetof(struct wire_packet, body.field) }
#define LAYOUT(name, of)                                                                                                                   \
  if (packet->type == (of)) {                                                                                                              \
    walk.run = name##_runs;                                                                                                                \
    walk.end = name##_runs + sizeof name##_runs / sizeof name##_runs[0];                                                                   \
  }
#define EMPTY_LAYOUT(name, of)
static inline struct walk walk_begin(struct wire_packet *packet) {
  struct walk walk = {.packet = packet};
#include "wire/layouts.inc"
  return walk;
}

static inline bool walk_on(struct walk *walk, struct value *value) {
  static const uint8_t bytes[] = {1, WIRE_TEXT_BYTES, 1, 2, 4, 8, 4};
  /* A map as in a packet that is not wide. */
  static const enum kind kinds[] = {BYTES, TEXTS, SENSOR_COUNT, U16, U32, U64, F32, U32, F32, F32, U16, BYTES, U32};
  while (walk->run != walk->end) {
    const struct run *run = walk->run;
    uint8_t *field = (uint8_t *)walk->packet + run->offset;
    if (run->kind == WHEN) {
      uint32_t flags;
      memcpy(&flags, field, sizeof flags);
      walk->run += flags >> run->count & 1u ? 1 : 2;
      continue;
    }
    const bool pairs = run->kind == PAIRS || run->kind == F32_PAIRS;
    const unsigned each = pairs ? 2 : run->count, sensor = walk->next / each, at = walk->next % each;
    if (walk->next == each * (run->kind >= PAIRS && run->kind < WHEN ? *walk->sensors : 1u)) {
      walk->next = 0;
      walk->run++;
      continue;
    }
    value->kind = kinds[run->kind];
    value->field = field + bytes[value->kind] * at + sizeof(struct sensor_calibration) * sensor;
    if (pairs) {
      value->field = field + 4 * (sensor + FT_MAX_SENSORS * at);
    } else if (run->kind == SENSOR_COUNT) {
      walk->sensors = field;
    }
    value->offset = walk->offset;
    walk->offset += bytes[value->kind];
    walk->next++;
    return true;
  }
  return false;
}

/* On a machine that is little-endian. */
static inline void sample_value(struct sampler *sampler, const struct value *value) {
  static const uint8_t bytes[] = {1, 0, 1, 2, 4, 8, 4};
  const uint8_t size = bytes[value->kind];
  if (value->kind == TEXTS) {
    sample_text(sampler, (char *)value->field);
    return;
  }
  const uint64_t bits = value->kind == F32              ? bytes_from_f32(sample_f32(sampler))
                        : value->kind == SENSOR_COUNT   ? sample_sensor_count(sampler)
                        : sampler->kind == SAMPLE_LEAST ? UINT64_C(1) << (8 * size - 1)
                                                        : sample_u64(sampler);
  memcpy(value->field, &bits, size);
}

/* Every byte of the packet is defined, so that two of them may be compared as memory. A quantity that is not valid is
 * 0. test_wire_vectors.c shows that the layouts leave no field out. */
static inline void sample_packet(struct sampler *sampler, uint8_t type, struct wire_packet *packet) {
  memset(packet, 0, sizeof *packet);
  packet->type = type;
  packet->sequence = (uint16_t)sample_u32(sampler);
  packet->t_us = sample_u64(sampler);
  struct walk walk = walk_begin(packet);
  for (struct value value; walk_on(&walk, &value);) {
    sample_value(sampler, &value);
  }
}

static inline enum ft_status encode(const struct wire_packet *packet, uint8_t *frame, size_t *length) {
  return wire_encode(wire_find_layout(wire_all_layouts, packet->type), packet, frame, length);
}

/* COBS by its definition: the zeros end blocks; a block of 254 bytes stands for itself. */
static inline size_t reference_cobs(const uint8_t *from, size_t length, uint8_t *to) {
  size_t in = 0;
  size_t out = 0;
  for (;;) {
    size_t run = 0;
    while (in + run < length && from[in + run] != 0 && run < 254) {
      run++;
    }
    to[out++] = (uint8_t)(run + 1);
    memcpy(to + out, from + in, run);
    out += run;
    in += run;
    if (in == length) {
      return out;
    }
    if (run < 254) {
      in++; /* the zero */
      if (in == length) {
        to[out++] = 1;
        return out;
      }
    }
  }
}

/* Appends the CRC to length bytes and codes them; returns the length without a delimiter. */
static inline size_t seal(uint8_t *bytes, size_t length, uint8_t *frame) {
  bytes_put_u32(bytes + length, crc32_iso_hdlc(bytes, length));
  return reference_cobs(bytes, length + WIRE_CRC_BYTES, frame);
}

/* The opposite of the coding above, for frames known to be right. */
static inline size_t unseal(const uint8_t *frame, size_t length, uint8_t *bytes) {
  size_t in = 0;
  size_t out = 0;
  while (in < length) {
    uint8_t code = frame[in++];
    memcpy(bytes + out, frame + in, code - 1u);
    out += code - 1u;
    in += code - 1u;
    if (code != 0xFF && in < length) {
      bytes[out++] = 0;
    }
  }
  return out - WIRE_CRC_BYTES;
}
