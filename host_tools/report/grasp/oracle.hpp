// A controller that is given what no controller knows: the true load, friction and stiffness, to
// compare with: what the gripper itself allows. It has the same frames' delay, gripper and least
// move as the others.
//
// Its grip is 1.2 times the most that kinetic friction needed in the last half second, as of the
// moment of the newest frame. It takes the widest position whose force is enough.
#pragma once

#include "simulation/cell/kind_trial.hpp"

#include <vector>

namespace fingertip::grasp {

class Oracle : public cell::Controller {
public:
  // grasp must outlive it.
  Oracle(const cell::KindOfGrasp &grasp, const GripperMechanics &gripper, const GripSettings &settings);
  void see(const cell::KindMoment &moment);
  void take_touch(std::size_t, const GripTouch &touch) override { newest_s_ = touch.t_s; }
  void take_status(const GripperStatus &status) override { status_ = status; }
  GripReport step(double now_s, GripCommand &command) override;

private:
  struct Moment {
    double t_s, need_N, relaxed_N;
    bool lifts;
  };
  double elastic_N(double width_mm) const;
  double wanted_N() const;

  const cell::KindOfGrasp &grasp_;
  GripperMechanics gripper_;
  GripSettings settings_;
  double pads_N_; // at 1 mm of both together
  std::vector<Moment> moments_;
  GripperStatus status_{};
  GripReport report_{};
  double newest_s_ = 0.0, target_mm_ = 0.0, moved_s_ = 0.0;
};

} // namespace fingertip::grasp
