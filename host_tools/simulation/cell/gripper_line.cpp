#include "simulation/cell/gripper_line.hpp"

#include <cmath>

namespace fingertip::cell {

GripperLine::GripperLine(const GripperMechanics &mechanics, double width_mm, Random random)
    : motion_(mechanics), next_s_(random.uniform(0.0, mechanics.traits.poll_s)) {
  constexpr double STEP_s = 0.01, LONGEST_s = 30.0;
  motion_.activate();
  while (!motion_.active() && motion_.time_s() < LONGEST_s) {
    motion_.step(STEP_s);
  }
  GripperMove move;
  move.width_mm = width_mm;
  move.speed_mm_s = mechanics.traits.speed_max_mm_s;
  motion_.move(move);
  motion_.step(mechanics.traits.latency_s + STEP_s);
  while (motion_.moving() && motion_.time_s() < LONGEST_s) {
    motion_.step(STEP_s);
  }
}

GripperLine::Answer GripperLine::exchange(const GripCommand &command) {
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

} // namespace fingertip::cell
