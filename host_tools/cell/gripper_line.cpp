#include "cell/gripper_line.hpp"

#include <cmath>

namespace fingertip::cell {
namespace {

std::int32_t in_um(double mm) {
  return static_cast<std::int32_t>(std::lround(1e3 * mm));
}

grip_status status_of(const GripperMotion &motion, double t_s) {
  const GripperStatus said = motion.status();
  grip_status status{};
  status.t_us = static_cast<std::uint64_t>(std::llround(1e6 * t_s));
  status.width_um = in_um(said.width_mm);
  status.is_active = said.active;
  status.is_moving = said.moving;
  status.object = static_cast<std::uint8_t>(!said.object   ? GRIP_OBJECT_UNKNOWN
                                            : *said.object ? GRIP_OBJECT_HELD
                                                           : GRIP_OBJECT_NONE);
  status.fault = said.fault;
  return status;
}

} // namespace

grip_traits traits_of(const GripperTraits &traits) {
  grip_traits told{};
  told.stroke_um = in_um(traits.stroke_mm);
  told.step_um = in_um(traits.step_mm);
  told.deadband_um = in_um(traits.deadband_mm);
  told.speed_min_um_s = in_um(traits.speed_min_mm_s);
  told.speed_max_um_s = in_um(traits.speed_max_mm_s);
  told.force_min_mN = in_um(traits.force_min_N);
  told.force_max_mN = in_um(traits.force_max_N);
  told.latency_us = static_cast<std::int32_t>(std::lround(1e6 * traits.latency_s));
  told.poll_us = static_cast<std::int32_t>(std::lround(1e6 * traits.poll_s));
  return told;
}

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

void GripperLine::press(const Cell &cell) {
  motion_.blocked_at = [&cell](double width_mm, double force_N) {
    return force_N > 0.0 && cell.force_at_N(width_mm) >= force_N;
  };
}

GripperLine::Said GripperLine::exchange(const grip_command &command) {
  const double t_s = next_s_, poll_s = motion_.mechanics().traits.poll_s;
  if (command.motion == GRIP_ACTIVATE) {
    motion_.activate();
  } else if (command.motion == GRIP_MOVE &&
             (command.width_um != sent_.width_um || command.speed_um_s != sent_.speed_um_s)) {
    motion_.move({.width_mm = 1e-3 * command.width_um,
                  .speed_mm_s = 1e-3 * command.speed_um_s,
                  .force_N = 1e-3 * command.force_mN});
    sent_ = command;
  }
  next_s_ += poll_s;
  return {t_s + 0.5 * poll_s, status_of(motion_, t_s)};
}

} // namespace fingertip::cell
