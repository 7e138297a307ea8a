#include "libfingertip/packet_fields.hpp"

#include "libfingertip/recording_fields.hpp"

#include <cstring>
#include <strings.h>

namespace fingertip {

using namespace recording;

template <typename ValueOf> static std::string list_text(ValueOf value_of, std::size_t count) {
  std::string text;
  for (std::size_t k = 0; k < count; k++) {
    text += (k ? " " : "") + shortest(value_of(k));
  }
  return text;
}

std::string text_field(const char *field) { return std::string(field, strnlen(field, WIRE_TEXT_BYTES)); }

bool is_same_serial(const std::string &a, const std::string &b) { return strcasecmp(a.c_str(), b.c_str()) == 0; }

Metadata info_metadata(const wire_info &info) {
  const std::uint8_t *version = info.firmware_version;
  Metadata pairs = {
      {"serial", text_field(info.serial)},
      {"board", text_field(info.board)},
      {"scene", text_field(info.scene)},
      {"firmware", std::to_string(version[0]) + "." + std::to_string(version[1]) + "." + std::to_string(version[2])},
      {"git", text_field(info.git_hash)},
  };
  wire_info copy = info;
  PairWriter writer;
  visit_info(writer, copy);
  pairs.insert(pairs.end(), writer.pairs.begin(), writer.pairs.end());
  auto list = [&](const char *name, auto value_of) { pairs.emplace_back(name, list_text(value_of, info.sensor_count)); };
  list("x_mm", [&](std::size_t k) { return info.x_mm[k]; });
  list("y_mm", [&](std::size_t k) { return info.y_mm[k]; });
  if (info.stored & WIRE_STORED_CALIBRATION) {
    PairWriter of_calibration;
    visit_calibration(of_calibration, copy.calibration);
    pairs.insert(pairs.end(), of_calibration.pairs.begin(), of_calibration.pairs.end());
    auto visit = [&](const char *name, auto member) { list(name, [&](std::size_t k) { return info.calibration.sensors[k].*member; }); };
    visit_sensor_lists(visit);
  }
  if (info.stored & WIRE_STORED_PAD) {
    PairWriter of_pad;
    visit_pad(of_pad, copy.pad);
    pairs.insert(pairs.end(), of_pad.pairs.begin(), of_pad.pairs.end());
    for (const PadList &each : pad_lists) {
      auto value_of = [&](std::size_t j) { return each.value(copy.pad, j); };
      pairs.emplace_back(each.name, list_text(value_of, each.terms));
    }
  }
  return pairs;
}

std::vector<std::pair<std::string, std::uint64_t>> health_fields(const wire_health &health) {
  std::vector<std::pair<std::string, std::uint64_t>> fields;
  auto visit = [&](const std::string &name, std::uint64_t value) { fields.emplace_back(name, value); };
  wire_health copy = health;
  visit_health(visit, copy);
  return fields;
}

} // namespace fingertip
