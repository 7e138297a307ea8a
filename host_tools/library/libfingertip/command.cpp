#include "libfingertip/command.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/framing.hpp"
#include "libfingertip/line_settings.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>

namespace fingertip {

static wire_packet packet_of(wire_type type) {
  wire_packet packet;
  std::memset(&packet, 0, sizeof packet);
  packet.type = static_cast<std::uint8_t>(type);
  return packet;
}

static std::string spoken(const Setting &setting) {
  std::string name = setting.name;
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

/* The word of a choice; nullptr: there is no such choice, or people type its number. */
static const char *word_of(const SettingValue &value, double number) {
  for (std::size_t i = 0; value.words && value.choices[i]; i++) {
    if (value.choices[i] == number) {
      return value.words[i];
    }
  }
  return nullptr;
}

static std::string value_text(const SettingValue &value, double number) {
  if (const char *word = word_of(value, number)) {
    return word;
  }
  return value.per > 1 ? fixed(number / value.per, 3) : value.whole ? fixed(number, 0) : shortest(static_cast<float>(number));
}

static bool is_possible(const SettingValue &value, double number) {
  if (!(number >= value.least && number <= value.most)) {
    return false;
  }
  const unsigned *choice = value.choices;
  while (choice && *choice && *choice != number) {
    choice++;
  }
  return !choice || *choice;
}

static void check(const Setting &setting, const SettingValues &values, const std::string &shown) {
  for (std::size_t i = 0; i < setting.count; i++) {
    if (!is_possible(setting.values[i], values[i])) {
      throw Error(ErrorCode::bad_value, spoken(setting) + " " + shown + " is out of range; give " + setting.give);
    }
  }
}

static void put(wire_packet &command, const Setting &setting, const SettingValues &values) {
  const bool zeros = std::all_of(values.begin(), values.end(), [](double each) { return each == 0; });
  std::string shown;
  for (std::size_t i = 0; i < setting.count; i++) {
    setting.values[i].put(command, values[i]);
    shown += (i > 0 ? ":" : "") + value_text(setting.values[i], values[i]);
  }
  if (!zeros || !setting.zeros) {
    check(setting, values, shown);
  }
}

/* The values in units of the packet, not yet rounded. */
static std::optional<double> number_of(const SettingValue &value, const std::string &text) {
  if (value.words) {
    for (std::size_t i = 0; value.choices[i]; i++) {
      if (text == value.words[i]) {
        return value.choices[i];
      }
    }
    return std::nullopt;
  }
  if (value.per > 1) {
    auto number = to_double(text);
    return number ? std::optional(*number * value.per) : std::nullopt;
  }
  if (value.whole) {
    auto number = to_u64(text);
    return number ? std::optional(static_cast<double>(*number)) : std::nullopt;
  }
  return to_float(text);
}

static SettingValues values_from_text(const Setting &setting, const std::string &text) {
  SettingValues values{};
  if (setting.zeros && text == setting.zeros) {
    return values;
  }
  std::string rest = text;
  for (std::size_t i = 0; i < setting.count; i++) {
    const SettingValue &value = setting.values[i];
    const bool is_last = i + 1 == setting.count;
    const std::size_t end = is_last ? std::string::npos : rest.find(':');
    auto number = number_of(value, rest.substr(0, end));
    if (!number) {
      throw Error(ErrorCode::bad_value,
                  spoken(setting) + " \"" + text + "\" is " +
                      (value.words ? "unknown" : std::string("no ") + (value.whole && value.per == 1 ? "whole " : "") + "number") +
                      "; give " + setting.give);
    }
    values[i] = *number;
    if (!is_last && end == std::string::npos) {
      values[i + 1] = setting.values[i + 1].unless_given;
      break;
    }
    rest.erase(0, is_last ? end : end + 1);
  }
  check(setting, values, text);
  for (std::size_t i = 0; i < setting.count; i++) {
    values[i] = setting.values[i].whole ? std::round(values[i]) : values[i];
  }
  return values;
}

std::uint8_t possible_streams(const wire_info &info, std::uint8_t streams) {
  int missing = (info.capabilities & WIRE_CAPABILITY_FIT ? 0 : WIRE_STREAM_CONTACT) |
                (info.capabilities & WIRE_CAPABILITY_RAW_STREAM ? 0 : WIRE_STREAM_RAW);
  return static_cast<std::uint8_t>(streams & ~missing);
}

wire_packet command_stream(std::uint8_t streams) {
  wire_packet packet = packet_of(WIRE_CMD_STREAM);
  packet.body.cmd_stream.streams = streams;
  return packet;
}

wire_packet command_tare(bool force) {
  wire_packet packet = packet_of(WIRE_CMD_TARE);
  packet.body.cmd_tare.force = force ? 1 : 0;
  return packet;
}

wire_packet command_info() { return packet_of(WIRE_CMD_INFO); }
wire_packet command_health() { return packet_of(WIRE_CMD_HEALTH); }
wire_packet command_crash() { return packet_of(WIRE_CMD_CRASH); }

wire_packet command_loader() {
  wire_packet packet = packet_of(WIRE_CMD_LOADER);
  packet.body.cmd_loader.magic = WIRE_LOADER_MAGIC;
  return packet;
}

wire_packet command_calibrate(const calibration &calibration, std::uint8_t sensor_count) {
  if (sensor_count < 1 || sensor_count > FT_MAX_SENSORS || !calibration_is_valid(&calibration, sensor_count)) {
    throw Error(ErrorCode::bad_value, "the calibration holds a value out of range");
  }
  wire_packet packet = packet_of(WIRE_CMD_CALIBRATE);
  packet.body.cmd_calibrate.sensor_count = sensor_count;
  packet.body.cmd_calibrate.calibration = calibration;
  return packet;
}

wire_packet command_erase_calibration() { return packet_of(WIRE_CMD_ERASE_CALIBRATION); }

wire_packet command_keep(bool keep) {
  wire_packet packet = packet_of(WIRE_CMD_KEEP);
  packet.body.cmd_keep.keep = keep ? 1 : 0;
  return packet;
}

wire_packet command_pad(const pad_profile &profile) {
  if (!pad_profile_is_valid(&profile)) {
    throw Error(ErrorCode::bad_value, "the pad's profile holds a value out of range");
  }
  wire_packet packet = packet_of(WIRE_CMD_PAD);
  packet.body.cmd_pad.profile = profile;
  return packet;
}

wire_packet command_erase_pad() { return packet_of(WIRE_CMD_ERASE_PAD); }

WantedSetting setting_from_text(const std::string &text) {
  const std::size_t equals = text.find('=');
  const Setting *setting = find_in(all_settings, [&](const Setting &each) { return text.substr(0, equals) == each.name; });
  if (!setting) {
    std::string known = joined(all_settings, ", ", [](const Setting &each) { return std::string(each.name) + "=" + each.typed; });
    known.replace(known.rfind(", "), 2, " or ");
    throw Error("setting \"" + text + "\" is unknown; give " + known);
  }
  return {setting, values_from_text(*setting, equals == std::string::npos ? "" : text.substr(equals + 1))};
}

std::vector<wire_packet> setting_commands(const std::vector<WantedSetting> &wanted, const wire_info &now) {
  std::vector<wire_packet> commands;
  for (const Setting &setting : all_settings) {
    bool is_wanted = false; /* it, or what travels with it */
    SettingValues values{};
    for (std::size_t i = 0; i < setting.count; i++) {
      values[i] = setting.values[i].now(now);
    }
    for (const WantedSetting &each : wanted) {
      is_wanted = is_wanted || each.setting->command == setting.command;
      values = each.setting == &setting ? each.values : values;
    }
    if (!is_wanted) {
      continue;
    }
    if (commands.empty() || commands.back().type != setting.command) {
      commands.push_back(packet_of(setting.command));
    }
    put(commands.back(), setting, values);
  }
  return commands;
}

std::string settings_text(const wire_info &info) {
  std::string text;
  for (const Setting &setting : all_settings) {
    if ((info.capabilities & setting.capability) != setting.capability) {
      continue;
    }
    std::string shown;
    for (std::size_t i = 0; i < setting.count; i++) {
      const SettingValue &value = setting.values[i];
      const double number = value.now(info);
      shown += (i > 0 ? ":" : "") + value_text(value, number);
      if (setting.zeros && i + 1 == setting.count && number == 0) {
        shown = setting.zeros;
      }
    }
    text += (text.empty() ? "" : " ") + std::string(setting.name) + "=" + shown;
  }
  return text;
}

std::string settings_help() {
  return joined(all_settings, ", ", [](const Setting &setting) { return setting.help; });
}

std::vector<std::uint8_t> frame_bytes(const wire_packet &packet) {
  std::vector<std::uint8_t> bytes(WIRE_MAX_FRAME_BYTES);
  std::size_t length = 0;
  const wire_layout *layout = wire_find_layout(wire_all_layouts, packet.type);
  if (wire_encode(layout, &packet, bytes.data(), &length) != FT_OK) {
    throw std::logic_error("a packet that the codec refuses");
  }
  bytes.resize(length);
  return bytes;
}

std::vector<std::uint8_t> info_frame_of_version(std::uint8_t version) {
  Bytes packet(WIRE_HEADER_BYTES);
  packet[0] = version;
  packet[1] = WIRE_CMD_INFO;
  Bytes frame;
  Envelope(std::move(packet)).append_frame(frame);
  return frame;
}

} // namespace fingertip
