#include "grasp/control/settings.hpp"

#include <algorithm>

namespace fingertip {

GripSettings default_settings(const GripperTraits &traits) {
  GripSettings settings;
  settings.cap_N = std::max(settings.cap_N, 1.05 * traits.force_min_N); // its own limit keeps it
  settings.release_width_mm = traits.stroke_mm;
  // Most of what is missing comes by the integral, in about five times the actuator's dead time;
  // two pads of 12 mm have 2 to 5 N/mm together at 2 to 8 N.
  const double dead_s = traits.latency_s + traits.poll_s + 0.01;
  settings.gains.ki_mm_Ns = std::clamp(0.06 / dead_s, 0.3, 4.0);
  settings.start_N = 4.0 + 1.5 * traits.step_mm; // what a step may miss
  // A coarse step makes more than enough, in the mean.
  settings.floor_N = std::max(1.3 - 1.1 * traits.step_mm, 0.5);
  settings.margin = std::max(1.05 + 11.0 * traits.latency_s - 0.5 * traits.step_mm, 1.0);
  return settings;
}

} // namespace fingertip
