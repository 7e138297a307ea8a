#include "wire/packet.h"

#include "common/bytes.h"
#include "common/crc32.h"
#include "wire/cobs.h"

#include <stdbool.h>
#include <string.h>

/* Consecutive fields of one kind, both in the body and on the line. */
enum kind {
  BYTES,
  TEXTS, /* of WIRE_TEXT_BYTES */
  SENSOR_COUNT,
  U16,
  U32,
  U64,
  F32,
  PAIRS,     /* of 32 bits: for each sensor an element of each of two arrays behind one another */
  F32_PAIRS, /* the same */
  /* As many members as the count states, one behind the other, of one struct each */
  SENSORS_F32,
  SENSORS_U16,
  WHEN, /* no field: the next run is there if bit `count` of this word is set */
  MAP,  /* U64 in a wide packet, else the lower half of one, U32 */
};
/* Of its version byte, where this build knows it. */
#define WIDE (FT_MAX_SENSORS > WIRE_SENSORS_OF_WORD ? (unsigned)WIRE_WIDE : 0u)
struct run {
  uint8_t kind;
  uint8_t count;
  uint16_t offset; /* in struct wire_packet */
};

struct wire_layout {
  uint8_t type;
  uint8_t run_count;
  const struct run *runs;
};

#define RUN(kind, count, field)                                                                                                            \
  { kind, count, offsetof(struct wire_packet, body.field) }
#define LAYOUT(name, type) const struct wire_layout name##_layout = {type, sizeof name##_runs / sizeof name##_runs[0], name##_runs}
static const struct run no_runs[1]; /* NULL has no end to go to */
#define EMPTY_LAYOUT(name, type) const struct wire_layout name##_layout = {type, 0, no_runs}
_Static_assert(offsetof(struct sensor_calibration, gain_sd) == 4 &&
                   offsetof(struct sensor_calibration, off_y_um) == offsetof(struct sensor_calibration, off_x_um) + 2 &&
                   offsetof(struct sensor_calibration, wider_q15) == offsetof(struct sensor_calibration, off_x_um) + 4,
               "SENSORS_F32, SENSORS_U16");
_Static_assert(offsetof(struct wire_packet, body.raw.baseline_Pa_q10) ==
                       offsetof(struct wire_packet, body.raw.pressure_Pa_q10) + 4 * FT_MAX_SENSORS &&
                   offsetof(struct wire_packet, body.info.y_mm) == offsetof(struct wire_packet, body.info.x_mm) + 4 * FT_MAX_SENSORS,
               "PAIRS");

_Static_assert(offsetof(struct crash_record, r0) % 4 == 0 &&
                   offsetof(struct crash_record, event_ages_1024us) == offsetof(struct crash_record, r0) + 9 * 4,
               "U32 of crash");

#include "wire/layouts.inc"

const struct wire_layout *const wire_commands[] = {ALL_COMMANDS, NULL};
const struct wire_layout *const wire_all_layouts[] = {ALL_PACKETS, ALL_COMMANDS, NULL};

const struct wire_layout *wire_find_layout(const struct wire_layout *const *set, uint8_t type) {
  while (*set && (*set)->type != type) {
    set++;
  }
  return *set;
}

static bool is_printable(uint8_t byte) { return byte >= 0x20 && byte <= 0x7E; }

/* Whether these fields, in the machine's form, hold what the protocol allows. */
static bool is_text(const uint8_t *field, unsigned count) {
  bool padding = false;
  for (unsigned i = 0; i < count; i++) {
    padding = padding && i % WIRE_TEXT_BYTES != 0;
    if (field[i] != 0 && (padding || !is_printable(field[i]))) {
      return false;
    }
    padding = field[i] == 0;
  }
  return true;
}

#define EXPONENT 0x7F800000u
/* Added to an exponent of ones, it carries into the sign. */
#define LOWEST_OF_EXPONENT 0x00800000u
#define IS_FINITE(bits) (((bits)&EXPONENT) != EXPONENT)

/* Bytes from one 32-bit value of a run to the next: the two of a pair take turns. */
struct stride {
  int next, after;
};

static inline struct stride stride_of(bool pairs) {
  const int across = 4 * FT_MAX_SENSORS;
  return pairs ? (struct stride){across, 4 - across} : (struct stride){4, 4};
}

struct writer {
  uint8_t *at;
  uint32_t crc;
};

/* Returns whether all would be finite as floats. Most of a packet goes through here. */
static bool put_u32(struct writer *writer, const uint8_t *field, unsigned count) {
  uint8_t *at = writer->at;
  const uint8_t *end = at + 4 * count;
  uint32_t crc = writer->crc;
  uint32_t infinite = 0;
  while (at != end) {
    uint32_t value;
    memcpy(&value, __builtin_assume_aligned(field, 4), sizeof value);
    field += 4;
    bytes_put_u32(at, value);
    at += 4;
    crc = crc32_add_u32(crc, value);
    infinite |= (value & EXPONENT) + LOWEST_OF_EXPONENT;
  }
  writer->at = at;
  writer->crc = crc;
  return infinite >> 31 == 0;
}

/* Takes from two arrays of sensors in turn. */
static bool put_pairs(struct writer *writer, const uint8_t *field, unsigned count) {
  bool finite = true;
  for (; count > 0; count--, field += 4) {
    finite &= put_u32(writer, field, 1);
    finite &= put_u32(writer, field + 4 * FT_MAX_SENSORS, 1);
  }
  return finite;
}

static void put_u16(struct writer *writer, const uint8_t *field, unsigned count) {
  uint8_t *at = writer->at;
  const uint8_t *end = at + 2 * count;
  uint32_t crc = writer->crc;
  for (; at != end; at += 2, field += 2) {
    uint16_t value;
    memcpy(&value, __builtin_assume_aligned(field, 2), sizeof value);
    bytes_put_u16(at, value);
    crc = crc32_add_u16(crc, value);
  }
  writer->at = at;
  writer->crc = crc;
}

static void put_bytes(struct writer *writer, const uint8_t *field, unsigned count) {
  for (; count > 0; count--) {
    writer->crc = crc32_add_u8(writer->crc, *field);
    *writer->at++ = *field++;
  }
}

static void put_u64(struct writer *writer, uint64_t value) {
  const uint32_t words[2] = {(uint32_t)value, (uint32_t)(value >> 32)};
  put_u32(writer, (const uint8_t *)words, 2);
}

static bool put_run(struct writer *writer, uint8_t kind, const uint8_t *field, unsigned count) {
  uint64_t wide;
  if (kind == F32) { /* most of a contact, and quicker than by the table of the switch */
    return put_u32(writer, field, count);
  }
  switch (kind) {
  case TEXTS: put_bytes(writer, field, count * WIRE_TEXT_BYTES); return is_text(field, count * WIRE_TEXT_BYTES);
  case U16: put_u16(writer, field, count); return true;
  case U64:
    memcpy(&wide, field, sizeof wide);
    put_u64(writer, wide);
    return true;
  case U32: put_u32(writer, field, count); return true;
  case PAIRS: put_pairs(writer, field, count); return true;
  case F32_PAIRS: return put_pairs(writer, field, count);
  default: put_bytes(writer, field, count); return true;
  }
}

static bool get_u32(const uint8_t *at, uint8_t *field, unsigned count, bool pairs) {
  struct stride stride = stride_of(pairs);
  bool finite = true;
  for (; count > 0; count--, at += 4) {
    uint32_t value = bytes_get_u32(at);
    memcpy(__builtin_assume_aligned(field, 4), &value, sizeof value);
    finite = finite && IS_FINITE(value);
    field += stride.next;
    stride = (struct stride){stride.after, stride.next};
  }
  return finite;
}

static bool get_run(const uint8_t *at, uint8_t kind, uint8_t *field, unsigned count) {
  uint64_t wide;
  uint16_t half;
  switch (kind) {
  case TEXTS: memcpy(field, at, count * WIRE_TEXT_BYTES); return is_text(field, count * WIRE_TEXT_BYTES);
  case U16:
    for (; count > 0; count--, at += 2, field += 2) {
      half = bytes_get_u16(at);
      memcpy(__builtin_assume_aligned(field, 2), &half, sizeof half);
    }
    return true;
  case U64:
    wide = bytes_get_u64(at);
    memcpy(field, &wide, sizeof wide);
    return true;
  case U32: get_u32(at, field, count, false); return true;
  case PAIRS: get_u32(at, field, 2 * count, true); return true;
  case F32: return get_u32(at, field, count, false);
  case F32_PAIRS: return get_u32(at, field, 2 * count, true);
  default: memcpy(field, at, count); return true;
  }
}

static bool is_left_out(const struct run *when, const uint8_t *field) {
  uint32_t flags;
  memcpy(&flags, __builtin_assume_aligned(field, 4), sizeof flags);
  return (flags >> when->count & 1u) == 0;
}

static bool is_sensor_count(uint8_t count) { return count >= 1 && count <= FT_MAX_SENSORS; }

/* A run as a simpler one for each sensor. */
struct repeat {
  uint8_t kind;
  uint8_t count;
  uint8_t times;
};

static inline struct repeat repeat_of(const struct run *run, uint8_t sensor_count, unsigned wide) {
  if (WIDE != 0 && run->kind == MAP) {
    return (struct repeat){wide ? U64 : U32, 1, 1};
  }
  if (run->kind >= SENSORS_F32) {
    return (struct repeat){run->kind == SENSORS_F32 ? F32 : U16, run->count, sensor_count};
  }
  return (struct repeat){run->kind, run->kind >= PAIRS ? sensor_count : run->count, 1};
}

/* WIRE_WIDE, if a sensor is beyond those of a word; else 0. */
static unsigned width_of(const struct wire_layout *layout, const uint8_t *packet) {
  bool wide = false;
  for (const struct run *run = layout->runs; WIDE != 0 && run < layout->runs + layout->run_count; run++) {
    sensor_map map = 0;
    memcpy(&map, packet + run->offset, run->kind == MAP ? sizeof map : 0);
    wide |= map > UINT32_MAX || (run->kind == SENSOR_COUNT && packet[run->offset] > WIRE_SENSORS_OF_WORD);
  }
  return wide ? WIDE : 0;
}

/* False: a value is refused. */
static bool put_body(const struct wire_layout *layout, const uint8_t *packet, unsigned wide, struct writer *writer) {
  uint8_t sensor_count = 0;
  const struct run *end = layout->runs + layout->run_count;
  for (const struct run *run = layout->runs; run < end; run++) {
    const uint8_t *field = packet + run->offset;
    if (run->kind == WHEN) {
      run += is_left_out(run, field);
      continue;
    }
    if (run->kind == SENSOR_COUNT) {
      sensor_count = *field;
      if (!is_sensor_count(sensor_count)) {
        return false;
      }
    }
    struct repeat repeat = repeat_of(run, sensor_count, wide);
    for (; repeat.times > 0; repeat.times--, field += sizeof(struct sensor_calibration)) {
      if (!put_run(writer, repeat.kind, field, repeat.count)) {
        return false;
      }
    }
  }
  return true;
}

static const uint8_t bytes_of_kind[] = {
    [BYTES] = 1, [TEXTS] = WIRE_TEXT_BYTES, [SENSOR_COUNT] = 1, [U16] = 2, [U32] = 4, [U64] = 8, [F32] = 4, [PAIRS] = 8, [F32_PAIRS] = 8};

/* False: a value is refused, or the body has another length. */
static bool get_body(const struct wire_layout *layout, unsigned wide, const uint8_t *at, size_t length, uint8_t *packet) {
  uint8_t sensor_count = 0;
  const struct run *end = layout->runs + layout->run_count;
  for (const struct run *run = layout->runs; run < end; run++) {
    uint8_t *field = packet + run->offset;
    if (run->kind == WHEN) {
      run += is_left_out(run, field);
      continue;
    }
    struct repeat repeat = repeat_of(run, sensor_count, wide);
    size_t bytes = repeat.count * bytes_of_kind[repeat.kind];
    for (; repeat.times > 0; repeat.times--, field += sizeof(struct sensor_calibration)) {
      if (length < bytes || !get_run(at, repeat.kind, field, repeat.count)) {
        return false;
      }
      at += bytes;
      length -= bytes;
    }
    if (run->kind == SENSOR_COUNT) {
      sensor_count = packet[run->offset];
      if (!is_sensor_count(sensor_count)) {
        return false;
      }
    }
  }
  return length == 0;
}

enum ft_status wire_encode(const struct wire_layout *layout, const struct wire_packet *packet, uint8_t frame[WIRE_MAX_FRAME_BYTES],
                           size_t *length) {
  if (!layout) {
    return FT_ERR_ARGUMENT;
  }
  struct writer writer = {.at = frame + 1, .crc = CRC32_BEGIN};
  const unsigned wide = width_of(layout, (const uint8_t *)packet);
  const uint8_t head[2] = {(uint8_t)(WIRE_VERSION | wide), layout->type};
  put_bytes(&writer, head, sizeof head);
  put_u16(&writer, (const uint8_t *)&packet->sequence, 1);
  put_u64(&writer, packet->t_us);
  if (!put_body(layout, (const uint8_t *)packet, wide, &writer)) {
    return FT_ERR_ARGUMENT;
  }
  bytes_put_u32(writer.at, ~writer.crc);
  *length = cobs_encode(frame, (size_t)(writer.at + WIRE_CRC_BYTES - (frame + 1)));
  return FT_OK;
}

enum ft_status wire_decode(const struct wire_layout *const *set, uint8_t *frame, size_t length, struct wire_packet *packet) {
  size_t used = cobs_decode(frame, length);
  if (used < WIRE_HEADER_BYTES + WIRE_CRC_BYTES) {
    return FT_ERR_FORMAT;
  }
  used -= WIRE_CRC_BYTES;
  if (crc32_iso_hdlc(frame, used) != bytes_get_u32(frame + used)) {
    return FT_ERR_CRC;
  }
  const unsigned wide = frame[0] & WIDE;
  if (frame[0] != (WIRE_VERSION | wide)) {
    return FT_ERR_VERSION;
  }
  struct wire_packet decoded;
  memset(&decoded, 0, sizeof decoded);
  decoded.type = frame[1];
  decoded.sequence = bytes_get_u16(frame + 2);
  decoded.t_us = bytes_get_u64(frame + 4);
  const struct wire_layout *layout = wire_find_layout(set, decoded.type);
  if (!layout) {
    *packet = decoded;
    return FT_ERR_TYPE;
  }
  if (!get_body(layout, wide, frame + WIRE_HEADER_BYTES, used - WIRE_HEADER_BYTES, (uint8_t *)&decoded)) {
    return FT_ERR_FORMAT;
  }
  *packet = decoded;
  return FT_OK;
}

void wire_receiver_init(struct wire_receiver *receiver, const struct wire_layout *const *set) {
  receiver->set = set;
  receiver->length = 0;
  receiver->overlong = 0;
}

enum ft_status wire_receive(struct wire_receiver *receiver, uint8_t byte, struct wire_packet *packet) {
  if (byte != 0) {
    if (receiver->length < sizeof receiver->frame) {
      receiver->frame[receiver->length++] = byte;
    } else {
      receiver->overlong = 1;
    }
    return FT_PENDING;
  }
  size_t length = receiver->length;
  uint32_t overlong = receiver->overlong;
  wire_receiver_init(receiver, receiver->set);
  if (overlong) {
    return FT_ERR_SPACE;
  }
  if (length == 0) {
    return FT_PENDING;
  }
  return wire_decode(receiver->set, receiver->frame, length, packet);
}
