#include "grasp/control/settings.hpp"

#include <algorithm>

namespace fingertip {

// All constants but those of the integral gain were chosen in simulated grasps (CONTROL.md).

// The gripper's own force limit must be able to stay below the cap.
constexpr double CAP_OVER_LEAST_FORCE = 1.05;

// The integral closes most of an error within about five dead times. Two pads of 12 mm have 2 to
// 5 N/mm together at 2 to 8 N, so one dead time may correct 0.06 mm for each newton.
constexpr double INTEGRAL_mm_N = 0.06, INTEGRAL_LEAST_mm_Ns = 0.3, INTEGRAL_MOST_mm_Ns = 4.0;
constexpr double FINGERTIP_DELAY_s = 0.01; // from a measurement to the controller

// A coarse gripper starts firmer, because its first grip may be one step short.
constexpr double START_N = 4.0, START_N_mm = 1.5;

// Later it overshoots by half a step on average, so it needs a smaller floor and a smaller margin.
constexpr double FLOOR_N = 1.3, FLOOR_N_mm = 1.1, FLOOR_LEAST_N = 0.5;

// A slow gripper needs a larger margin, because the load grows until it moves.
constexpr double MARGIN = 1.05, MARGIN_1_s = 11.0, MARGIN_1_mm = 0.5, MARGIN_LEAST = 1.0;

GripSettings default_settings(const GripperTraits &traits) {
  GripSettings settings;
  settings.cap_N = std::max(settings.cap_N, CAP_OVER_LEAST_FORCE * traits.force_min_N);
  settings.release_width_mm = traits.stroke_mm;
  const double dead_s = traits.latency_s + traits.poll_s + FINGERTIP_DELAY_s;
  settings.gains.ki_mm_Ns = std::clamp(INTEGRAL_mm_N / dead_s, INTEGRAL_LEAST_mm_Ns, INTEGRAL_MOST_mm_Ns);
  settings.start_N = START_N + START_N_mm * traits.step_mm;
  settings.floor_N = std::max(FLOOR_N - FLOOR_N_mm * traits.step_mm, FLOOR_LEAST_N);
  settings.margin = std::max(MARGIN + MARGIN_1_s * traits.latency_s - MARGIN_1_mm * traits.step_mm, MARGIN_LEAST);
  return settings;
}

} // namespace fingertip
