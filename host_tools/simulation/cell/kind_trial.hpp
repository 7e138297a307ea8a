// One grasp of a kind (kinds.hpp), closed loop, in simulated time: the pinch (pinch.hpp), what two
// fingertips report of it, a controller, and a gripper's mechanics.
//
// A simplified fingertip reports the truth with the kind's errors and noise. The firmware's own
// motion.c decides from that whether it slides. Frames come 410 times a second.
//
// Deterministic: the same grasp, seed and controller give the same bits.
#pragma once

#include "simulation/cell/controller.hpp"
#include "simulation/cell/gripper_motion.hpp"
#include "simulation/cell/kinds.hpp"

#include <functional>
#include <optional>
#include <vector>

namespace fingertip::cell {

// A slide of 0.3 mm or more that ended before the object was lost.
struct Catch {
  double begin_s; // since the lift began
  double way_mm;
  std::optional<double> reaction_s; // until the grip was 5 % stronger
  double peak_N, least_N;           // from its beginning to 1 s after its end, the largest of each
};

struct KindOutcome {
  bool dropped = false, never_held = false, crushed = false, hunts = false;
  double slid_mm = 0.0, peak_N = 0.0;
  double first_N = 0.0;     // the largest force before the lift
  double margin = 0.0;      // median of force over least force, from the lift's end on
  double reversals_s = 0.0; // of the commanded width, a second, while nothing happens any more
  double held_s = 0.0;      // from the beginning to HOLDING
  std::vector<Catch> catches;
};

struct KindMoment {
  double t_s, lift_s, width_mm, sent_mm, left_N, right_N, least_N, load_N, slid_mm;
  bool slips;
  GripReport report;
};

struct KindTrial {
  KindOfGrasp grasp;
  GripperMechanics gripper;
  std::uint64_t seed = 0;
  double later_s = 0.0; // additional delay of all frames
};

// trace: called every 2 ms.
KindOutcome run_kind(const KindTrial &trial, Controller &controller,
                     const std::function<void(const KindMoment &)> &trace = {});

} // namespace fingertip::cell
