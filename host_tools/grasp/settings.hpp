// Every limit of the controller's settings as an option of a command line, with its unit and its range, and presets of them.
#pragma once

#include "grasp/control/settings.hpp"
#include "libfingertip/packet_fields.hpp"

#include <map>
#include <string>
#include <vector>

namespace fingertip {

struct GraspSetting {
  const char *name; // of the option, without --
  const char *unit; // "" for a ratio
  double low, high;
  double scale; // field = value * scale
  const char *field_name;
  double GripSettings::*field;
  const char *help;
};

const std::vector<GraspSetting> &grasp_settings();
// By the name of its field: "kp_mm_N". Throws Error, bad_value: there is none.
const GraspSetting &setting_of_field(const std::string &name);

double value_of(const GraspSetting &setting, const GripSettings &settings);

// What an object is like: the force that breaks it.
struct GraspPreset {
  const char *name;
  double breaks_N;
};
const std::vector<GraspPreset> &grasp_presets();
// The settings of a preset: cap, start and floor well below that force, and a slow approach. Throws Error, bad_value: there is none.
std::map<std::string, double> preset_values(const std::string &preset);
std::map<std::string, double> breaking_values(double breaks_N);

// Of NAME=VALUE each. Throws Error, bad_value.
std::map<std::string, double> limits_of(const std::vector<std::string_view> &words);

// How a message names a setting and its range: as an option in its unit, or as its field in the field's.
enum class SettingName { option, field };
// Defaults of this gripper, overridden by the wanted values, by name. "fixed" chooses that mode. Throws Error, code
// bad_value: a value out of range, or one that contradicts another; a gripper one of whose steps may exceed the cap.
GripSettings settings_for(const GripperTraits &traits, const std::map<std::string, double> &wanted,
                          SettingName called = SettingName::option);

// For a recording's head: grasp_mode, grasp_touch_N, ...
Metadata settings_metadata(const GripSettings &settings);

} // namespace fingertip
