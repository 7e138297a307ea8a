// As textbooks have it: grip = 1.3 load / friction, 30 % more in a slide, rubber of one stiffness, one move every 100 ms.
#pragma once

#include "simulation/cell/kind_trial.hpp"

extern "C" {
#include "common/contact_flags.h"
}

#include <algorithm>
#include <array>
#include <cmath>

namespace fingertip::grasp {

class Textbook : public cell::Controller {
public:
  explicit Textbook(const GripperTraits &traits) : traits_(traits) {}
  void take_touch(std::size_t finger, const GripTouch &touch) override { touch_[finger] = touch; }
  void take_status(const GripperStatus &status) override { status_ = status; }

  GripReport step(double now_s, GripCommand &command) override {
    if (status_.host_us != 0) {
      target_mm_ = report_.state == GRIP_IDLE ? status_.width_mm : target_mm_;
      report_.state = std::max<std::uint8_t>(report_.state, GRIP_APPROACH);
      const double low_N = std::min(touch_[0].force_N, touch_[1].force_N);
      report_.state == GRIP_APPROACH ? approach(now_s, low_N) : hold(now_s, low_N);
      command.motion = GRIP_MOVE;
      command.width_mm = target_mm_;
      command.speed_mm_s = traits_.speed_max_mm_s;
      command.force_N = 25.0;
    }
    report_.wanted_N = wanted_N_;
    return report_;
  }

private:
  static constexpr double FIRST_N = 2.0, TOUCH_N = 0.15, MOST_N = 20.0, MARGIN = 1.3, SLID = 1.3;
  static constexpr double APPROACH_mm_s = 8.0, STIFFNESS_N_mm = 3.0, MOVES_s = 0.1, SETTLED_s = 0.2;

  void approach(double now_s, double low_N) {
    if (low_N >= TOUCH_N) {
      report_.state = GRIP_SQUEEZE;
    } else if (now_s - moved_s_ >= traits_.step_mm / APPROACH_mm_s) {
      target_mm_ = std::max(0.0, target_mm_ - traits_.step_mm);
      moved_s_ = now_s;
    }
  }

  void hold(double now_s, double low_N) {
    if (report_.state == GRIP_SQUEEZE) {
      held_s_ = low_N < 0.6 * FIRST_N ? now_s : held_s_;
      report_.state = now_s - held_s_ > SETTLED_s ? GRIP_HOLDING : GRIP_SQUEEZE;
    } else {
      const auto load_of = [](const GripTouch &touch) { return std::hypot(touch.qx_N, touch.qy_N); };
      const double load_N = 0.5 * (load_of(touch_[0]) + load_of(touch_[1])), force_N = 0.5 * (touch_[0].force_N + touch_[1].force_N);
      const bool slides = ((touch_[0].flags | touch_[1].flags) & CONTACT_FLAG_SLIDING) != 0;
      if (slides && !slides_) {
        friction_ = std::clamp(load_N / std::max(force_N, 0.1), 0.1, friction_);
        wanted_N_ = SLID * low_N;
      }
      slides_ = slides;
      wanted_N_ = std::clamp(std::max(MARGIN * load_N / friction_, slides ? wanted_N_ : FIRST_N), FIRST_N, MOST_N);
    }
    if (now_s - moved_s_ >= MOVES_s) {
      target_mm_ -= traits_.step_mm * std::round((wanted_N_ - low_N) / (STIFFNESS_N_mm * traits_.step_mm));
      moved_s_ = now_s;
    }
  }

  GripperTraits traits_;
  std::array<GripTouch, 2> touch_{};
  GripperStatus status_{};
  GripReport report_{};
  double target_mm_ = 0.0, moved_s_ = 0.0, held_s_ = 0.0, friction_ = 0.5, wanted_N_ = 2.0;
  bool slides_ = false;
};

} // namespace fingertip::grasp
