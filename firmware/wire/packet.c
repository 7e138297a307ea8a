#include "wire/packet.h"

#include "common/bytes.h"
#include "common/crc32.h"

#include <stdbool.h>
#include <string.h>

/* Walks over a body in one direction or the other, so that each layout is written down once. */
struct cursor {
  uint8_t *at;
  uint8_t *end;
  bool writing;
  bool failed;
};

static uint8_t *take(struct cursor *cursor, size_t count) {
  if (cursor->failed || (size_t)(cursor->end - cursor->at) < count) {
    cursor->failed = true;
    return NULL;
  }
  uint8_t *at = cursor->at;
  cursor->at += count;
  return at;
}

static void field_u8(struct cursor *cursor, uint8_t *value) {
  uint8_t *at = take(cursor, 1);
  if (!at) {
    return;
  }
  if (cursor->writing) {
    *at = *value;
  } else {
    *value = *at;
  }
}

static void field_u16(struct cursor *cursor, uint16_t *value) {
  uint8_t *at = take(cursor, 2);
  if (!at) {
    return;
  }
  if (cursor->writing) {
    bytes_put_u16(at, *value);
  } else {
    *value = bytes_get_u16(at);
  }
}

static void field_u32(struct cursor *cursor, uint32_t *value) {
  uint8_t *at = take(cursor, 4);
  if (!at) {
    return;
  }
  if (cursor->writing) {
    bytes_put_u32(at, *value);
  } else {
    *value = bytes_get_u32(at);
  }
}

static void field_u64(struct cursor *cursor, uint64_t *value) {
  uint8_t *at = take(cursor, 8);
  if (!at) {
    return;
  }
  if (cursor->writing) {
    bytes_put_u64(at, *value);
  } else {
    *value = bytes_get_u64(at);
  }
}

static void field_i16(struct cursor *cursor, int16_t *value) {
  uint16_t bits = (uint16_t)*value;
  field_u16(cursor, &bits);
  *value = (int16_t)bits;
}

static void field_i32(struct cursor *cursor, int32_t *value) {
  uint32_t bits = (uint32_t)*value;
  field_u32(cursor, &bits);
  *value = (int32_t)bits;
}

static void field_f32(struct cursor *cursor, float *value) {
  uint32_t bits = bytes_from_f32(*value);
  field_u32(cursor, &bits);
  if ((bits & 0x7F800000u) == 0x7F800000u) {
    cursor->failed = true;
    return;
  }
  *value = bytes_to_f32(bits);
}

static void field_text(struct cursor *cursor, char text[WIRE_TEXT_BYTES]) {
  bool padding = false;
  for (int i = 0; i < WIRE_TEXT_BYTES; i++) {
    uint8_t byte = (uint8_t)text[i];
    field_u8(cursor, &byte);
    bool printable = byte >= 0x20 && byte <= 0x7E;
    if (padding ? byte != 0 : byte != 0 && !printable) {
      cursor->failed = true;
    }
    padding = byte == 0;
    text[i] = (char)byte;
  }
}

static void field_sensor_count(struct cursor *cursor, uint8_t *count) {
  field_u8(cursor, count);
  if (*count < 1 || *count > FT_MAX_SENSORS) {
    cursor->failed = true;
  }
}

static void contact_fields(struct cursor *cursor, struct wire_contact *contact) {
  field_u32(cursor, &contact->frame);
  field_u32(cursor, &contact->flags);
  field_u32(cursor, &contact->sensors_used);
  field_f32(cursor, &contact->x_mm);
  field_f32(cursor, &contact->y_mm);
  field_f32(cursor, &contact->p0_Pa);
  field_f32(cursor, &contact->sigma_mm);
  field_f32(cursor, &contact->force_N);
  field_f32(cursor, &contact->slip_mm);
  field_f32(cursor, &contact->residual_rms_Pa);
  field_f32(cursor, &contact->location_sd_mm);
  field_f32(cursor, &contact->force_sd_N);
  field_u16(cursor, &contact->stages.convert_us);
  field_u16(cursor, &contact->stages.read_us);
  field_u16(cursor, &contact->stages.queue_us);
  field_u16(cursor, &contact->stages.condition_us);
  field_u16(cursor, &contact->stages.fit_us);
  field_u16(cursor, &contact->stages.contact_us);
  field_u16(cursor, &contact->stages.total_us);
}

static void raw_fields(struct cursor *cursor, struct wire_raw *raw) {
  field_u32(cursor, &raw->frame);
  field_u32(cursor, &raw->valid);
  field_u32(cursor, &raw->saturated);
  field_i16(cursor, &raw->temperature_cC);
  field_sensor_count(cursor, &raw->sensor_count);
  for (int k = 0; !cursor->failed && k < raw->sensor_count; k++) {
    field_i32(cursor, &raw->pressure_Pa_q10[k]);
    field_i32(cursor, &raw->baseline_Pa_q10[k]);
  }
}

static void info_fields(struct cursor *cursor, struct wire_info *info) {
  for (int i = 0; i < 3; i++) {
    field_u8(cursor, &info->firmware_version[i]);
  }
  field_sensor_count(cursor, &info->sensor_count);
  field_text(cursor, info->git_hash);
  field_text(cursor, info->board);
  field_text(cursor, info->scene);
  field_text(cursor, info->serial);
  field_u32(cursor, &info->rate_mHz);
  field_u32(cursor, &info->measured_rate_mHz);
  field_u16(cursor, &info->osr);
  field_u16(cursor, &info->temperature_interval_ms);
  field_u16(cursor, &info->slip_window_ms);
  field_u8(cursor, &info->fit_iterations);
  field_u8(cursor, &info->streams);
  field_f32(cursor, &info->slip_threshold_mm);
  field_f32(cursor, &info->pitch_mm);
  for (int k = 0; !cursor->failed && k < info->sensor_count; k++) {
    field_f32(cursor, &info->x_mm[k]);
    field_f32(cursor, &info->y_mm[k]);
  }
}

static void health_fields(struct cursor *cursor, struct wire_health *health) {
  field_u32(cursor, &health->uptime_s);
  field_u32(cursor, &health->frames);
  field_u32(cursor, &health->frames_incomplete);
  field_u32(cursor, &health->frames_skipped);
  field_u32(cursor, &health->packets_sent);
  field_u32(cursor, &health->packets_dropped);
  field_u32(cursor, &health->commands_done);
  field_u32(cursor, &health->commands_rejected);
  field_u32(cursor, &health->bus_nacks);
  field_u32(cursor, &health->bus_timeouts);
  field_u32(cursor, &health->bus_recoveries);
  field_u32(cursor, &health->zero_readings);
  field_u32(cursor, &health->fit_failures);
  field_u32(cursor, &health->sensors_present);
  field_u32(cursor, &health->sensors_prom_bad);
  field_u32(cursor, &health->watchdog_resets);
  field_u16(cursor, &health->cpu_busy_permille);
  field_u16(cursor, &health->stack_free_bytes);
}

static void ack_fields(struct cursor *cursor, struct wire_ack *ack) {
  field_u8(cursor, &ack->command);
  field_u8(cursor, &ack->result);
  field_u16(cursor, &ack->sequence);
  field_u64(cursor, &ack->host_time_us);
}

/* False for an unknown type. */
static bool body_fields(struct cursor *cursor, struct wire_packet *packet) {
  switch (packet->type) {
  case WIRE_CONTACT:
    contact_fields(cursor, &packet->body.contact);
    break;
  case WIRE_RAW:
    raw_fields(cursor, &packet->body.raw);
    break;
  case WIRE_INFO:
    info_fields(cursor, &packet->body.info);
    break;
  case WIRE_HEALTH:
    health_fields(cursor, &packet->body.health);
    break;
  case WIRE_ACK:
    ack_fields(cursor, &packet->body.ack);
    break;
  case WIRE_CMD_STREAM:
    field_u8(cursor, &packet->body.cmd_stream.streams);
    break;
  case WIRE_CMD_RATE:
    field_u32(cursor, &packet->body.cmd_rate.rate_mHz);
    break;
  case WIRE_CMD_OSR:
    field_u16(cursor, &packet->body.cmd_osr.osr);
    break;
  case WIRE_CMD_SLIP:
    field_f32(cursor, &packet->body.cmd_slip.threshold_mm);
    field_u16(cursor, &packet->body.cmd_slip.window_ms);
    break;
  case WIRE_CMD_LOADER:
    field_u32(cursor, &packet->body.cmd_loader.magic);
    break;
  case WIRE_CMD_TARE:
  case WIRE_CMD_INFO:
  case WIRE_CMD_HEALTH:
    break;
  default:
    return false;
  }
  return true;
}

static size_t cobs_encode(const uint8_t *from, size_t length, uint8_t *to) {
  size_t code_at = 0;
  size_t out = 1;
  uint8_t code = 1;
  for (size_t i = 0; i < length; i++) {
    uint8_t byte = from[i];
    if (byte != 0) {
      to[out++] = byte;
      code++;
    }
    if (byte == 0 || (code == 0xFF && i + 1 < length)) {
      to[code_at] = code;
      code_at = out++;
      code = 1;
    }
  }
  to[code_at] = code;
  return out;
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

enum ft_status wire_encode(const struct wire_packet *packet, uint8_t *frame, size_t capacity,
                           size_t *length) {
  uint8_t bytes[WIRE_MAX_PACKET_BYTES];
  struct wire_packet copy = *packet;
  bytes[0] = WIRE_VERSION;
  bytes[1] = copy.type;
  bytes_put_u16(bytes + 2, copy.sequence);
  bytes_put_u64(bytes + 4, copy.t_us);
  struct cursor cursor = {.at = bytes + WIRE_HEADER_BYTES,
                          .end = bytes + sizeof bytes - WIRE_CRC_BYTES,
                          .writing = true};
  if (!body_fields(&cursor, &copy) || cursor.failed) {
    return FT_ERR_ARGUMENT;
  }
  size_t used = (size_t)(cursor.at - bytes);
  bytes_put_u32(cursor.at, crc32_iso_hdlc(bytes, used));
  used += WIRE_CRC_BYTES;
  if (capacity < used + used / 254 + 2) {
    return FT_ERR_SPACE;
  }
  size_t out = cobs_encode(bytes, used, frame);
  frame[out++] = 0;
  *length = out;
  return FT_OK;
}

enum ft_status wire_decode(uint8_t *frame, size_t length, struct wire_packet *packet) {
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
  struct cursor cursor = {.at = frame + WIRE_HEADER_BYTES, .end = frame + used, .writing = false};
  if (!body_fields(&cursor, &decoded)) {
    *packet = decoded;
    return FT_ERR_TYPE;
  }
  if (cursor.failed || cursor.at != cursor.end) {
    return FT_ERR_FORMAT;
  }
  *packet = decoded;
  return FT_OK;
}

void wire_receiver_init(struct wire_receiver *receiver) {
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
  wire_receiver_init(receiver);
  if (overlong) {
    return FT_ERR_SPACE;
  }
  if (length == 0) {
    return FT_PENDING;
  }
  return wire_decode(receiver->frame, length, packet);
}
