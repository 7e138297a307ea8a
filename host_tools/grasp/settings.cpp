#include "grasp/settings.hpp"

#include "grasp/convert.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/text.hpp"

#include <cmath>

namespace fingertip {

namespace {

using S = grip_settings;

constexpr const char *FIXED = "fixed";

GraspSetting number(const char *name, const char *unit, double low, double high, double scale,
                    std::int32_t &(*field)(S &), const char *help) {
  return {name, unit, low, high, scale, field, nullptr, help};
}

GraspSetting time(const char *name, const char *unit, double low, double high, double scale,
                  std::uint32_t &(*field)(S &), const char *help) {
  return {name, unit, low, high, scale, nullptr, field, help};
}

} // namespace

// The ranges are grip_init's.
const std::vector<GraspSetting> &grasp_settings() {
  static const std::vector<GraspSetting> all = {
      number(
          FIXED, "N", 0.1, 100, 1e3, [](S &s) -> std::int32_t & { return s.set_mN; },
          "Hold this force; default: as much as the load needs"),
      number(
          "cap", "N", 0.5, 100, 1e3, [](S &s) -> std::int32_t & { return s.force_cap_mN; },
          "Never aim at more force"),
      number(
          "travel-cap", "mm", 0.5, 100, 1e3, [](S &s) -> std::int32_t & { return s.travel_cap_um; },
          "Never close further since the touch"),
      number(
          "first", "N", 0.2, 100, 1e3, [](S &s) -> std::int32_t & { return s.first_mN; },
          "Force before anything pulls, and the least force"),
      number(
          "blind", "N", 0.2, 100, 1e3, [](S &s) -> std::int32_t & { return s.blind_mN; },
          "Force where no load can be estimated"),
      number(
          "shift", "mm", 0, 20, 1e3, [](S &s) -> std::int32_t & { return s.shift_um; },
          "How far a load as large as the force moves a long contact's location"),
      number(
          "friction", "", 0.1, 1.5, 1e3, [](S &s) -> std::int32_t & { return s.friction_permille; },
          "Friction coefficient to begin with"),
      number(
          "margin", "", 1, 5, 1e3, [](S &s) -> std::int32_t & { return s.margin_permille; },
          "Force divided by load / friction"),
      number(
          "slid", "", 1, 3, 1e3, [](S &s) -> std::int32_t & { return s.slid_permille; },
          "Factor on that once the object has slid"),
      number(
          "decay", "%/s", 0, 500, 10, [](S &s) -> std::int32_t & { return s.decay_permille_s; },
          "How fast an excess of force decays"),
      time(
          "rest", "s", 0, 60, 1e6, [](S &s) -> std::uint32_t & { return s.rest_us; },
          "No decay for so long after a slide"),
      number(
          "touch", "N", 0.02, 2, 1e3, [](S &s) -> std::int32_t & { return s.touch_mN; },
          "Force at which a touch begins"),
      number(
          "approach", "mm/s", 0.5, 8, 1e3, [](S &s) -> std::int32_t & { return s.approach_um_s; },
          "Speed until the touch"),
      number(
          "release", "mm/s", 0.5, 100, 1e3, [](S &s) -> std::int32_t & { return s.release_um_s; },
          "Speed of opening"),
      number(
          "open-width", "mm", 0, 500, 1e3,
          [](S &s) -> std::int32_t & { return s.release_width_um; }, "How far to open"),
      time(
          "stale", "ms", 5, 1000, 1e3, [](S &s) -> std::uint32_t & { return s.stale_us; },
          "Ignore a fingertip that is silent for so long"),
      time(
          "silent", "ms", 20, 5000, 1e3, [](S &s) -> std::uint32_t & { return s.silent_us; },
          "Timeout of the gripper"),
      number(
          "differ", "%", 5, 100, 10, [](S &s) -> std::int32_t & { return s.differ_permille; },
          "Warn if the fingertips' forces differ by more"),
      number(
          "kp", "um/N", 0, 10000, 1, [](S &s) -> std::int32_t & { return s.gains.kp_um_per_N; },
          "With --fixed: the published controller's proportional gain"),
      number(
          "ki", "um/(N s)", 0, 100000, 1,
          [](S &s) -> std::int32_t & { return s.gains.ki_um_per_Ns; }, "Its gain of the integral"),
      number(
          "kd", "um s/N", 0, 10000, 1, [](S &s) -> std::int32_t & { return s.gains.kd_um_s_per_N; },
          "Its gain of the derivative"),
      time(
          "control", "ms", 0.5, 1000, 1e3, [](S &s) -> std::uint32_t & { return s.control_us; },
          "Time between two of its steps"),
  };
  return all;
}

double value_of(const GraspSetting &setting, grip_settings settings) {
  return (setting.number ? static_cast<double>(setting.number(settings))
                         : static_cast<double>(setting.time(settings))) /
         setting.scale;
}

grip_settings settings_for(const GripperTraits &traits,
                           const std::map<std::string, double> &wanted) {
  const grip_traits core = core_traits(traits);
  grip_settings settings{};
  grip_default_settings(&settings, &core);
  settings.mode = wanted.count(FIXED) != 0 ? GRIP_MODE_FIXED : GRIP_MODE_HOLD;
  for (const GraspSetting &setting : grasp_settings()) {
    const auto value = wanted.find(setting.name);
    if (value == wanted.end()) {
      continue;
    }
    if (!(value->second >= setting.low && value->second <= setting.high)) {
      throw Error(ErrorCode::bad_value, "--" + std::string(setting.name) +
                                            " is not possible; give " +
                                            shortest(static_cast<float>(setting.low)) + " to " +
                                            shortest(static_cast<float>(setting.high)) +
                                            (*setting.unit ? " " : "") + setting.unit);
    }
    const double scaled = std::round(value->second * setting.scale);
    if (setting.number) {
      setting.number(settings) = static_cast<std::int32_t>(scaled);
    } else {
      setting.time(settings) = static_cast<std::uint32_t>(scaled);
    }
  }
  const auto follow = [&](const char *name, std::int32_t &field, std::int32_t low,
                          std::int32_t high, const std::string &limit) {
    if (field >= low && field <= high) {
      return;
    }
    if (wanted.count(name) != 0) {
      throw Error(ErrorCode::bad_value, "--" + std::string(name) + " is not possible; " + limit);
    }
    field = field < low ? low : high; // a default gives way to what was asked for
  };
  follow("open-width", settings.release_width_um, 0, core.stroke_um,
         traits.model + " opens to " + fixed(traits.stroke_mm, 1) + " mm");
  const std::int32_t cap_mN = settings.force_cap_mN;
  follow(FIXED, settings.set_mN, 100, cap_mN, "it is above --cap");
  follow("first", settings.first_mN, 200, cap_mN, "it is above --cap");
  follow("blind", settings.blind_mN, settings.first_mN, cap_mN,
         "it must lie between --first and --cap");
  grip checked;
  if (grip_init(&checked, &settings, &core) != FT_OK) {
    throw Error(ErrorCode::bad_value,
                "these limits do not go with a gripper " + traits.model + ", or with one another");
  }
  return settings;
}

Metadata settings_metadata(const grip_settings &settings) {
  Metadata all = {{"grasp_mode", settings.mode == GRIP_MODE_FIXED ? "fixed" : "hold"}};
  for (const GraspSetting &setting : grasp_settings()) {
    std::string key = std::string("grasp_") + setting.name;
    for (char &c : key) {
      c = c == '-' ? '_' : c;
    }
    std::string value = shortest(static_cast<float>(value_of(setting, settings)));
    all.emplace_back(key, value + (*setting.unit ? " " : "") + setting.unit);
  }
  return all;
}

} // namespace fingertip
