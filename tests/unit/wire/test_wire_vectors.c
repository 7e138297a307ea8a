/* The byte images of tests/vectors/wire, assembled by hand from PROTOCOL.md, against the codec. */
#include "common/contact_flags.h"
#include "support/unit.h"
#include "wire/packet.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>

struct vector {
  uint8_t packet[WIRE_MAX_PACKET_BYTES], frame[WIRE_MAX_FRAME_BYTES];
  size_t packet_length, frame_length;
};

static struct vector read_vector(const char *name) {
  struct vector vector = {.packet_length = 0};
  char path[512];
  snprintf(path, sizeof path, "%s%s", VECTORS, name);
  FILE *file = fopen(path, "r");
  TEST_ASSERT_NOT_NULL_MESSAGE(file, path);
  uint8_t *to = NULL;
  size_t *length = NULL;
  size_t capacity = 0;
  char line[256];
  while (fgets(line, sizeof line, file)) {
    line[strcspn(line, "#\n")] = '\0';
    for (char *word = strtok(line, " "); word; word = strtok(NULL, " ")) {
      if (strcmp(word, "packet") == 0) {
        to = vector.packet;
        length = &vector.packet_length;
        capacity = sizeof vector.packet;
      } else if (strcmp(word, "frame") == 0) {
        to = vector.frame;
        length = &vector.frame_length;
        capacity = sizeof vector.frame;
      } else {
        TEST_ASSERT_TRUE_MESSAGE(
            strlen(word) == 2 && isxdigit((unsigned char)word[0]) && isxdigit((unsigned char)word[1]) && length, path);
        TEST_ASSERT_LESS_THAN_size_t(capacity, *length);
        unsigned value;
        TEST_ASSERT_EQUAL_INT(1, sscanf(word, "%x", &value));
        to[(*length)++] = (uint8_t)value;
      }
    }
  }
  fclose(file);
  TEST_ASSERT_GREATER_THAN_size_t(0, vector.frame_length);
  return vector;
}

/* The frame is the packet under COBS and a delimiter, and both say what expected says. */
static void check(const char *name, const struct wire_packet *expected) {
  struct vector vector = read_vector(name);
  uint8_t frame[WIRE_MAX_FRAME_BYTES];
  size_t length = 0;
  TEST_ASSERT_EQUAL_INT_MESSAGE(
      FT_OK, wire_encode(wire_find_layout(wire_all_layouts, expected->type), expected, frame, &length), name);
  TEST_ASSERT_EQUAL_size_t_MESSAGE(vector.frame_length, length, name);
  TEST_ASSERT_EQUAL_HEX8_ARRAY_MESSAGE(vector.frame, frame, length, name);

  struct wire_packet decoded;
  TEST_ASSERT_EQUAL_INT_MESSAGE(FT_OK, wire_decode(wire_all_layouts, frame, length - 1, &decoded), name);
  TEST_ASSERT_EQUAL_MEMORY_MESSAGE(expected, &decoded, sizeof decoded, name);
  /* wire_decode has left the packet itself in the buffer. */
  TEST_ASSERT_EQUAL_HEX8_ARRAY_MESSAGE(vector.packet, frame, vector.packet_length, name);
}

static struct wire_packet blank(uint8_t type, uint16_t sequence, uint64_t t_us) {
  struct wire_packet packet;
  memset(&packet, 0, sizeof packet);
  packet.type = type;
  packet.sequence = sequence;
  packet.t_us = t_us;
  return packet;
}

TEST(test_crash) {
  struct wire_packet packet = blank(0x06, 0x0201, UINT64_C(1234567));
  packet.body.crash = (struct crash_record){
      .kind = CRASH_WATCHDOG,
      .exception = 0x10,
      .vector = 0x12,
      .activity = CRASH_AT_FIT,
      .stuck = CRASH_STUCK_MAIN | CRASH_STUCK_USB,
      .event_codes = {8, 2, 1},
      .event_details = {5, 0x80, 0},
      .r0 = 0x01020304,
      .r1 = 0x11121314,
      .r2 = 0x21222324,
      .r3 = 0x31323334,
      .r12 = 0x41424344,
      .lr = 0x20001235,
      .pc = 0x20004321,
      .xpsr = 0x61000010,
      .sp = 0x20041FA8,
      .event_ages_1024us = {250, 70000, 4294967295u},
      .t_us = UINT64_C(0x0102030405060708),
  };
  check("crash.txt", &packet);

  packet = blank(0x8F, 0x0302, 77);
  check("command_crash.txt", &packet);
}

TEST(test_contact) {
  struct wire_packet packet = blank(0x01, 0xA1B2, UINT64_C(123456789012));
  packet.body.contact = (struct wire_contact){
      .frame = 70000,
      .flags = CONTACT_FLAG_CONTACT | CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_UNCERTAINTY_VALID |
               CONTACT_FLAG_SLIP_VALID | CONTACT_FLAG_TARED | CONTACT_FLAG_LOW_SIGNAL | CONTACT_FLAG_SENSOR_MASKED |
               CONTACT_FLAG_WIDTHS_VALID | CONTACT_FLAG_CALIBRATED | CONTACT_FLAG_TANGENTIAL_VALID |
               CONTACT_FLAG_TANGENTIAL_FROM_TOUCH | CONTACT_FLAG_VELOCITY_VALID | CONTACT_FLAG_MOVING,
      .sensors_used = 0x7FEF,
      .x_mm = -4.5f,
      .y_mm = 12.25f,
      .p0_Pa = 7500.0f,
      .sigma_mm = 5.625f,
      .force_N = 1.5f,
      .slip_mm = 0.375f,
      .residual_rms_Pa = 17.5f,
      .location_sd_mm = 0.015625f,
      .force_sd_N = 0.00390625f,
      .sigma_x_mm = 5.75f,
      .sigma_y_mm = 5.5f,
      .width_correlation = -0.125f,
      .qx_N = -0.4375f,
      .qy_N = 0.1875f,
      .q_sd_N = 0.03125f,
      .tangential_ratio = 0.3125f,
      .vx_mm_s = -17.5f,
      .vy_mm_s = 2.25f,
      .stages = {2300, 3001, 12, 34, 2760, 56, 8163},
  };
  check("contact_grasp.txt", &packet);

  struct wire_contact *contact = &packet.body.contact;
  contact->flags &= ~(uint32_t)(CONTACT_FLAG_TANGENTIAL_VALID | CONTACT_FLAG_TANGENTIAL_FROM_TOUCH |
                                CONTACT_FLAG_VELOCITY_VALID | CONTACT_FLAG_MOVING);
  contact->qx_N = contact->qy_N = contact->q_sd_N = contact->tangential_ratio = 0.0f;
  contact->vx_mm_s = contact->vy_mm_s = 0.0f;
  check("contact.txt", &packet);

  contact->flags &= ~(uint32_t)(CONTACT_FLAG_SLIP_VALID | CONTACT_FLAG_WIDTHS_VALID | CONTACT_FLAG_CALIBRATED);
  contact->slip_mm = 0.0f;
  contact->sigma_x_mm = contact->sigma_y_mm = contact->width_correlation = 0.0f;
  check("contact_press.txt", &packet);

  const struct wire_contact press = *contact;
  contact->flags |= CONTACT_FLAG_SHAPE_VALID | CONTACT_FLAG_TWO_CONTACTS;
  contact->shape_age_ms = 1.53125f;
  contact->x1_mm = -5.25f;
  contact->y1_mm = 7.5f;
  contact->location1_sd_mm = 0.09375f;
  contact->force1_N = 4.5f;
  contact->force1_sd_N = 0.0625f;
  contact->x2_mm = 3.75f;
  contact->y2_mm = -2.125f;
  contact->location2_sd_mm = 0.1875f;
  contact->force2_N = 2.25f;
  contact->force2_sd_N = 0.03125f;
  check("contact_two.txt", &packet);

  *contact = press;
  contact->flags |= CONTACT_FLAG_SHAPE_VALID | CONTACT_FLAG_EDGE;
  contact->shape_age_ms = 2.296875f;
  contact->edge_angle_deg = -37.5f;
  contact->edge_angle_sd_deg = 1.125f;
  contact->edge_length_mm = 18.25f;
  check("contact_edge.txt", &packet);

  *contact = (struct wire_contact){.frame = contact->frame, .flags = CONTACT_FLAG_TARED, .stages = contact->stages};
  check("contact_none.txt", &packet);
}

TEST(test_raw) {
  struct wire_packet packet = blank(0x02, UINT16_MAX, UINT64_C(0x100000000));
  struct wire_raw *raw = &packet.body.raw;
  raw->frame = 256;
  raw->flags = CONTACT_FLAG_CONTACT | CONTACT_FLAG_TARED | CONTACT_FLAG_SATURATED | CONTACT_FLAG_SENSOR_MASKED;
  raw->valid = 5;
  raw->saturated = 4;
  raw->doubtful = 1;
  raw->temperature_cC = -125;
  raw->sensor_count = 3;
  raw->pressure_Pa_q10[0] = 100000 * 1024;
  raw->baseline_Pa_q10[0] = 102300001;
  raw->baseline_Pa_q10[1] = -1;
  raw->pressure_Pa_q10[2] = INT32_MAX;
  raw->baseline_Pa_q10[2] = INT32_MIN;
  check("raw.txt", &packet);
}

static struct calibration calibration_of_two(void) {
  return (struct calibration){
      .date_s = 1785931200,
      .placements = 30,
      .force_scale = 1.0625f,
      .force_scale_sd = 0.03125f,
      .sigma_um = 5552,
      .sigma_sd_um = 60,
      .dip_share_q16 = 3277,
      .dip_sd_um = 13954,
      .ambient_kPa = 101,
      .sensors = {{0.875f, 0.0078125f, 250, -125, 1638}, {1.125f, 0.015625f, -2000, 2000, -9830}},
  };
}

/* Every value has its own. */
static struct pad_profile some_pad(void) {
  return (struct pad_profile){
      .thickness_mm = 12.0f,
      .overhang_mm = 9.0f,
      .normal = {{0.09375f, 3.5f}, {0.8125f, 5.75f}},
      .tangential = {{1.125f, 4.875f}, {4.0f, 8.0f}, {5.5f, 20.375f}},
      .spread_mm2 = 4.25f,
      .spread_sd_mm2 = 6.0f,
      .force_ratio = 0.9375f,
      .tangential_scale = 1.0625f,
      .tangential_scale_sd = 0.03125f,
      .edges =
          {
              .ratio_x = {0.125f, -0.0625f, 0.25f},
              .ratio_y = {0.375f, 0.0078125f, -0.5f},
              .gain_x = {1.25f, -0.3125f, 0.015625f},
              .gain_y = {0.75f, -0.1875f, 0.046875f},
              .place_x_mm = {0.625f, -1.0f, 2.0f},
              .place_y_mm = {1.75f, -2.25f, 3.0f},
              .pull_x_mm = {-3.25f, 3.5f, 0.21875f},
              .pull_y_mm = {-1.5f, 0.65625f, 0.6875f},
              .force = {-0.09375f, 0.28125f, 0.0390625f},
          },
      .from_touch = 1,
  };
}

TEST(test_info) {
  struct wire_packet packet = blank(0x03, 7, 1000000);
  struct wire_info *info = &packet.body.info;
  memcpy(info->firmware_version, "\1\2\3", 3);
  info->sensor_count = 2;
  info->capabilities = WIRE_CAPABILITY_FIT | WIRE_CAPABILITY_SLIP | WIRE_CAPABILITY_RAW_STREAM;
  memcpy(info->git_hash, "0123456789ab+", 13);
  memcpy(info->board, "pico_mux", 8);
  memcpy(info->scene, "slip", 4);
  memcpy(info->serial, "E66058388347A12C", 16);
  info->rate_mHz = 20000;
  info->measured_rate_mHz = 19998;
  info->osr = 1024;
  info->temperature_interval_ms = 500;
  info->slip_window_ms = 100;
  info->fit_iterations = 7;
  info->streams = WIRE_STREAM_CONTACT | WIRE_STREAM_RAW;
  info->slip_threshold_mm = 0.75f;
  info->pitch_mm = 9.0f;
  info->x_mm[0] = -4.5f;
  info->y_mm[0] = -18.0f;
  info->x_mm[1] = 4.5f;
  info->y_mm[1] = 18.0f;
  info->prior_sigma_mm = 3.125f;
  info->prior_width_mm = 0.5f;
  info->location_limit_mm = 0.625f;
  info->stored = WIRE_STORED_CALIBRATION | WIRE_STORED_SETTINGS;
  info->calibration = calibration_of_two();
  check("info.txt", &packet);

  info->capabilities |= WIRE_CAPABILITY_SYNC;
  info->sync = 2;
  check("info_sync.txt", &packet);
  info->capabilities &= ~(uint32_t)WIRE_CAPABILITY_SYNC;
  info->sync = 0;

  memcpy(info->scene, "grasp", 5);
  info->capabilities |= WIRE_CAPABILITY_TANGENTIAL;
  info->stored |= WIRE_STORED_PAD;
  info->pad = some_pad();
  check("info_grasp.txt", &packet);
  memset(&info->pad, 0, sizeof info->pad);

  memcpy(info->scene, "press", 5);
  info->capabilities = WIRE_CAPABILITY_FIT;
  info->streams = WIRE_STREAM_CONTACT;
  info->stored = WIRE_STORED_WRITING | WIRE_STORED_DAMAGED;
  memset(&info->calibration, 0, sizeof info->calibration);
  info->slip_window_ms = 0;
  info->slip_threshold_mm = 0.0f;
  check("info_press.txt", &packet);

  memcpy(info->scene, "raw\0", 5);
  info->capabilities = WIRE_CAPABILITY_RAW_STREAM;
  info->streams = WIRE_STREAM_RAW;
  info->fit_iterations = 0;
  info->prior_sigma_mm = info->prior_width_mm = info->location_limit_mm = 0.0f;
  info->stored = 0;
  check("info_raw.txt", &packet);
}

TEST(test_health) {
  struct wire_packet packet = blank(0x04, 8, 2000000);
  packet.body.health = (struct wire_health){
      .capabilities = WIRE_CAPABILITY_FIT | WIRE_CAPABILITY_SLIP | WIRE_CAPABILITY_RAW_STREAM,
      .uptime_s = 0x01010100,
      .frames = 0x02020201,
      .frames_incomplete = 0x03030302,
      .frames_skipped = 0x66554433,
      .packets_sent = 0x04040403,
      .packets_dropped = 0x05050504,
      .commands_done = 0x06060605,
      .commands_rejected = 0x07070706,
      .bus_nacks = 0x08080807,
      .bus_timeouts = 0x09090908,
      .bus_recoveries = 0x0A0A0A09,
      .zero_readings = 0x0B0B0B0A,
      .implausible_readings = 0x1A1B1C1D,
      .fit_failures = 0x0C0C0C0B,
      .sensors_present = 0x0D0D0D0C,
      .sensors_prom_bad = 0x0E0E0E0D,
      .watchdog_resets = 0x0F0F0F0E,
      .cpu_busy_permille = 425,
      .stack_free_bytes = 1536,
  };
  check("health.txt", &packet);

  packet.body.health.capabilities = WIRE_CAPABILITY_RAW_STREAM;
  packet.body.health.fit_failures = 0;
  check("health_raw.txt", &packet);
}

TEST(test_sync) {
  struct wire_packet packet = blank(0x07, 45, 123456789);
  packet.body.sync = (struct wire_sync){.number = 3, .level = 1};
  check("sync.txt", &packet);

  packet = blank(0x90, 46, 60000);
  packet.body.cmd_sync.mode = 3;
  check("command_sync.txt", &packet);
}

TEST(test_acknowledgement) {
  struct wire_packet packet = blank(0x05, 9, 3000000);
  packet.body.ack.command = 0x84;
  packet.body.ack.result = WIRE_RESULT_OUT_OF_RANGE;
  packet.body.ack.sequence = 0x0102;
  packet.body.ack.host_time_us = UINT64_C(0x1122334455667788);
  check("acknowledgement.txt", &packet);
}

TEST(test_commands) {
  struct wire_packet packet = blank(0x84, 0x0102, UINT64_C(0x1122334455667788));
  packet.body.cmd_slip.threshold_mm = 0.75f;
  packet.body.cmd_slip.window_ms = 100;
  check("command_slip.txt", &packet);
  packet = blank(0x80, 1, 10);
  packet.body.cmd_stream.streams = WIRE_STREAM_ALL;
  check("command_stream.txt", &packet);
  packet = blank(0x81, 0, 0);
  packet.body.cmd_tare.force = 1;
  check("command_tare.txt", &packet);
  packet = blank(0x82, 2, 20);
  packet.body.cmd_rate.rate_mHz = WIRE_RATE_MAX_mHz;
  check("command_rate.txt", &packet);
  packet = blank(0x83, 3, 30);
  packet.body.cmd_osr.osr = 8192;
  check("command_osr.txt", &packet);
  packet = blank(0x85, 4, 40);
  check("command_info.txt", &packet);
  packet = blank(0x86, 5, 50);
  check("command_health.txt", &packet);
  packet = blank(0x87, 6, 60);
  packet.body.cmd_loader.magic = WIRE_LOADER_MAGIC;
  check("command_loader.txt", &packet);
  packet = blank(0x88, 7, 70);
  packet.body.cmd_calibrate.sensor_count = 2;
  packet.body.cmd_calibrate.calibration = calibration_of_two();
  check("command_calibrate.txt", &packet);
  packet = blank(0x89, 8, 80);
  check("command_erase_calibration.txt", &packet);
  packet = blank(0x8A, 9, 90);
  packet.body.cmd_keep.keep = 1;
  check("command_keep.txt", &packet);
  packet = blank(0x8B, 10, 100);
  packet.body.cmd_prior.sigma_mm = 3.125f;
  packet.body.cmd_prior.width_mm = 0.5f;
  check("command_prior.txt", &packet);
  packet = blank(0x8C, 11, 110);
  packet.body.cmd_location_limit.limit_mm = 0.625f;
  check("command_location_limit.txt", &packet);
  packet = blank(0x8D, 12, 120);
  packet.body.cmd_pad.profile = some_pad();
  check("command_pad.txt", &packet);
  packet = blank(0x8E, 13, 130);
  check("command_erase_pad.txt", &packet);
}
