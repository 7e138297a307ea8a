// A simulated gripper at its line: once every poll_s a command goes out, if it is new, and what
// the gripper's state at that time arrives half of that time later.
#pragma once

#include "grasp/control/grip.hpp"
#include "libfingertip/random.hpp"
#include "simulation/cell/gripper_motion.hpp"

namespace fingertip::cell {

class GripperLine {
public:
  // At the start it is activated and has this width. random: when the first exchange is.
  GripperLine(const GripperMechanics &mechanics, double width_mm, Random random);

  GripperMotion &motion() { return motion_; }
  const GripperMotion &motion() const { return motion_; }
  double next_s() const { return next_s_; } // of the exchange
  struct Answer {
    double known_s;
    GripperStatus status;
  };
  // At next_s, to where motion() has been brought.
  Answer exchange(const GripCommand &command);
  // The last move that went out.
  const GripCommand &sent() const { return sent_; }

private:
  GripperMotion motion_;
  GripCommand sent_{};
  double next_s_;
};

} // namespace fingertip::cell
