#include "grasp/settings.hpp"

#include "grasp/control/reach.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip {

// All constants but those of the integral gain were chosen in simulated grasps (CONTROL.md).

// The gripper's own force limit must be able to stay below the cap.
constexpr double CAP_OVER_LEAST_FORCE = 1.05;

// The integral closes most of an error within about five dead times. Two pads of 12 mm have 2 to
// 5 N/mm together at 2 to 8 N, so one dead time may correct 0.06 mm for each newton.
constexpr double INTEGRAL_mm_N = 0.06, INTEGRAL_LEAST_mm_Ns = 0.3, INTEGRAL_MOST_mm_Ns = 4.0;
constexpr double FINGERTIP_DELAY_s = 0.01; // from a measurement to the controller

// A gripper whose least move is long starts firmer: it answers late, and by too much.
constexpr double START_N = 4.0, START_N_mm = 1.5;

// Later it overshoots by half a step on average, so it needs a smaller floor and a smaller margin.
constexpr double FLOOR_N = 1.3, FLOOR_N_mm = 1.1, FLOOR_LEAST_N = 0.5;

// A slow gripper needs a larger margin, because the load grows until it moves.
constexpr double MARGIN = 1.05, MARGIN_1_s = 11.0, MARGIN_1_mm = 0.5, MARGIN_LEAST = 1.0;

GripSettings default_settings(const GripperTraits &traits) {
  GripSettings settings;
  settings.cap_N = std::max(settings.cap_N, CAP_OVER_LEAST_FORCE * traits.force_min_N);
  settings.release_width_mm = traits.stroke_mm;
  const double dead_s = traits.latency_s + traits.poll_s + FINGERTIP_DELAY_s;
  settings.ki_mm_Ns = std::clamp(INTEGRAL_mm_N / dead_s, INTEGRAL_LEAST_mm_Ns, INTEGRAL_MOST_mm_Ns);
  settings.start_N = START_N + START_N_mm * GripReach(traits).least_mm();
  settings.floor_N = std::max(FLOOR_N - FLOOR_N_mm * traits.step_mm, FLOOR_LEAST_N);
  settings.margin = std::max(MARGIN + MARGIN_1_s * traits.latency_s - MARGIN_1_mm * traits.step_mm, MARGIN_LEAST);
  return settings;
}

constexpr const char *FIXED = "fixed";

// A breaking force as shares of itself: no closer, for pads differ and forces are known to a tenth.
constexpr double CAP = 0.8, START = 0.33, FLOOR = 0.25;
constexpr double GENTLE_mm_s = 4.0; // approach to what breaks

[[noreturn]] void impossible(const std::string &text) { throw Error(ErrorCode::bad_value, text); }

#define OF(member) #member, &GripSettings::member

const std::vector<GraspSetting> &grasp_settings() {
  static const std::vector<GraspSetting> all = {
      {FIXED, "N", 0.1, 100, 1, OF(set_N), "Hold this force, not as much as the load needs"},
      {"cap", "N", 0.5, 100, 1, OF(cap_N), "The true force stays below, errors of the fingertips included"},
      {"travel-cap", "mm", 0.5, 100, 1, OF(travel_cap_mm), "Never close further since the touch"},
      {"start", "N", 0.2, 100, 1, OF(start_N), "Force before anything pulls"},
      {"floor", "N", 0.2, 100, 1, OF(floor_N), "Least force once the load is known; more where frames come late"},
      {"blind", "N", 0.2, 100, 1, OF(blind_N), "Force where no load can be estimated"},
      {"friction", "", 0.1, 1.5, 1, OF(friction), "Friction coefficient to begin with"},
      {"margin", "", 1, 5, 1, OF(margin), "Force divided by load / friction; more where frames come late"},
      {"slid", "", 1, 3, 1, OF(slid), "Factor on that once the object has slid"},
      {"decay", "%/s", 0, 2000, 0.01, OF(decay_1_s), "How fast an excess of force decays"},
      {"rest", "s", 0, 60, 1, OF(rest_s), "No decay for this time after a slide"},
      {"pull", "N", 0.2, 20, 1, OF(pull_N), "Hand over when each fingertip is pulled so hard"},
      {"mass", "kg", 0, 20, 1, OF(mass_kg), "Expected mass, which decides the first grip; 0: unknown"},
      {"lift", "m/s2", 0, 20, 1, OF(lift_m_s2), "With --mass: acceleration of the arm as it lifts"},
      {"touch", "N", 0.02, 2, 1, OF(touch_N), "Force at which a touch begins"},
      {"approach", "mm/s", 0.5, 8, 1, OF(approach_mm_s), "Speed until the touch; slower where frames come late"},
      {"release", "mm/s", 0.5, 100, 1, OF(release_mm_s), "Speed of opening"},
      {"open-width", "mm", 0, 500, 1, OF(release_width_mm), "How far to open"},
      {"stale", "ms", 5, 1000, 1e-3, OF(stale_s), "Ignore a fingertip without a new frame for this time"},
      {"late", "ms", 5, 500, 1e-3, OF(late_s), "Report frames that arrive older than this"},
      {"silent", "ms", 20, 5000, 1e-3, OF(silent_s), "Timeout of the gripper"},
      {"differ", "%", 5, 100, 0.01, OF(differ), "Warn if the fingertips' forces differ by more at rest"},
      {"kp", "um/N", 0, 10000, 1e-3, OF(kp_mm_N), "With --fixed: the published controller's proportional gain"},
      {"ki", "um/(N s)", 0, 100000, 1e-3, OF(ki_mm_Ns), "Its gain of the integral"},
      {"kd", "um s/N", 0, 10000, 1e-3, OF(kd_mm_s_N), "Its gain of the derivative"},
      {"control", "ms", 0.5, 1000, 1e-3, OF(control_s), "Time between two of its steps"},
  };
  return all;
}

const GraspSetting &setting_of_field(const std::string &name) {
  const auto *found = find_in(grasp_settings(), [&](const GraspSetting &setting) { return name == setting.field_name; });
  return found ? *found : throw Error(ErrorCode::bad_value, "no setting " + printable(name));
}

double value_of(const GraspSetting &setting, const GripSettings &settings) { return settings.*setting.field / setting.scale; }

const std::vector<GraspPreset> &grasp_presets() {
  static const std::vector<GraspPreset> all = {{"egg", 25.0}, {"strawberry", 5.0}, {"cup", 3.0}, {"crisp", 1.5}};
  return all;
}

std::map<std::string, double> breaking_values(double breaks_N) {
  const GripSettings usual;
  return {{"cap", std::min(CAP * breaks_N, usual.cap_N)},
          {"start", std::min(START * breaks_N, usual.start_N)},
          {"floor", std::min(FLOOR * breaks_N, usual.floor_N)},
          {"approach", GENTLE_mm_s}};
}

std::map<std::string, double> preset_values(const std::string &preset) {
  if (const GraspPreset *found = find_in(grasp_presets(), [&](const auto &one) { return preset == one.name; })) {
    return breaking_values(found->breaks_N);
  }
  impossible("no preset " + printable(preset) + "; there are " +
             joined(grasp_presets(), ", ", [](const GraspPreset &one) { return one.name; }));
}

std::map<std::string, double> limits_of(const std::vector<std::string_view> &words) {
  std::map<std::string, double> values;
  for (const std::string_view word : words) {
    const std::size_t equals = std::min(word.find('='), word.size());
    const std::string_view name = word.substr(0, equals);
    const auto value = to_double(word.substr(std::min(equals + 1, word.size())));
    const auto *found = find_in(grasp_settings(), [&](const GraspSetting &each) { return name == each.name; });
    if (!word.empty() && !(found && value)) {
      impossible((found ? "the setting has no number: " : "the controller has no setting ") + printable(word));
    }
    if (found) {
      values[found->name] = *value;
    }
  }
  return values;
}

GripSettings settings_for(const GripperTraits &traits, const std::map<std::string, double> &wanted, SettingName called) {
  GripSettings settings = default_settings(traits);
  settings.mode = wanted.count(FIXED) != 0 ? GRIP_MODE_FIXED : GRIP_MODE_HOLD;
  const auto text_of = [&](const GraspSetting &setting) {
    return called == SettingName::field ? setting.field_name : std::string("--") + setting.name;
  };
  for (const GraspSetting &setting : grasp_settings()) {
    const auto value = wanted.find(setting.name);
    if (value == wanted.end()) {
      continue;
    }
    if (!(value->second >= setting.low && value->second <= setting.high)) {
      const double scale = called == SettingName::field ? setting.scale : 1.0;
      const std::string unit = scale == 1.0 && *setting.unit ? std::string(" ") + setting.unit : "";
      impossible(text_of(setting) + " is not possible; give " + shortest(static_cast<float>(scale * setting.low)) + " to " +
                 shortest(static_cast<float>(scale * setting.high)) + unit);
    }
    settings.*setting.field = value->second * setting.scale;
  }
  const auto name_of = [&](const char *name) {
    return text_of(*find_in(grasp_settings(), [&](const GraspSetting &setting) { return name == std::string(setting.name); }));
  };
  const auto follow = [&](const char *name, double &field, double low, double high, const std::string &limit) {
    if (field < low || field > high) {
      if (wanted.count(name) != 0) {
        impossible(name_of(name) + " is not possible; " + limit);
      }
      field = std::clamp(field, low, high); // a default gives way to what was asked for
    }
  };
  const double cap_N = settings.cap_N;
  const std::string above_cap = "it is above " + name_of("cap");
  follow("open-width", settings.release_width_mm, 0.0, traits.stroke_mm, traits.model + " opens to " + fixed(traits.stroke_mm, 1) + " mm");
  follow(FIXED, settings.set_N, 0.0, cap_N, above_cap);
  follow("start", settings.start_N, 0.0, cap_N, above_cap);
  follow("floor", settings.floor_N, 0.0, cap_N, above_cap);
  follow("blind", settings.blind_N, settings.start_N, cap_N, "it must lie between " + name_of("start") + " and " + name_of("cap"));
  const double step_N = GripBound::first_N(traits.step_mm);
  if (step_N > cap_N) {
    impossible("a step of a " + traits.model + ", " + fixed(traits.step_mm, 2) + " mm, may press with " + fixed(step_N, 1) +
               " N, and the cap is " + fixed(cap_N, 1) + " N; take a gripper of finer steps, or a higher " + name_of("cap"));
  }
  return settings;
}

Metadata settings_metadata(const GripSettings &settings) {
  Metadata all = {{"grasp_mode", settings.mode == GRIP_MODE_FIXED ? "fixed" : "hold"}};
  for (const GraspSetting &setting : grasp_settings()) {
    std::string key = std::string("grasp_") + setting.name;
    std::replace(key.begin(), key.end(), '-', '_');
    std::string value = shortest(static_cast<float>(value_of(setting, settings)));
    all.emplace_back(key, value + (*setting.unit ? " " : "") + setting.unit);
  }
  return all;
}

} // namespace fingertip
