/* Packets with every field set, each field different, for tests of the host tools. */
#pragma once

#include "libfingertip/wire.hpp"

#include <cstring>
#include <fstream>
#include <sstream>
#include <string>
#include <unistd.h>

namespace test {

inline wire_packet make_packet(wire_type type, std::uint16_t sequence, std::uint64_t t_us) {
  wire_packet packet;
  std::memset(&packet, 0, sizeof packet);
  packet.type = static_cast<std::uint8_t>(type);
  packet.sequence = sequence;
  packet.t_us = t_us;
  return packet;
}

inline wire_packet make_contact(std::uint16_t sequence, std::uint64_t t_us, std::uint32_t frame) {
  wire_packet packet = make_packet(WIRE_CONTACT, sequence, t_us);
  wire_contact &contact = packet.body.contact;
  contact.frame = frame;
  contact.flags = CONTACT_FLAG_CONTACT | CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_UNCERTAINTY_VALID | CONTACT_FLAG_SLIP_VALID |
                  CONTACT_FLAG_TARED | CONTACT_FLAG_WIDTHS_VALID | CONTACT_FLAG_TANGENTIAL_VALID | CONTACT_FLAG_VELOCITY_VALID |
                  CONTACT_FLAG_SHAPE_VALID | CONTACT_FLAG_EDGE;
  contact.sensors_used = 0x7FFF;
  contact.x_mm = 0.1f + static_cast<float>(frame % 10);
  contact.y_mm = -3.3333333f;
  contact.p0_Pa = 41234.567f;
  contact.sigma_mm = 5.7000003f;
  contact.force_N = 1.0e-7f;
  contact.slip_mm = 0.75f;
  contact.residual_rms_Pa = 12.5f;
  contact.location_sd_mm = 0.0123456f;
  contact.force_sd_N = 3.0e-5f;
  contact.sigma_x_mm = 5.9f;
  contact.sigma_y_mm = 5.4000001f;
  contact.width_correlation = -0.03f;
  contact.qx_N = -0.31234567f;
  contact.qy_N = 1.0e-9f;
  contact.q_sd_N = 0.0123f;
  contact.tangential_ratio = 0.29999998f;
  contact.vx_mm_s = 123.45678f;
  contact.vy_mm_s = -0.007f;
  contact.shape_age_ms = 2.296f;
  contact.edge_angle_deg = -37.123456f;
  contact.edge_angle_sd_deg = 0.7f;
  contact.edge_length_mm = 18.25f;
  contact.stages = {2501, 3206, 1449, 23, 6918, 30, 14127};
  return packet;
}

inline wire_packet make_raw(std::uint16_t sequence, std::uint64_t t_us, std::uint32_t frame, std::uint8_t sensor_count = 15) {
  wire_packet packet = make_packet(WIRE_RAW, sequence, t_us);
  wire_raw &raw = packet.body.raw;
  raw.frame = frame;
  raw.flags = CONTACT_FLAG_CONTACT | CONTACT_FLAG_TARED;
  raw.valid = 0x7FFE;
  raw.saturated = 0x4000;
  raw.doubtful = 0x0010;
  raw.temperature_cC = -1234;
  raw.sensor_count = sensor_count;
  for (int k = 0; k < sensor_count; k++) {
    raw.pressure_Pa_q10[k] = 101325 * 1024 + 7 * k + 1;
    raw.baseline_Pa_q10[k] = k % 2 ? -k : 101325 * 1024 - k;
  }
  return packet;
}

inline calibration make_calibration() {
  calibration made{};
  made.date_s = 1785931200;
  made.placements = 30;
  made.force_scale = 1.0625f;
  made.force_scale_sd = 0.021f;
  for (int k = 0; k < 15; k++) {
    made.sensors[k] = {0.86f + 0.02f * static_cast<float>(k), 0.008f + 0.0001f * static_cast<float>(k),
                       static_cast<std::int16_t>(100 * k - 700), static_cast<std::int16_t>(-20 * k),
                       static_cast<std::int16_t>(1000 - 300 * k)};
  }
  return made;
}

inline wire_packet make_info(std::uint16_t sequence, std::uint64_t t_us) {
  wire_packet packet = make_packet(WIRE_INFO, sequence, t_us);
  wire_info &info = packet.body.info;
  info.firmware_version[0] = 1;
  info.firmware_version[1] = 20;
  info.firmware_version[2] = 3;
  info.sensor_count = 15;
  info.capabilities = WIRE_CAPABILITY_FIT | WIRE_CAPABILITY_SLIP | WIRE_CAPABILITY_RAW_STREAM;
  std::memcpy(info.git_hash, "0123456789ab+", 13);
  std::memcpy(info.board, "pico_mux", 8);
  std::memcpy(info.scene, "slip", 4);
  std::memcpy(info.serial, "E660583883265A2C", 16);
  info.rate_mHz = 20000;
  info.measured_rate_mHz = 19998;
  info.osr = 1024;
  info.temperature_interval_ms = 500;
  info.slip_window_ms = 100;
  info.fit_iterations = 7;
  info.streams = 3;
  info.slip_threshold_mm = 0.75f;
  info.pitch_mm = 9;
  for (int k = 0; k < 15; k++) {
    info.x_mm[k] = 9.0f * static_cast<float>(k / 5 - 1);
    info.y_mm[k] = 9.0f * static_cast<float>(k % 5 - 2);
  }
  info.prior_sigma_mm = 3.1f;
  info.prior_width_mm = 0.5f;
  info.location_limit_mm = 0.6f;
  return packet;
}

inline wire_packet make_health(std::uint16_t sequence, std::uint64_t t_us) {
  wire_packet packet = make_packet(WIRE_HEALTH, sequence, t_us);
  packet.body.health = {7, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 14, 0x7FFF, 15, 0xFFFFFFFFu, 17, 18, 13};
  return packet;
}

/* A hard fault in a fit. */
inline wire_packet make_crash(std::uint16_t sequence, std::uint64_t t_us) {
  wire_packet packet = make_packet(WIRE_CRASH, sequence, t_us);
  crash_record &crash = packet.body.crash;
  crash.kind = CRASH_FAULT;
  crash.vector = 3;
  crash.activity = CRASH_AT_FIT;
  crash.event_codes[0] = CRASH_EVENT_COMMAND;
  crash.event_details[0] = WIRE_CMD_STREAM;
  crash.event_ages_1024us[0] = 1465;
  crash.event_codes[1] = CRASH_EVENT_START;
  crash.event_ages_1024us[1] = 244141;
  crash.r0 = 1;
  crash.lr = 0x20001235;
  crash.pc = 0x20001000;
  crash.xpsr = 0x01000000;
  crash.sp = 0x20041f00;
  crash.t_us = 250000000;
  return packet;
}

inline wire_packet make_ack(std::uint16_t sequence, std::uint64_t t_us, std::uint8_t command, std::uint8_t result,
                            std::uint16_t command_sequence, std::uint64_t host_time_us) {
  wire_packet packet = make_packet(WIRE_ACK, sequence, t_us);
  packet.body.ack = {command, result, command_sequence, host_time_us};
  return packet;
}

/* A folder that goes when the test ends. */
class TemporaryFolder {
public:
  TemporaryFolder() {
    char name[] = "/tmp/fingertip-test-XXXXXX";
    path_ = mkdtemp(name);
  }
  ~TemporaryFolder() {
    std::string command = "rm -rf '" + path_ + "'";
    if (system(command.c_str()) != 0) {
      perror("rm");
    }
  }
  std::string operator/(const std::string &name) const { return path_ + "/" + name; }
  const std::string &path() const { return path_; }

private:
  std::string path_;
};

inline std::string contents(const std::string &path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

} // namespace test
