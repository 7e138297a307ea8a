/* Commands for a fingertip, their values checked against the ranges of packet.h before anything is
 * sent. Each function throws Error with the allowed range. */
#pragma once

#include "libfingertip/wire.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#pragma GCC visibility push(default)
namespace fingertip {

/* Those of the streams that this firmware has. */
std::uint8_t possible_streams(const wire_info &info, std::uint8_t streams);

/* The sender fills in sequence and time. */
wire_packet command_stream(std::uint8_t streams);
wire_packet command_tare(bool force = false); /* refused in contact unless forced */
wire_packet command_info();
wire_packet command_health();
wire_packet command_crash();
wire_packet command_loader();
wire_packet command_calibrate(const calibration &calibration, std::uint8_t sensor_count);
wire_packet command_erase_calibration();
wire_packet command_keep(bool keep); /* the present settings, or none */
wire_packet command_pad(const pad_profile &profile);
wire_packet command_erase_pad();

/* Settings as people type them, "rate=20" or "prior=3.1:0.5". firmware/wire/line.toml lists them with their ranges. */
struct Setting;
using SettingValues = std::array<double, 2>; /* in the units of the packet */
struct WantedSetting {
  const Setting *setting;
  SettingValues values;
};
/* Throws Error if it is no setting, no number or out of range. */
WantedSetting setting_from_text(const std::string &text);
/* The commands for these settings. A value that travels with a wanted one, and is not wanted, stays as it is now. */
std::vector<wire_packet> setting_commands(const std::vector<WantedSetting> &wanted, const wire_info &now);
/* "rate=20.000 osr=1024 ...": the settings that this firmware has. */
std::string settings_text(const wire_info &info);
/* "rate=HZ|max (0.1 to 2000), ..." */
std::string settings_help();

/* The bytes of a packet on the line, delimiter included. */
std::vector<std::uint8_t> frame_bytes(const wire_packet &packet);

/* The info command in another version of the protocol, delimiter included: a fingertip that speaks that version answers. */
std::vector<std::uint8_t> info_frame_of_version(std::uint8_t version);

} // namespace fingertip
#pragma GCC visibility pop
