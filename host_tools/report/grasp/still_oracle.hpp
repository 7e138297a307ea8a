// A controller of a set force on a grasp that nothing pulls, to compare with: what the gripper's
// steps and the relaxing rubber allow. It has what no controller knows: the true force, how it
// follows the width, and how the rubber is going to relax.
//
// Of the positions that the gripper can reach it takes the one whose mean squared error over the
// rest of the hold is least, by what the weaker fingertip reports. It goes there at once, or round
// (back by the least move, and on by that and a step) where that is worth what the way costs. It
// has the others' gripper, and moves only after its last move shows in the frames, as ours does. It
// plans no second move: with fine steps, which follow the rubber, others do better.
#pragma once

#include "simulation/cell/trial.hpp"

namespace fingertip::grasp {

class StillOracle : public cell::Controller {
public:
  // trial and face must outlive it.
  StillOracle(const cell::Trial &trial, const cell::Face &face);
  void see(const cell::Moment &moment); // every 2 ms
  void take_touch(std::size_t finger, const GripTouch &touch) override;
  void take_status(const GripperStatus &status) override { status_ = status; }
  GripReport step(double now_s, GripCommand &command) override;

private:
  double elastic_N(double drive_mm) const;
  // Squared errors over the rest of the hold, times s; at this width from now on.
  double cost_s(double drive_mm, double rest_s) const;
  double passing_cost_s(double drive_mm) const; // the same of a position that is left at once
  double error_of(double force_N) const;
  void choose(double rest_s, double far_mm);

  const cell::Trial &trial_;
  GripperMechanics gripper_;
  cell::Cell untouched_; // computes the elastic force
  std::array<double, 2> strength_{}, follows_N_{};
  std::array<GripTouch, 2> touch_{};
  GripperStatus status_{};
  GripReport report_{};
  double reported_ = 1.0; // by the weaker fingertip, over the true force
  double seen_s_ = 0.0, touched_s_;
  double target_mm_ = 0.0, then_mm_ = 0.0; // then: where it goes on to from there
  double sent_s_ = 0.0;
};

} // namespace fingertip::grasp
