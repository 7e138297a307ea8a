/* Commands for a fingertip, their values checked against the ranges of packet.h before anything is
 * sent. Each function throws Error with the allowed range. */
#pragma once

#include "libfingertip/wire.hpp"

#include <cstdint>
#include <string>
#include <vector>

#pragma GCC visibility push(default)
namespace fingertip {

/* Those of the streams that this firmware has. */
std::uint8_t possible_streams(const wire_info &info, std::uint8_t streams);

/* Sequence and time are filled in by whoever sends. */
wire_packet command_stream(std::uint8_t streams);
wire_packet command_tare(bool force = false); /* refused in contact unless forced */
wire_packet command_rate_mHz(std::uint32_t rate_mHz);
wire_packet command_osr(std::uint32_t osr);
wire_packet command_slip(float threshold_mm, std::uint32_t window_ms);
wire_packet command_info();
wire_packet command_health();
wire_packet command_crash();
wire_packet command_loader();
wire_packet command_calibrate(const calibration &calibration, std::uint8_t sensor_count);
wire_packet command_erase_calibration();
wire_packet command_keep(bool keep);                       /* the present settings, or none */
wire_packet command_prior(float sigma_mm, float width_mm); /* 0 and 0: none */
wire_packet command_location_limit(float limit_mm);
wire_packet command_pad(const pad_profile &profile);
wire_packet command_erase_pad();

/* Values as people type them. Each throws Error if the text is no number or out of range. */
std::uint32_t rate_mHz_from_text(const std::string &text); /* Hz, or "max" */
std::uint32_t osr_from_text(const std::string &text);
float slip_threshold_mm_from_text(const std::string &text);
std::uint32_t slip_window_ms_from_text(const std::string &text);
struct Prior {
  float sigma_mm, width_mm;
};
Prior prior_from_text(const std::string &text); /* "3.1", "3.1:0.5", or "none" */
float location_limit_mm_from_text(const std::string &text);

/* "3.1:0.5", or "none". */
std::string prior_text(const Prior &prior);

/* The bytes of a packet on the line, delimiter included. */
std::vector<std::uint8_t> frame_bytes(const wire_packet &packet);

/* The info command as another version of the protocol has it, delimiter included: who speaks that
 * version answers. */
std::vector<std::uint8_t> info_frame_of_version(std::uint8_t version);

} // namespace fingertip
#pragma GCC visibility pop
