// Values that people and programs type: settings of the fingertip and of a grasp.
#include "fuzz.h"
#include "grasp/settings.hpp"
#include "grasp/words.hpp"
#include "libfingertip/command.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/text.hpp"

#include <cmath>

using namespace fingertip;

// Refused, or values that the codec and the fingertip take.
static void check_setting(const std::string &text) {
  const wire_info now = []() {
    wire_info info{};
    info.slip_threshold_mm = 1;
    info.slip_window_ms = WIRE_SLIP_WINDOW_MIN_ms;
    return info;
  }();
  try {
    for (const wire_packet &command : setting_commands({setting_from_text(text)}, now)) {
      FUZZ_CHECK(!frame_bytes(command).empty());
    }
  } catch (const Error &error) {
    FUZZ_CHECK(error.code() == ErrorCode::bad_value);
  }
}

static void check_text(const std::string &text) {
  for (const char *name : {"rate=", "osr=", "slip_threshold=", "slip_window=", "prior=", "limit=", "sync="}) {
    check_setting(name + text);
  }
  if (const auto number = to_float(text)) {
    FUZZ_CHECK(std::isfinite(*number) && to_float(shortest(*number)) == number);
  }
  if (const auto number = to_i64(text)) {
    FUZZ_CHECK(to_i64(std::to_string(*number)) == number);
  }
  if (const auto trouble = trouble_of_names(text)) {
    FUZZ_CHECK(trouble_of_names(trouble_names(*trouble)) == trouble);
  }
  const std::string shown = printable(text);
  FUZZ_CHECK(printable(shown) == shown);
  for (const char c : shown) {
    FUZZ_CHECK(static_cast<unsigned char>(c) >= 0x20 && c != 0x7F);
  }
  std::string joined;
  for (const auto part : split(text, ' ')) {
    joined += (joined.empty() && part.data() == text.data() ? "" : " ") + std::string(part);
  }
  FUZZ_CHECK(joined == text);
}

static void check_settings(fuzz_input &input) {
  const auto models = gripper_models();
  const GripperTraits &traits = models[fuzz_u8(&input) % models.size()];
  std::map<std::string, double> wanted;
  const auto &all = grasp_settings();
  for (std::uint8_t left = fuzz_u8(&input) % 8; left > 0; left--) {
    const GraspSetting &setting = all[fuzz_u8(&input) % all.size()];
    const std::uint8_t how = fuzz_u8(&input);
    double value = setting.low + (setting.high - setting.low) * how / 254;
    if (how == 255) {
      const std::uint64_t bits = fuzz_u64(&input);
      memcpy(&value, &bits, sizeof value);
    }
    wanted[setting.name] = value;
  }
  try {
    const GripSettings settings = settings_for(traits, wanted);
    for (const GraspSetting &setting : all) {
      const auto asked = wanted.find(setting.name);
      FUZZ_CHECK(asked == wanted.end() || std::abs(value_of(setting, settings) - asked->second) <= 1e-9 * (1.0 + std::abs(asked->second)));
    }
    settings_metadata(settings);
  } catch (const Error &error) {
    FUZZ_CHECK(error.code() == ErrorCode::bad_value);
  }
}

void fuzz_one(const uint8_t *bytes, size_t length) {
  fuzz_input input = {bytes, bytes + length};
  if (fuzz_u8(&input) & 1) {
    check_settings(input);
  } else {
    check_text(std::string(input.at, input.end));
  }
}
