#include "grasp/control/fixed.hpp"

#include <cmath>

namespace fingertip {

// An error below this share of the effect of the gripper's least move is ignored: no move would reduce it, and the gripper would oscillate.
// Settled rubber loses more force when the gripper opens than it gains when the gripper closes, so the two shares differ.
constexpr double CLOSES = 0.625, OPENS = 1.0;

std::uint32_t GripFixed::step(const GripReadings &readings, const GripSettings &settings, const GripperTraits &traits, double now_s,
                              GripReach &reach) {
  std::uint32_t trouble = 0;
  if (readings.fingers == 0 || (runs_ && now_s - stepped_s_ < settings.control_s)) {
    return trouble;
  }
  const double error_N = settings.set_N - readings.mean_N;
  const double move_N = reach.least_move_N(readings.mean_N);
  const bool mends = error_N > CLOSES * move_N || error_N < -OPENS * move_N;
  double slope_N_s = 0.0, integral_N_s = integral_N_s_;
  if (runs_) {
    const double passed_s = now_s - stepped_s_;
    slope_N_s = (error_N - error_N_) / passed_s;
    integral_N_s += mends ? error_N * passed_s : 0.0;
  }
  const double change_mm = settings.kp_mm_N * error_N + settings.ki_mm_Ns * integral_N_s + settings.kd_mm_s_N * slope_N_s;
  const double off_mm = reach.touch_width_mm() - change_mm - reach.target_mm();
  const double steps = std::round(off_mm / traits.step_mm);
  double next_mm = reach.target_mm() + (mends ? steps * traits.step_mm : 0.0);
  const bool beyond_cap = readings.is_alone() && next_mm < reach.last_below_cap_mm(readings, settings) - 1e-9;
  if (steps < 0.0 && (beyond_cap || readings.high_N >= settings.cap_N)) {
    trouble |= GRIP_AT_CAP;
    next_mm = reach.target_mm();
  }
  const double allowed_mm = reach.allowed(next_mm, readings, settings, trouble);
  if (allowed_mm == next_mm || integral_N_s < integral_N_s_) {
    integral_N_s_ = integral_N_s; // no wind-up at a limit
  }
  reach.send(allowed_mm);
  error_N_ = error_N;
  stepped_s_ = now_s;
  runs_ = true;
  return trouble;
}

} // namespace fingertip
