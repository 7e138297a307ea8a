// A controller as textbooks have it, to compare with: grip = 1.3 load / friction, 30 % more in a
// slide, rubber of one stiffness, one move every 100 ms.
#pragma once

#include "simulation/cell/kind_trial.hpp"

#include <array>

namespace fingertip::grasp {

class Textbook : public cell::Controller {
public:
  explicit Textbook(const GripperTraits &traits) : traits_(traits) {}
  void take_touch(std::size_t finger, const GripTouch &touch) override { touch_[finger] = touch; }
  void take_status(const GripperStatus &status) override { status_ = status; }
  GripReport step(double now_s, GripCommand &command) override;

private:
  void approach(double now_s, double low_N);
  void hold(double now_s, double low_N, double force_N, double load_N, bool slides);

  GripperTraits traits_;
  std::array<GripTouch, 2> touch_{};
  GripperStatus status_{};
  GripReport report_{};
  double target_mm_ = 0.0, moved_s_ = 0.0, held_s_ = 0.0, friction_ = 0.5, wanted_N_ = 2.0;
  bool begun_ = false, slides_ = false;
};

} // namespace fingertip::grasp
