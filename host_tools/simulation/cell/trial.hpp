// One grasp, closed loop, in simulated time: a scene's object in the cell, two fingertips, a
// controller, and a gripper's mechanics between them.
//
// The controller steps after every frame and every status of the gripper (gripper_line.hpp), and
// every 10 ms.
//
// Deterministic: the same scene, seed and controller give the same bits. A grasp of 6 s takes some
// 60 ms at 410 frames a second.
#pragma once

#include "simulation/cell/controller.hpp"
#include "simulation/cell/faults.hpp"
#include "simulation/cell/gripper_line.hpp"
#include "simulation/cell/scene.hpp"
#include "simulation/cell/simulated_fingertip.hpp"
#include "simulation/cell/slips.hpp"

#include <optional>
#include <vector>

namespace fingertip::cell {

// The controller of grasp/control, grasping from the first step on.
class CoreController : public Controller {
public:
  CoreController(const GripSettings &settings, const GripperTraits &traits);
  void take_touch(std::size_t finger, const GripTouch &touch) override { core_.take(finger, touch); }
  void take_status(const GripperStatus &status) override { core_.take(status); }
  GripReport step(double now_s, GripCommand &command) override { return core_.step(now_s, command); }
  void ask(GripRequest request) override { core_.request(request); }

private:
  Grip core_;
};

struct Trial {
  Scene scene;
  GripperMechanics gripper;
  Sensing sensing;
  std::array<Rubber, 2> rubber;
  std::uint64_t seed = 0; // of noise and moments
  // Instead of a lift: the object stays on the table for still_s, and the grip's force should be set_N.
  double still_s = 0.0, set_N = 0.0;
  bool set_of_smaller = false; // set_N is compared with the smaller force, not with the mean
  // The gripper is not active at first and open; what it is to grasp comes between its fingers only
  // once it is active.
  bool activates = false;
  // A request, asked_after_s after the first HOLDING.
  std::optional<GripRequest> asked;
  double asked_after_s = 0.0;
  // This time after the lift, friction falls a tenth below the value that holds the object.
  std::optional<double> slick_after_s;
  // Ends when it has been watched. Where nothing is lifted by then, the hand lifts 0.8 s after it
  // began; after 1.2 s as much again is poured in: whatever controls would then like more force.
  std::optional<Fault> fault;
};

// Where all is known of a moment; for pictures and for tests.
struct Moment {
  double t_s;                                // since the beginning
  double lift_s;                             // since the lift began; below 0 before
  double width_mm, force_N, least_N, load_N; // of one fingertip: what pulls, the mean of both
  double way_mm, slid_mm, turned_rad;
  double friction;
  bool slips;
  double sensed_N, sensed_load_N, wanted_N; // as the controller has it
  std::uint8_t state;
  std::uint32_t trouble;
};

constexpr double DROP_mm = 22.0, SETTLED_s = 0.5;

// Since a fault began.
struct Failed {
  bool begun = false;
  double opened_mm = 0.0;    // the fingers wider than when it began, at most, with the object between them
  double peak_N = 0.0;       // the largest true force of a fingertip
  std::uint32_t trouble = 0; // all that was ever on
  std::uint8_t state = 0;    // at the end
  std::uint8_t gripper_fault = 0;
};

struct Outcome {
  bool held = false; // to the end
  // Why not: it slid DROP_mm or the grip lost it; the controller never came to hold.
  bool dropped = false, never_held = false, crushed = false;
  double slid_mm = 0.0, turned_rad = 0.0, peak_N = 0.0;
  double lift_slip_mm = 0.0, disturbance_slip_mm = 0.0; // until the lift is over; after it
  // Medians from the lift's end on: force over least force; reported over true force; the controller's
  // force over the true force.
  double margin = 0.0, force_reported = 0.0, force_taken = 0.0;
  double holding_s = 0.0;  // from the first touch to the controller's HOLDING
  std::vector<Slip> slips; // since the lift began
  // Only for a still trial.
  std::optional<double> settle_s; // from the touch until it stays within 10 % for SETTLED_s
  double rms = 0.0;               // of the error, share of the set force, from there on
  double rms_of_steps = 0.0;      // what rounding the width to the gripper's steps makes alone
  int reversals = 0;              // of the commanded width over the last half of the time
  std::uint32_t trouble = 0;      // all that was ever on while holding
  Failed failed;
};

// face must be the scene's. trace: called every 2 ms.
Outcome run_trial(const Trial &trial, const Face &face, Controller &controller,
                  const std::function<void(const Moment &)> &trace = {});

} // namespace fingertip::cell
