/* Packets of every type for the tests, and a second COBS encoder, written from the paper. */
#ifndef WIRE_SAMPLES_H
#define WIRE_SAMPLES_H

#include "common/bytes.h"
#include "common/contact_flags.h"
#include "common/crc32.h"
#include "support/random.h"
#include "wire/packet.h"

#include <float.h>
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
  case SAMPLE_GREATEST:
    return UINT32_MAX;
  case SAMPLE_RANDOM:
    return random_u32(&sampler->random) >> random_below(&sampler->random, 32);
  default:
    return 0;
  }
}

static inline uint64_t sample_u64(struct sampler *sampler) {
  uint64_t high = sample_u32(sampler);
  return high << 32 | sample_u32(sampler);
}

static inline int32_t sample_i32(struct sampler *sampler) {
  switch (sampler->kind) {
  case SAMPLE_GREATEST:
    return INT32_MAX;
  case SAMPLE_LEAST:
    return INT32_MIN;
  default:
    return (int32_t)sample_u32(sampler);
  }
}

static inline int16_t sample_i16(struct sampler *sampler) { return (int16_t)(sample_i32(sampler) >> 16); }

/* Finite: the extremes, the smallest denormal, -0 and random bits. */
static inline float sample_f32(struct sampler *sampler) {
  switch (sampler->kind) {
  case SAMPLE_GREATEST:
    return FLT_MAX;
  case SAMPLE_LEAST:
    return -FLT_MAX;
  case SAMPLE_RANDOM:
    switch (random_below(&sampler->random, 8)) {
    case 0:
      return -0.0f;
    case 1:
      return bytes_to_f32(1);
    default: {
      uint32_t bits = random_u32(&sampler->random);
      return bytes_to_f32((bits & 0x7F800000u) == 0x7F800000u ? bits ^ 0x40000000u : bits);
    }
    }
  default:
    return 0.0f;
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
         : sampler->kind == SAMPLE_GREATEST ? FT_MAX_SENSORS
                                            : 1;
}

/* A quantity that is not valid is 0. */
static inline void sample_contact(struct sampler *sampler, struct wire_contact *contact) {
  contact->frame = sample_u32(sampler);
  contact->flags = sample_u32(sampler);
  contact->stages.convert_us = (uint16_t)sample_u32(sampler);
  contact->stages.read_us = (uint16_t)sample_u32(sampler);
  contact->stages.queue_us = (uint16_t)sample_u32(sampler);
  contact->stages.condition_us = (uint16_t)sample_u32(sampler);
  contact->stages.fit_us = (uint16_t)sample_u32(sampler);
  contact->stages.contact_us = (uint16_t)sample_u32(sampler);
  contact->stages.total_us = (uint16_t)sample_u32(sampler);
  if (contact->flags & CONTACT_FLAG_FIT_VALID) {
    contact->sensors_used = sample_u32(sampler);
    contact->x_mm = sample_f32(sampler);
    contact->y_mm = sample_f32(sampler);
    contact->p0_Pa = sample_f32(sampler);
    contact->sigma_mm = sample_f32(sampler);
    contact->force_N = sample_f32(sampler);
    contact->residual_rms_Pa = sample_f32(sampler);
  }
  if (contact->flags & CONTACT_FLAG_UNCERTAINTY_VALID) {
    contact->location_sd_mm = sample_f32(sampler);
    contact->force_sd_N = sample_f32(sampler);
  }
  if (contact->flags & CONTACT_FLAG_SLIP_VALID) {
    contact->slip_mm = sample_f32(sampler);
  }
  if (contact->flags & CONTACT_FLAG_WIDTHS_VALID) {
    contact->sigma_x_mm = sample_f32(sampler);
    contact->sigma_y_mm = sample_f32(sampler);
    contact->width_correlation = sample_f32(sampler);
  }
  if (contact->flags & CONTACT_FLAG_TANGENTIAL_VALID) {
    contact->qx_N = sample_f32(sampler);
    contact->qy_N = sample_f32(sampler);
    contact->q_sd_N = sample_f32(sampler);
    contact->tangential_ratio = sample_f32(sampler);
  }
  if (contact->flags & CONTACT_FLAG_VELOCITY_VALID) {
    contact->vx_mm_s = sample_f32(sampler);
    contact->vy_mm_s = sample_f32(sampler);
  }
  if (contact->flags & CONTACT_FLAG_SHAPE_VALID) {
    contact->shape_age_ms = sample_f32(sampler);
  }
  if (contact->flags & CONTACT_FLAG_TWO_CONTACTS) {
    contact->x1_mm = sample_f32(sampler);
    contact->y1_mm = sample_f32(sampler);
    contact->location1_sd_mm = sample_f32(sampler);
    contact->force1_N = sample_f32(sampler);
    contact->force1_sd_N = sample_f32(sampler);
    contact->x2_mm = sample_f32(sampler);
    contact->y2_mm = sample_f32(sampler);
    contact->location2_sd_mm = sample_f32(sampler);
    contact->force2_N = sample_f32(sampler);
    contact->force2_sd_N = sample_f32(sampler);
  }
  if (contact->flags & CONTACT_FLAG_EDGE) {
    contact->edge_angle_deg = sample_f32(sampler);
    contact->edge_angle_sd_deg = sample_f32(sampler);
    contact->edge_length_mm = sample_f32(sampler);
  }
}

static inline void sample_raw(struct sampler *sampler, struct wire_raw *raw) {
  raw->frame = sample_u32(sampler);
  raw->flags = sample_u32(sampler);
  raw->valid = sample_u32(sampler);
  raw->saturated = sample_u32(sampler);
  raw->doubtful = sample_u32(sampler);
  raw->temperature_cC = sample_i16(sampler);
  raw->sensor_count = sample_sensor_count(sampler);
  for (int k = 0; k < raw->sensor_count; k++) {
    raw->pressure_Pa_q10[k] = sample_i32(sampler);
    raw->baseline_Pa_q10[k] = sample_i32(sampler);
  }
}

static inline void sample_calibration(struct sampler *sampler, unsigned sensor_count, struct calibration *calibration) {
  calibration->date_s = sample_u32(sampler);
  calibration->placements = (uint16_t)sample_u32(sampler);
  calibration->force_scale = sample_f32(sampler);
  calibration->force_scale_sd = sample_f32(sampler);
  calibration->sigma_um = (uint16_t)sample_u32(sampler);
  calibration->sigma_sd_um = (uint16_t)sample_u32(sampler);
  calibration->dip_share_q16 = (uint16_t)sample_u32(sampler);
  calibration->dip_sd_um = (uint16_t)sample_u32(sampler);
  calibration->ambient_kPa = (uint8_t)sample_u32(sampler);
  for (unsigned k = 0; k < sensor_count; k++) {
    calibration->sensors[k].gain = sample_f32(sampler);
    calibration->sensors[k].gain_sd = sample_f32(sampler);
  }
  for (unsigned k = 0; k < sensor_count; k++) {
    calibration->sensors[k].off_x_um = sample_i16(sampler);
    calibration->sensors[k].off_y_um = sample_i16(sampler);
    calibration->sensors[k].wider_q15 = sample_i16(sampler);
  }
}

static inline void sample_pad(struct sampler *sampler, struct pad_profile *pad) {
  for (size_t i = 0; i < PAD_PROFILE_FLOATS; i++) {
    ((float *)(void *)pad)[i] = sample_f32(sampler);
  }
  pad->from_touch = (uint8_t)sample_u32(sampler);
}

static inline void sample_info(struct sampler *sampler, struct wire_info *info) {
  for (int i = 0; i < 3; i++) {
    info->firmware_version[i] = (uint8_t)sample_u32(sampler);
  }
  info->sensor_count = sample_sensor_count(sampler);
  sample_text(sampler, info->git_hash);
  sample_text(sampler, info->board);
  sample_text(sampler, info->scene);
  sample_text(sampler, info->serial);
  info->rate_mHz = sample_u32(sampler);
  info->measured_rate_mHz = sample_u32(sampler);
  info->osr = (uint16_t)sample_u32(sampler);
  info->temperature_interval_ms = (uint16_t)sample_u32(sampler);
  info->streams = (uint8_t)sample_u32(sampler);
  info->capabilities = sample_u32(sampler);
  if (info->capabilities & WIRE_CAPABILITY_FIT) {
    info->fit_iterations = (uint8_t)sample_u32(sampler);
  }
  if (info->capabilities & WIRE_CAPABILITY_SLIP) {
    info->slip_window_ms = (uint16_t)sample_u32(sampler);
    info->slip_threshold_mm = sample_f32(sampler);
  }
  info->pitch_mm = sample_f32(sampler);
  for (int k = 0; k < info->sensor_count; k++) {
    info->x_mm[k] = sample_f32(sampler);
    info->y_mm[k] = sample_f32(sampler);
  }
  if (info->capabilities & WIRE_CAPABILITY_FIT) {
    info->prior_sigma_mm = sample_f32(sampler);
    info->prior_width_mm = sample_f32(sampler);
    info->location_limit_mm = sample_f32(sampler);
  }
  if (info->capabilities & WIRE_CAPABILITY_SYNC) {
    info->sync = (uint8_t)sample_u32(sampler);
  }
  info->stored = sample_u32(sampler);
  if (info->stored & WIRE_STORED_CALIBRATION) {
    sample_calibration(sampler, info->sensor_count, &info->calibration);
  }
  if (info->stored & WIRE_STORED_PAD) {
    sample_pad(sampler, &info->pad);
  }
}

static inline void sample_health(struct sampler *sampler, struct wire_health *health) {
  uint32_t *counters[] = {&health->uptime_s,
                          &health->frames,
                          &health->frames_incomplete,
                          &health->frames_skipped,
                          &health->packets_sent,
                          &health->packets_dropped,
                          &health->commands_done,
                          &health->commands_rejected,
                          &health->bus_nacks,
                          &health->bus_timeouts,
                          &health->bus_recoveries,
                          &health->zero_readings,
                          &health->implausible_readings,
                          &health->capabilities,
                          &health->sensors_present,
                          &health->sensors_prom_bad,
                          &health->watchdog_resets};
  for (size_t i = 0; i < sizeof counters / sizeof counters[0]; i++) {
    *counters[i] = sample_u32(sampler);
  }
  health->cpu_busy_permille = (uint16_t)sample_u32(sampler);
  health->stack_free_bytes = (uint16_t)sample_u32(sampler);
  if (health->capabilities & WIRE_CAPABILITY_FIT) {
    health->fit_failures = sample_u32(sampler);
  }
}

static inline void sample_crash(struct sampler *sampler, struct crash_record *crash) {
  uint8_t *bytes[] = {&crash->kind, &crash->exception, &crash->vector, &crash->activity, &crash->stuck};
  for (size_t i = 0; i < sizeof bytes / sizeof bytes[0]; i++) {
    *bytes[i] = (uint8_t)sample_u32(sampler);
  }
  uint32_t *registers[] = {&crash->r0, &crash->r1, &crash->r2,   &crash->r3, &crash->r12,
                           &crash->lr, &crash->pc, &crash->xpsr, &crash->sp};
  for (size_t i = 0; i < sizeof registers / sizeof registers[0]; i++) {
    *registers[i] = sample_u32(sampler);
  }
  for (int i = 0; i < CRASH_EVENTS; i++) {
    crash->event_codes[i] = (uint8_t)sample_u32(sampler);
    crash->event_details[i] = (uint8_t)sample_u32(sampler);
    crash->event_ages_1024us[i] = sample_u32(sampler);
  }
  crash->t_us = sample_u64(sampler);
}

/* Every byte of the packet is defined, so that two of them may be compared as memory. */
static inline void sample_packet(struct sampler *sampler, uint8_t type, struct wire_packet *packet) {
  memset(packet, 0, sizeof *packet);
  packet->type = type;
  packet->sequence = (uint16_t)sample_u32(sampler);
  packet->t_us = sample_u64(sampler);
  switch (type) {
  case WIRE_CONTACT:
    sample_contact(sampler, &packet->body.contact);
    break;
  case WIRE_RAW:
    sample_raw(sampler, &packet->body.raw);
    break;
  case WIRE_INFO:
    sample_info(sampler, &packet->body.info);
    break;
  case WIRE_HEALTH:
    sample_health(sampler, &packet->body.health);
    break;
  case WIRE_CRASH:
    sample_crash(sampler, &packet->body.crash);
    break;
  case WIRE_SYNC:
    packet->body.sync.number = sample_u32(sampler);
    packet->body.sync.level = (uint8_t)sample_u32(sampler);
    break;
  case WIRE_CMD_SYNC:
    packet->body.cmd_sync.mode = (uint8_t)sample_u32(sampler);
    break;
  case WIRE_ACK:
    packet->body.ack.command = (uint8_t)sample_u32(sampler);
    packet->body.ack.result = (uint8_t)sample_u32(sampler);
    packet->body.ack.sequence = (uint16_t)sample_u32(sampler);
    packet->body.ack.host_time_us = sample_u64(sampler);
    break;
  case WIRE_CMD_STREAM:
    packet->body.cmd_stream.streams = (uint8_t)sample_u32(sampler);
    break;
  case WIRE_CMD_RATE:
    packet->body.cmd_rate.rate_mHz = sample_u32(sampler);
    break;
  case WIRE_CMD_OSR:
    packet->body.cmd_osr.osr = (uint16_t)sample_u32(sampler);
    break;
  case WIRE_CMD_SLIP:
    packet->body.cmd_slip.threshold_mm = sample_f32(sampler);
    packet->body.cmd_slip.window_ms = (uint16_t)sample_u32(sampler);
    break;
  case WIRE_CMD_LOADER:
    packet->body.cmd_loader.magic = sample_u32(sampler);
    break;
  case WIRE_CMD_CALIBRATE:
    packet->body.cmd_calibrate.sensor_count = sample_sensor_count(sampler);
    sample_calibration(sampler, packet->body.cmd_calibrate.sensor_count, &packet->body.cmd_calibrate.calibration);
    break;
  case WIRE_CMD_TARE:
    packet->body.cmd_tare.force = (uint8_t)sample_u32(sampler);
    break;
  case WIRE_CMD_KEEP:
    packet->body.cmd_keep.keep = (uint8_t)sample_u32(sampler);
    break;
  case WIRE_CMD_PRIOR:
    packet->body.cmd_prior.sigma_mm = sample_f32(sampler);
    packet->body.cmd_prior.width_mm = sample_f32(sampler);
    break;
  case WIRE_CMD_LOCATION_LIMIT:
    packet->body.cmd_location_limit.limit_mm = sample_f32(sampler);
    break;
  case WIRE_CMD_PAD:
    sample_pad(sampler, &packet->body.cmd_pad.profile);
    break;
  default:
    break;
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

#endif
