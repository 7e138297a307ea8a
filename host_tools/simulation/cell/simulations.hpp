// The simulations of `fingertip simulate`. Each goes on until a signal comes, or its time is over. All throw Error.
//
// README.md has what they do. Rubber of --press: 12 mm of silicone without ends, which remembers as the twin's does (memory, aftereffect;
// twin/effects.hpp). Of --lift, physics and gripper run in this process, a fingertip's firmware in each of two others.
#pragma once

#include "simulation/cell/fingertip_cell_world.hpp"
#include "simulation/cell/place.hpp"
#include "simulation/cell/validated.hpp"

namespace fingertip::cell {

constexpr const char *PRESS_FACE = "sphere15"; // a ball of 15 mm, as calibrate asks for
constexpr const char *LIFT_FACE = "sphere18";  // a point of the object; a line or an area is a row of them

struct SimulationOptions {
  std::string truth, cache;
  std::optional<double> seconds, gain_spread; // gain_spread: standard deviation; none: the simulation's usual one
  std::uint64_t seed = 1;
  bool overwrite = false;
  // --press
  std::size_t fingertips = 1; // 1 or 2
  bool by_hand = false;
  double weight_g = 300.0;
  // --lift
  std::string model = gripper_models().front().model;
  World::Options world;
  double patience_s = 0.0;
};
void press(const SimulationOptions &options, const PortFolder &place);
void validate(const ValidatedOptions &options, std::optional<double> seconds, const PortFolder &place);
// Throws Error, bad_value: the gripper does not open so far.
void lift(const SimulationOptions &options, const PortFolder &place);

} // namespace fingertip::cell
