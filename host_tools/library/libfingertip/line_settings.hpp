/* written by firmware/wire/line.py from line.toml; change it there.
 *
 * How people type the settings, and where packets have them. For command.cpp alone. */
#pragma once

#include "libfingertip/wire.hpp"

#include <cstddef>
#include <cstdint>

namespace fingertip {

struct SettingValue {
  double least, most; /* in a packet; that is `per` times what people type */
  const unsigned *choices; /* no other; up to a 0; nullptr: all */
  const char *const *words; /* what people type for each choice; nullptr: the number */
  double unless_given; /* 0: it has to be given */
  unsigned per;
  bool whole;
  double (*now)(const wire_info &info);
  void (*put)(wire_packet &command, double value);
};

struct Setting {
  const char *name, *typed, *help, *give;
  const char *zeros; /* the word for zeros; nullptr: there is none */
  wire_type command;
  std::uint32_t capability; /* 0: every firmware has it */
  std::size_t count;
  SettingValue values[2];
};

inline constexpr unsigned osr_choices[] = {256, 512, 1024, 2048, 4096, 8192, 0};
inline constexpr unsigned sync_choices[] = {1, 2, 3, 0};
inline constexpr const char *sync_words[] = {"in", "frame", "second"};

inline constexpr Setting all_settings[] = {
    {"rate", "HZ|max", "rate=HZ|max (0.1 to 2000)", "0.1 to 2000 Hz, or max", "max", WIRE_CMD_RATE, 0, 1,
     {
         {WIRE_RATE_MIN_mHz, WIRE_RATE_MAX_mHz, nullptr, nullptr,
          0, 1000, true,
          [](const wire_info &info) -> double { return info.rate_mHz; },
          [](wire_packet &command, double value) { command.body.cmd_rate.rate_mHz = static_cast<std::uint32_t>(value); }},
     }},
    {"osr", "N", "osr=256|512|1024|2048|4096|8192", "256, 512, 1024, 2048, 4096 or 8192", nullptr, WIRE_CMD_OSR, 0, 1,
     {
         {WIRE_OSR_MIN, WIRE_OSR_MAX, osr_choices, nullptr,
          0, 1, true,
          [](const wire_info &info) -> double { return info.osr; },
          [](wire_packet &command, double value) { command.body.cmd_osr.osr = static_cast<std::uint16_t>(value); }},
     }},
    {"slip_threshold", "MM", "slip_threshold=MM (0.01 to 50)", "0.01 to 50 mm", nullptr, WIRE_CMD_SLIP, WIRE_CAPABILITY_SLIP, 1,
     {
         {WIRE_SLIP_THRESHOLD_MIN_mm, WIRE_SLIP_THRESHOLD_MAX_mm, nullptr, nullptr,
          0, 1, false,
          [](const wire_info &info) -> double { return info.slip_threshold_mm; },
          [](wire_packet &command, double value) { command.body.cmd_slip.threshold_mm = static_cast<float>(value); }},
     }},
    {"slip_window", "MS", "slip_window=MS (5 to 1000, and 160 frames at most)", "5 to 1000 ms", nullptr, WIRE_CMD_SLIP, WIRE_CAPABILITY_SLIP, 1,
     {
         {WIRE_SLIP_WINDOW_MIN_ms, WIRE_SLIP_WINDOW_MAX_ms, nullptr, nullptr,
          0, 1, true,
          [](const wire_info &info) -> double { return info.slip_window_ms; },
          [](wire_packet &command, double value) { command.body.cmd_slip.window_ms = static_cast<std::uint16_t>(value); }},
     }},
    {"prior", "SIGMA[:WIDTH]|none", "prior=SIGMA[:WIDTH]|none (mm, 0.5 to 100, 0.01 to 100; width 0.5)", "SIGMA or SIGMA:WIDTH, 0.5 to 100 and 0.01 to 100 mm, or none", "none", WIRE_CMD_PRIOR, WIRE_CAPABILITY_FIT, 2,
     {
         {WIRE_PRIOR_SIGMA_MIN_mm, WIRE_PRIOR_SIGMA_MAX_mm, nullptr, nullptr,
          0, 1, false,
          [](const wire_info &info) -> double { return info.prior_sigma_mm; },
          [](wire_packet &command, double value) { command.body.cmd_prior.sigma_mm = static_cast<float>(value); }},
         {WIRE_PRIOR_WIDTH_MIN_mm, WIRE_PRIOR_WIDTH_MAX_mm, nullptr, nullptr,
          WIRE_PRIOR_WIDTH_DEFAULT_mm, 1, false,
          [](const wire_info &info) -> double { return info.prior_width_mm; },
          [](wire_packet &command, double value) { command.body.cmd_prior.width_mm = static_cast<float>(value); }},
     }},
    {"limit", "MM", "limit=MM (of location_sd_mm, 0.01 to 100)", "0.01 to 100 mm", nullptr, WIRE_CMD_LOCATION_LIMIT, WIRE_CAPABILITY_FIT, 1,
     {
         {WIRE_LOCATION_LIMIT_MIN_mm, WIRE_LOCATION_LIMIT_MAX_mm, nullptr, nullptr,
          0, 1, false,
          [](const wire_info &info) -> double { return info.location_limit_mm; },
          [](wire_packet &command, double value) { command.body.cmd_location_limit.limit_mm = static_cast<float>(value); }},
     }},
    {"sync", "MODE|off", "sync=in|frame|second|off", "in, frame, second, or off", "off", WIRE_CMD_SYNC, WIRE_CAPABILITY_SYNC, 1,
     {
         {WIRE_SYNC_MIN, WIRE_SYNC_MAX, sync_choices, sync_words,
          0, 1, true,
          [](const wire_info &info) -> double { return info.sync; },
          [](wire_packet &command, double value) { command.body.cmd_sync.mode = static_cast<std::uint8_t>(value); }},
     }},
};

} // namespace fingertip
