// `fingertip simulate --lift`: an object between two fingertips on a gripper, which `fingertip grasp` grasps and a hand then lifts.
//
// Physics and gripper run in this process, a fingertip's firmware in each of two others. Time that
// this process is held up is none for the world, nor is time in which the others are waited for:
// fingertips and lines go on, with what is as it was. Lines of standard input are obeyed.
#pragma once

#include "simulation/cell/fingertip_cell_world.hpp"
#include "simulation/cell/place.hpp"

namespace fingertip::cell {

struct LiftOptions : SimulationOptions {
  std::string model = gripper_models().front().model, face = "sphere18";
  World::Options world;
  double opens_mm = 4.0, gain_sd = 0.01, patience_s = 0.0;
};

// The first grasp of this kind at the options' seed (kinds.hpp), and how far the gripper is open then; gravity and the
// object's stiffness are the options'. Errors and delays of frames are no part of it: the fingertips are the firmware.
void be_of_kind(LiftOptions &options, Kind kind);

// Throws Error, bad_value: the gripper does not open so far.
void check(const LiftOptions &options);

// Until a signal comes, or its time is over. Throws Error, and std::runtime_error for a face that there is not.
void lift(const LiftOptions &options, const Place &place);

} // namespace fingertip::cell
