#include "wire/packet.h"

#include "common/bytes.h"
#include "common/contact_flags.h"
#include "common/crc32.h"

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
  F32_PAIRS, /* likewise */
  WHEN,      /* no field: the next run is there if bit `count` of this word is set */
};
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

#define RUN(kind, count, field)                                                                    \
  { kind, count, offsetof(struct wire_packet, body.field) }
#define LAYOUT(name, type)                                                                         \
  const struct wire_layout name##_layout = {type, sizeof name##_runs / sizeof name##_runs[0],      \
                                            name##_runs}
#define EMPTY_LAYOUT(name, type) static const struct wire_layout name##_layout = {type, 0, NULL}
_Static_assert(offsetof(struct wire_packet, body.raw.baseline_Pa_q10) ==
                       offsetof(struct wire_packet, body.raw.pressure_Pa_q10) +
                           4 * FT_MAX_SENSORS &&
                   offsetof(struct wire_packet, body.info.y_mm) ==
                       offsetof(struct wire_packet, body.info.x_mm) + 4 * FT_MAX_SENSORS,
               "PAIRS");

static const struct run wire_contact_runs[] = {
    RUN(U32, 2, contact.frame),  RUN(U16, 7, contact.stages),
    RUN(WHEN, 1, contact.flags), RUN(U32, 1, contact.sensors_used),
    RUN(WHEN, 1, contact.flags), RUN(F32, 6, contact.x_mm),
    RUN(WHEN, 2, contact.flags), RUN(F32, 2, contact.location_sd_mm),
    RUN(WHEN, 3, contact.flags), RUN(F32, 1, contact.slip_mm),
};
_Static_assert(CONTACT_FLAG_FIT_VALID == 1 << 1 && CONTACT_FLAG_UNCERTAINTY_VALID == 1 << 2 &&
                   CONTACT_FLAG_SLIP_VALID == 1 << 3,
               "bits in wire_contact_runs");
LAYOUT(wire_contact, WIRE_CONTACT);

static const struct run wire_raw_runs[] = {
    RUN(U32, 4, raw.frame),
    RUN(U16, 1, raw.temperature_cC),
    RUN(SENSOR_COUNT, 1, raw.sensor_count),
    RUN(PAIRS, 1, raw.pressure_Pa_q10),
};
LAYOUT(wire_raw, WIRE_RAW);

static const struct run wire_info_runs[] = {
    RUN(BYTES, 3, info.firmware_version), RUN(SENSOR_COUNT, 1, info.sensor_count),
    RUN(U32, 1, info.capabilities),       RUN(TEXTS, 4, info.git_hash),
    RUN(U32, 2, info.rate_mHz),           RUN(U16, 2, info.osr),
    RUN(BYTES, 1, info.streams),          RUN(WHEN, 0, info.capabilities),
    RUN(BYTES, 1, info.fit_iterations),   RUN(WHEN, 1, info.capabilities),
    RUN(U16, 1, info.slip_window_ms),     RUN(WHEN, 1, info.capabilities),
    RUN(F32, 1, info.slip_threshold_mm),  RUN(F32, 1, info.pitch_mm),
    RUN(F32_PAIRS, 1, info.x_mm),
};
_Static_assert(WIRE_CAPABILITY_FIT == 1 << 0 && WIRE_CAPABILITY_SLIP == 1 << 1,
               "bits in wire_info_runs and wire_health_runs");
LAYOUT(wire_info, WIRE_INFO);

static const struct run wire_health_runs[] = {
    RUN(U32, 16, health.capabilities),
    RUN(U16, 2, health.cpu_busy_permille),
    RUN(WHEN, 0, health.capabilities),
    RUN(U32, 1, health.fit_failures),
};
LAYOUT(wire_health, WIRE_HEALTH);

static const struct run wire_ack_runs[] = {
    RUN(BYTES, 2, ack.command),
    RUN(U16, 1, ack.sequence),
    RUN(U64, 1, ack.host_time_us),
};
LAYOUT(wire_ack, WIRE_ACK);

static const struct run cmd_stream_runs[] = {RUN(BYTES, 1, cmd_stream.streams)};
static LAYOUT(cmd_stream, WIRE_CMD_STREAM);
EMPTY_LAYOUT(cmd_tare, WIRE_CMD_TARE);
static const struct run cmd_rate_runs[] = {RUN(U32, 1, cmd_rate.rate_mHz)};
static LAYOUT(cmd_rate, WIRE_CMD_RATE);
static const struct run cmd_osr_runs[] = {RUN(U16, 1, cmd_osr.osr)};
static LAYOUT(cmd_osr, WIRE_CMD_OSR);
static const struct run cmd_slip_runs[] = {
    RUN(F32, 1, cmd_slip.threshold_mm),
    RUN(U16, 1, cmd_slip.window_ms),
};
static LAYOUT(cmd_slip, WIRE_CMD_SLIP);
EMPTY_LAYOUT(cmd_info, WIRE_CMD_INFO);
EMPTY_LAYOUT(cmd_health, WIRE_CMD_HEALTH);
static const struct run cmd_loader_runs[] = {RUN(U32, 1, cmd_loader.magic)};
static LAYOUT(cmd_loader, WIRE_CMD_LOADER);

#define COMMANDS_WITHOUT_SLIP                                                                      \
  &cmd_stream_layout, &cmd_tare_layout, &cmd_rate_layout, &cmd_osr_layout, &cmd_info_layout,       \
      &cmd_health_layout, &cmd_loader_layout
const struct wire_layout *const wire_commands_without_slip[] = {COMMANDS_WITHOUT_SLIP, NULL};
const struct wire_layout *const wire_commands[] = {COMMANDS_WITHOUT_SLIP, &cmd_slip_layout, NULL};
const struct wire_layout *const wire_all_layouts[] = {
    &wire_contact_layout, &wire_raw_layout,      &wire_info_layout, &wire_health_layout,
    &wire_ack_layout,     COMMANDS_WITHOUT_SLIP, &cmd_slip_layout,  NULL};

const struct wire_layout *wire_find_layout(const struct wire_layout *const *set, uint8_t type) {
  while (*set && (*set)->type != type) {
    set++;
  }
  return *set;
}

/* Walks over a body in one direction or the other, so that each layout is written down once. */
struct cursor {
  uint8_t *at;
  const uint8_t *end;
  bool writing;
};

static bool move_bytes(struct cursor *cursor, uint8_t *field, unsigned count) {
  memcpy(cursor->writing ? cursor->at : field, cursor->writing ? field : cursor->at, count);
  return true;
}

static bool move_texts(struct cursor *cursor, uint8_t *field, unsigned count) {
  move_bytes(cursor, field, count * WIRE_TEXT_BYTES);
  bool padding = false;
  for (unsigned i = 0; i < count * WIRE_TEXT_BYTES; i++) {
    uint8_t byte = field[i];
    padding = padding && i % WIRE_TEXT_BYTES != 0;
    bool printable = byte >= 0x20 && byte <= 0x7E;
    if (byte != 0 && (padding || !printable)) {
      return false;
    }
    padding = byte == 0;
  }
  return true;
}

static bool move_u16(struct cursor *cursor, uint8_t *field, unsigned count) {
  for (uint8_t *at = cursor->at; count > 0; count--, at += 2, field += 2) {
    uint16_t value;
    if (cursor->writing) {
      memcpy(&value, __builtin_assume_aligned(field, 2), sizeof value);
      bytes_put_u16(at, value);
    } else {
      value = bytes_get_u16(at);
      memcpy(__builtin_assume_aligned(field, 2), &value, sizeof value);
    }
  }
  return true;
}

static bool move_u64(struct cursor *cursor, uint8_t *field) {
  uint64_t value;
  if (cursor->writing) {
    memcpy(&value, field, sizeof value);
    bytes_put_u64(cursor->at, value);
  } else {
    value = bytes_get_u64(cursor->at);
    memcpy(field, &value, sizeof value);
  }
  return true;
}

/* stride: of the values on the line. False: a float that is not finite. */
static bool move_u32(struct cursor *cursor, uint8_t *field, unsigned count, size_t first,
                     size_t stride, bool is_float) {
  const uint32_t exponent = 0x7F800000u;
  bool finite = true;
  for (uint8_t *at = cursor->at + first; count > 0; count--, at += stride, field += 4) {
    uint32_t value;
    if (cursor->writing) {
      memcpy(&value, __builtin_assume_aligned(field, 4), sizeof value);
      bytes_put_u32(at, value);
    } else {
      value = bytes_get_u32(at);
      memcpy(__builtin_assume_aligned(field, 4), &value, sizeof value);
    }
    if ((value & exponent) == exponent) {
      finite = false;
    }
  }
  return finite || !is_float;
}

static bool move_pairs(struct cursor *cursor, uint8_t *field, unsigned count, bool is_float) {
  bool first = move_u32(cursor, field, count, 0, 8, is_float);
  bool second = move_u32(cursor, field + 4 * FT_MAX_SENSORS, count, 4, 8, is_float);
  return first && second;
}

static bool move_run(struct cursor *cursor, const struct run *run, uint8_t *field, unsigned count) {
  switch (run->kind) {
  case TEXTS:
    return move_texts(cursor, field, count);
  case U16:
    return move_u16(cursor, field, count);
  case U32:
    return move_u32(cursor, field, count, 0, 4, false);
  case U64:
    return move_u64(cursor, field);
  case F32:
    return move_u32(cursor, field, count, 0, 4, true);
  case PAIRS:
    return move_pairs(cursor, field, count, false);
  case F32_PAIRS:
    return move_pairs(cursor, field, count, true);
  default:
    return move_bytes(cursor, field, count);
  }
}

static const uint8_t bytes_of_kind[] = {[BYTES] = 1,        [TEXTS] = WIRE_TEXT_BYTES,
                                        [SENSOR_COUNT] = 1, [U16] = 2,
                                        [U32] = 4,          [U64] = 8,
                                        [F32] = 4,          [PAIRS] = 8,
                                        [F32_PAIRS] = 8};

/* False: the body is too short, or a value is refused. */
static bool move_body(const struct wire_layout *layout, struct cursor *cursor,
                      struct wire_packet *packet) {
  unsigned sensor_count = 0;
  const struct run *end = layout->runs + layout->run_count;
  for (const struct run *run = layout->runs; run < end; run++) {
    uint8_t *field = (uint8_t *)packet + run->offset;
    if (run->kind == WHEN) {
      uint32_t flags;
      memcpy(&flags, __builtin_assume_aligned(field, 4), sizeof flags);
      run += ~flags >> run->count & 1u;
      continue;
    }
    unsigned count = run->kind >= PAIRS ? sensor_count : run->count;
    size_t length = count * bytes_of_kind[run->kind];
    if ((size_t)(cursor->end - cursor->at) < length || !move_run(cursor, run, field, count)) {
      return false;
    }
    cursor->at += length;
    if (run->kind == SENSOR_COUNT) {
      sensor_count = *field;
      if (sensor_count < 1 || sensor_count > FT_MAX_SENSORS) {
        return false;
      }
    }
  }
  return true;
}

/* In place: the first byte of frame is free, length bytes follow, and room for what COBS adds.
 * Returns the length of the whole. */
static size_t cobs_encode(uint8_t *frame, size_t length) {
  size_t code_at = 0;
  for (size_t i = 1; i <= length; i++) {
    if (frame[i] == 0) {
      frame[code_at] = (uint8_t)(i - code_at);
      code_at = i;
    } else if (i - code_at == 254 && i < length) {
      frame[code_at] = 0xFF;
      code_at = i + 1;
      memmove(frame + code_at + 1, frame + code_at, length - i);
      length++;
      i++;
    }
  }
  frame[code_at] = (uint8_t)(length + 1 - code_at);
  return length + 1;
}

/* In place. Returns 0 for bytes that no COBS encoder produces. */
static size_t cobs_decode(uint8_t *frame, size_t length) {
  size_t in = 0;
  size_t out = 0;
  while (in < length) {
    uint8_t code = frame[in++];
    if (code == 0 || (size_t)(code - 1) > length - in) {
      return 0;
    }
    for (uint8_t i = 1; i < code; i++) {
      if (frame[in] == 0) {
        return 0;
      }
      frame[out++] = frame[in++];
    }
    if (code != 0xFF && in < length) {
      frame[out++] = 0;
    }
  }
  return out;
}

enum ft_status wire_encode(const struct wire_layout *layout, const struct wire_packet *packet,
                           uint8_t frame[WIRE_MAX_FRAME_BYTES], size_t *length) {
  if (!layout) {
    return FT_ERR_ARGUMENT;
  }
  uint8_t *bytes = frame + 1;
  bytes[0] = WIRE_VERSION;
  bytes[1] = layout->type;
  bytes_put_u16(bytes + 2, packet->sequence);
  bytes_put_u64(bytes + 4, packet->t_us);
  struct cursor cursor = {.at = bytes + WIRE_HEADER_BYTES,
                          .end = bytes + WIRE_HEADER_BYTES + WIRE_MAX_BODY_BYTES,
                          .writing = true};
  /* Writing only reads the packet. */
  if (!move_body(layout, &cursor, (struct wire_packet *)(uintptr_t)packet)) {
    return FT_ERR_ARGUMENT;
  }
  size_t used = (size_t)(cursor.at - bytes);
  bytes_put_u32(cursor.at, crc32_iso_hdlc(bytes, used));
  size_t out = cobs_encode(frame, used + WIRE_CRC_BYTES);
  frame[out++] = 0;
  *length = out;
  return FT_OK;
}

enum ft_status wire_decode(const struct wire_layout *const *set, uint8_t *frame, size_t length,
                           struct wire_packet *packet) {
  size_t used = cobs_decode(frame, length);
  if (used < WIRE_HEADER_BYTES + WIRE_CRC_BYTES) {
    return FT_ERR_FORMAT;
  }
  used -= WIRE_CRC_BYTES;
  if (crc32_iso_hdlc(frame, used) != bytes_get_u32(frame + used)) {
    return FT_ERR_CRC;
  }
  if (frame[0] != WIRE_VERSION) {
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
  struct cursor cursor = {.at = frame + WIRE_HEADER_BYTES, .end = frame + used, .writing = false};
  if (!move_body(layout, &cursor, &decoded) || cursor.at != cursor.end) {
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

enum ft_status wire_receive(struct wire_receiver *receiver, uint8_t byte,
                            struct wire_packet *packet) {
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
