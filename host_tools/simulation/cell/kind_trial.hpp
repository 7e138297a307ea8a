// One grasp (kinds.hpp), closed loop, in simulated time: the cell (cell.hpp), what two fingertips
// report of it, a controller, and a gripper's mechanics.
//
// The controller steps after every frame and every status of the gripper (gripper_motion.hpp), and
// every 10 ms. Deterministic: the same grasp, seed and controller give the same bits.
#pragma once

#include "grasp/control/grip.hpp"
#include "simulation/cell/face.hpp"
#include "simulation/cell/faults.hpp"
#include "simulation/cell/gripper_motion.hpp"
#include "simulation/cell/kinds.hpp"
#include "simulation/cell/slips.hpp"

#include <functional>
#include <optional>
#include <utility>
#include <vector>

namespace fingertip::cell {

class Controller {
public:
  virtual ~Controller() = default;
  virtual void take_touch(std::size_t finger, const GripTouch &touch) = 0;
  virtual void take_status(const GripperStatus &status) = 0;
  virtual GripReport step(double now_s, GripCommand &command) = 0;
  virtual void ask(GripRequest) {}
};

// The controller of grasp/control, grasping from the first step on.
class CoreController : public Controller {
public:
  CoreController(const GripSettings &settings, const GripperTraits &traits) : core_(settings, traits) { core_.request(GRIP_REQUEST_GRASP); }
  void take_touch(std::size_t finger, const GripTouch &touch) override { core_.take(finger, touch); }
  void take_status(const GripperStatus &status) override { core_.take(status); }
  GripReport step(double now_s, GripCommand &command) override { return core_.step(now_s, command); }
  void ask(GripRequest request) override { core_.request(request); }

private:
  Grip core_;
};

struct GraspTrial {
  GraspScenario grasp;
  GripperMechanics gripper;
  std::uint64_t seed = 0;
  double later_s = 0.0;       // additional delay of all frames
  double rate_Hz = 410.0;     // of frames
  bool estimates_load = true; // the fingertips know their pads

  // Instead of a lift: the object stays on the table for still_s, and the grip's force should be set_N,
  // by the mean of both reports or by the smaller one.
  double still_s = 0.0, set_N = 0.0;
  bool set_of_smaller = false;

  // The gripper is not active at first and open; the object comes between its fingers only once it is.
  bool activates = false;
  // A request, asked_after_s after the first HOLDING.
  std::optional<GripRequest> asked;
  double asked_after_s = 0.0;
  // This time after the lift began friction falls a tenth below the value that holds the object.
  std::optional<double> slick_after_s;
  // The trial ends when the fault has been watched. Where nothing is lifted by then, the hand lifts 0.8 s after it began; after 1.2 s as
  // much mass again is poured in, unless the fault is not followed by that: any controller would then like more force.
  std::optional<Fault> fault;
};

// Since a fault began.
struct FaultOutcome {
  bool begun = false;
  double before_N = 0.0, after_N = 0.0; // the grip when it began, 0: dropped by then; the largest since
  double opened_mm = 0.0;               // the fingers wider than when it began, at most, with the object between them
  std::uint32_t trouble = 0;            // all that was ever on
  std::uint8_t state = 0;               // at the end
  std::uint8_t gripper_fault = 0;
  std::optional<double> released_s = {}; // since the lift began, when it was going to open
};

struct TrialOutcome {
  bool dropped = false, never_held = false, crushed = false, hunts = false;
  double slid_mm = 0.0, peak_N = 0.0;
  double first_N = 0.0;      // the largest force before the lift
  double turned_deg = 0.0;   // about the grip's axis, the most since the lift
  double margin = 0.0;       // median of force over least force, from the lift's end on
  double friction = 0.0;     // what the controller learnt at the end, of the true one
  std::uint32_t slides = 0;  // that the controller counted
  std::vector<Slip> catches; // slides that ended before the object was lost
  // Only of a still trial.
  std::optional<double> settle_s; // from the touch until the force stays within 10 % for 0.5 s
  double rms = 0.0;               // of the error from there on, share of the set force
  int reversals = 0;              // of the commanded width over the last half of the time
  FaultOutcome failed;
};

// What is true at a time, by name; lift_s: since the lift began, -1 before it.
using TrialTrace = std::function<void(const std::vector<std::pair<const char *, double>> &moment)>;

// trace: called every 2 ms.
TrialOutcome run_trial(const GraspTrial &trial, const Face &face, Controller &controller, const TrialTrace &trace = {});

} // namespace fingertip::cell
