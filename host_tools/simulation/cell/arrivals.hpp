// What is on its way to the controller: touches and the gripper's answers, each late by its own delay.
#pragma once

#include "simulation/cell/controller.hpp"

#include <algorithm>
#include <cstddef>
#include <deque>
#include <limits>

namespace fingertip::cell {

class Arrivals {
public:
  void touch(double at_s, std::size_t finger, const GripTouch &touch) { known_.push_back({at_s, finger, touch, {}}); }
  void status(double at_s, const GripperStatus &status) { known_.push_back({at_s, GRIPPER, {}, status}); }
  // Infinity: nothing is on its way.
  double next_s() const {
    double next_s = std::numeric_limits<double>::infinity();
    for (const Known &known : known_) {
      next_s = std::min(next_s, known.at_s);
    }
    return next_s;
  }
  // Hands over what has come, in the order in which it was sent. After each, after(finger, touch)
  // or after(): the controller may step.
  template <class AFTER_TOUCH, class AFTER_STATUS>
  void deliver(double now_s, Controller &controller, AFTER_TOUCH after_touch, AFTER_STATUS after_status) {
    for (auto known = known_.begin(); known != known_.end();) {
      if (known->at_s > now_s) {
        ++known;
        continue;
      }
      const Known come = *known;
      known = known_.erase(known);
      if (come.from == GRIPPER) {
        controller.take_status(come.status);
        after_status();
      } else {
        controller.take_touch(come.from, come.touch);
        after_touch(come.from, come.touch);
      }
    }
  }

private:
  static constexpr std::size_t GRIPPER = 2; // instead of a fingertip
  struct Known {
    double at_s;
    std::size_t from;
    GripTouch touch;
    GripperStatus status;
  };
  std::deque<Known> known_;
};

} // namespace fingertip::cell
