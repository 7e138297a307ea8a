// Values that people and programs type: settings of the fingertip and of a grasp.
#include "fuzz.h"
#include "grasp/convert.hpp"
#include "grasp/settings.hpp"
#include "grasp/words.hpp"
#include "libfingertip/command.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/text.hpp"

#include <cmath>
#include <functional>

using namespace fingertip;

namespace {

// Refused, or a value that the codec and the fingertip take.
void check_command(const std::function<wire_packet()> &typed) {
  try {
    FUZZ_CHECK(!frame_bytes(typed()).empty());
  } catch (const Error &error) {
    FUZZ_CHECK(error.code() == ErrorCode::bad_value);
  }
}

void check_text(const std::string &text) {
  check_command([&] { return command_rate_mHz(rate_mHz_from_text(text)); });
  check_command([&] { return command_osr(osr_from_text(text)); });
  check_command(
      [&] { return command_slip(slip_threshold_mm_from_text(text), WIRE_SLIP_WINDOW_MIN_ms); });
  check_command([&] { return command_slip(1, slip_window_ms_from_text(text)); });
  check_command([&] { return command_location_limit(location_limit_mm_from_text(text)); });
  check_command([&] {
    const Prior prior = prior_from_text(text), again = prior_from_text(prior_text(prior));
    FUZZ_CHECK(again.sigma_mm == prior.sigma_mm && again.width_mm == prior.width_mm);
    return command_prior(prior.sigma_mm, prior.width_mm);
  });
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

void check_settings(fuzz_input &input) {
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
    const grip_settings settings = settings_for(traits, wanted);
    const grip_traits core = core_traits(traits);
    grip checked;
    FUZZ_CHECK(grip_init(&checked, &settings, &core) == FT_OK);
    for (const GraspSetting &setting : all) {
      const auto asked = wanted.find(setting.name);
      FUZZ_CHECK(asked == wanted.end() || std::abs(value_of(setting, settings) - asked->second) <=
                                              0.5 / setting.scale * 1.001);
    }
    settings_metadata(settings);
  } catch (const Error &error) {
    FUZZ_CHECK(error.code() == ErrorCode::bad_value);
  }
}

} // namespace

void fuzz_one(const uint8_t *bytes, size_t length) {
  fuzz_input input = {bytes, bytes + length};
  if (fuzz_u8(&input) & 1) {
    check_settings(input);
  } else {
    check_text(std::string(input.at, input.end));
  }
}
