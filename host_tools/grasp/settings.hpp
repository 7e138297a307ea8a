// Every limit of the core's settings as an option of a command line, with its unit and its range.
#pragma once

#include "grasp/core.hpp"
#include "grasp/gripper/gripper.hpp"
#include "libfingertip/packet_fields.hpp"

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace fingertip {

struct GraspSetting {
  const char *name; // of the option, without --
  const char *unit; // "" for a ratio
  double low, high;
  double scale; // field = value * scale
  // One of both.
  std::int32_t &(*number)(grip_settings &settings);
  std::uint32_t &(*time)(grip_settings &settings);
  const char *help;
};

const std::vector<GraspSetting> &grasp_settings();

double value_of(const GraspSetting &setting, grip_settings settings);

// Defaults of this gripper, overridden by the wanted values, by name. "fixed" chooses that mode.
// Throws Error, code bad_value: a value out of range, or one that contradicts another.
grip_settings settings_for(const GripperTraits &traits,
                           const std::map<std::string, double> &wanted);

// For a recording's head: grasp_mode, grasp_touch_N, ...
Metadata settings_metadata(const grip_settings &settings);

} // namespace fingertip
