// The simulations of `fingertip simulate`. Each goes on until a signal comes, or its time is over. All throw Error.
//
// README.md has what they do. Rubber of --press: 12 mm of silicone without ends, which remembers as the twin's does (memory, aftereffect;
// twin/effects.hpp). Of --lift, physics and gripper run in this process, a fingertip's firmware in each of two others. Time that this
// process is held up is none for the world, nor is time in which the others are waited for: fingertips and lines go on, with what is as it
// was.
#pragma once

#include "simulation/cell/fingertip_cell_world.hpp"
#include "simulation/cell/place.hpp"
#include "simulation/cell/validated.hpp"

namespace fingertip::cell {

constexpr const char *PRESS_FACE = "sphere15"; // a ball of 15 mm, as calibrate asks for
constexpr const char *LIFT_FACE = "sphere18";  // a point of the object; a line or an area is a row of them

struct PressOptions : SimulationOptions {
  std::size_t fingertips = 1; // 1 or 2
  bool by_hand = false;
  double weight_g = 300.0;
};
void press(const PressOptions &options, const Place &place);
void validate(const ValidatedOptions &options, std::optional<double> seconds, const Place &place);

struct LiftOptions : SimulationOptions {
  std::string model = gripper_models().front().model;
  World::Options world;
  double patience_s = 0.0;
};
// The first grasp of this kind at the options' seed (kinds.hpp), and how far the gripper is open then; gravity and the
// object's stiffness are the options'. Errors and delays of frames are no part of it: the fingertips are the firmware.
void be_of_kind(LiftOptions &options, Kind kind);
// Throws Error, bad_value: the gripper does not open so far.
void check(const LiftOptions &options);
void lift(const LiftOptions &options, const Place &place);

} // namespace fingertip::cell
