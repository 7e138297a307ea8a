// A simulated gripper at its line: once every poll_s a command goes out, if it is new, and what
// the gripper's state at that time arrives half of that time later.
#pragma once

#include "grasp/control/grip.hpp"
#include "libfingertip/random.hpp"
#include "simulation/cell/gripper_motion.hpp"

#include <cmath>

namespace fingertip::cell {

class GripperLine {
public:
  // At the start it is activated and has this width. random: when the first exchange is.
  GripperLine(const GripperMechanics &mechanics, double width_mm, Random random)
      : motion_(mechanics), next_s_(random.uniform(0.0, mechanics.traits.poll_s)) {
    constexpr double STEP_s = 0.01, LONGEST_s = 30.0;
    const auto step_while = [this](auto goes_on) {
      while ((motion_.*goes_on)() && motion_.time_s() < LONGEST_s) {
        motion_.step(STEP_s);
      }
    };
    motion_.activate();
    step_while(&GripperMotion::activating);
    GripperMove move;
    move.width_mm = width_mm;
    move.speed_mm_s = mechanics.traits.speed_max_mm_s;
    motion_.move(move);
    motion_.step(mechanics.traits.latency_s + STEP_s);
    step_while(&GripperMotion::moving);
  }

  GripperMotion &motion() { return motion_; }
  const GripperMotion &motion() const { return motion_; }
  double next_s() const { return next_s_; } // of the exchange
  struct Answer {
    double known_s;
    GripperStatus status;
  };
  // At next_s, to where motion() has been brought.
  Answer exchange(const GripCommand &command) {
    const double t_s = next_s_, poll_s = motion_.mechanics().traits.poll_s;
    if (command.motion == GRIP_ACTIVATE && sent_.motion != GRIP_ACTIVATE) {
      motion_.activate();
      sent_ = command;
    } else if (command.motion == GRIP_MOVE && (command.width_mm != sent_.width_mm || command.speed_mm_s != sent_.speed_mm_s)) {
      motion_.move(command);
      sent_ = command;
    }
    next_s_ += poll_s;
    GripperStatus status = motion_.status();
    status.host_us = std::llround(1e6 * t_s);
    return {t_s + 0.5 * poll_s, status};
  }
  // The last move that went out.
  const GripCommand &sent() const { return sent_; }

private:
  GripperMotion motion_;
  GripCommand sent_{};
  double next_s_;
};

} // namespace fingertip::cell
