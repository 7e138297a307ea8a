// Controllers that are given what no controller knows, to compare with: what the gripper itself allows.
// They have the same frames' delay, gripper and least move as the others.
#pragma once

#include "simulation/cell/kind_trial.hpp"

#include <array>
#include <limits>
#include <vector>

namespace fingertip::grasp {

class Knowing : public cell::Controller {
public:
  virtual void see(const cell::KindMoment &moment) = 0; // every 2 ms
  void take_status(const GripperStatus &status) override { status_ = status; }

protected:
  GripperStatus status_{};
  GripReport report_{};
  double target_mm_ = 0.0;
};

// Knows the true load, friction and stiffness. Its grip is 1.2 times the most that kinetic friction
// needed in the last half second, as of the moment of the newest frame. It takes the widest position
// whose force is enough.
class Oracle : public Knowing {
public:
  // trial must outlive it.
  Oracle(const cell::KindTrial &trial, const GripSettings &settings)
      : grasp_(trial.grasp), gripper_(trial.gripper), settings_(settings) {}
  void see(const cell::KindMoment &moment) override;
  void take_touch(std::size_t, const GripTouch &touch) override { newest_s_ = touch.t_s; }
  GripReport step(double now_s, GripCommand &command) override;

private:
  struct Moment {
    double t_s, need_N, relaxed_N;
    bool lifts;
  };
  double wanted_N() const;

  const cell::KindOfGrasp &grasp_;
  GripperMechanics gripper_;
  GripSettings settings_;
  std::vector<Moment> moments_;
  double newest_s_ = 0.0, moved_s_ = 0.0;
};

// Of a set force on a grasp that nothing pulls. Knows the true force, how it follows the width, and how
// the rubber is going to relax, both pads alike.
//
// Of the positions that the gripper can reach it takes the one whose mean squared error over the
// rest of the hold is least, by what the weaker fingertip reports. It goes there at once, or by a detour
// (back by the least move, and on by that and a step) where that is worth what the way costs. It
// moves only after its last move shows in the frames, as ours does. It plans no second move: with
// fine steps, which follow the rubber, others do better.
class StillOracle : public Knowing {
public:
  // trial must outlive it.
  explicit StillOracle(const cell::KindTrial &trial);
  void see(const cell::KindMoment &moment) override;
  void take_touch(std::size_t finger, const GripTouch &touch) override { touch_[finger] = touch; }
  GripReport step(double now_s, GripCommand &command) override;

private:
  double elastic_N(double drive_mm) const;
  // Squared errors over the rest of the hold, times s; at this width from now on.
  double cost_s(double drive_mm, double rest_s) const;
  double passing_cost_s(double drive_mm) const; // the same of a position that is left at once
  double error_of(double force_N) const;
  void choose(double rest_s, double far_mm);

  const cell::KindTrial &trial_;
  GripperMechanics gripper_;
  std::array<double, 2> strength_{}, follows_N_{};
  std::array<GripTouch, 2> touch_{};
  double reported_ = 1.0; // by the weaker fingertip, over the true force
  double seen_s_ = 0.0, touched_s_ = std::numeric_limits<double>::infinity();
  double then_mm_ = 0.0; // where it goes on to from the target
  double sent_s_ = 0.0;
};

} // namespace fingertip::grasp
