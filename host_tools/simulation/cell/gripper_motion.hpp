// How a simulated gripper's fingers move, in simulated time: no line, no clock, no chance.
//
// A command counts after the latency, and one that came later replaces it only after its own. Fingers run at constant speed to the nearest
// step and stop at once; what accelerates is not modelled, and nothing but backlash lets an object push them apart: a 2F-85's screw holds,
// a servo would yield. Latencies and the servo's backlash are assumptions, no measurements.
#pragma once

#include "grasp/control/grip.hpp"
#include "libfingertip/random.hpp"

#include <deque>
#include <functional>
#include <optional>
#include <string>

namespace fingertip {

struct GripperMechanics {
  GripperTraits traits;      // its step, deadband, speeds, latency, stroke
  double backlash_mm = 0.0;  // of the width: what the drive turns before the fingers follow
  double activation_s = 0.0; // of searching its ends: open, closed, open; 0: active at once
};

// The mechanics of gripper_models(), and of "ideal": steps of 0.01 mm, 3 ms. Throws Error: an unknown model.
GripperMechanics gripper_mechanics(const std::string &model);

class GripperMotion {
public:
  // Active, the fingers at the step nearest to this width; none: not active yet, and open.
  explicit GripperMotion(const GripperMechanics &mechanics, std::optional<double> active_mm = {});

  // Whether what is between the fingers pushes back with at least force_N at this width; below 0: what is around them, while they open.
  // Asked with widths that the fingers are about to take, and for backlash with the least force; must be true for all narrower widths if it
  // is for one. Empty: nothing is there.
  std::function<bool(double width_mm, double force_N)> blocked_at;

  // Where its ends are searched, opens and closes fully, at whatever force, so that what is held falls; then it takes moves.
  void activate();
  // Power is lost: the fingers stay, commands do nothing until activate.
  void power_off();
  // Ignored unless active, or if it repeats the last one; values beyond the traits' limits are clamped.
  void move(const GripCommand &move);
  // Stops after the latency where the fingers are then.
  void stop();

  // Advances by this time. Contacts are found to 1 um only if no step is longer
  // than it takes to pass through an object. O(1) apart from blocked_at: at most 20 calls.
  void step(double seconds);

  // The true width between the fingers.
  double width_mm() const { return fingers_mm_; }
  // The width that the gripper reports: its drive's position, in its steps.
  double reported_width_mm() const { return nearest_step_mm(drive_mm_); }
  // 0 to 1, for the currents that a gripper reports.
  double effort() const;
  bool active() const { return phase_ == Phase::active; }
  bool activating() const { return phase_ != Phase::off && phase_ != Phase::active; }
  // Whether it moves, or will by a command that is under way.
  bool moving() const { return moving_ || activating() || !commands_.empty(); }
  // Stopped by blocked_at: 1 while opening, -1 while closing; 0: not.
  int blocked() const { return blocked_; }
  double time_s() const { return time_s_; }
  const GripperMechanics &mechanics() const { return mechanics_; }
  // All of it but host_us and fault.
  GripperStatus status() const;

private:
  enum class Phase { off, opening, closing, reopening, active };
  struct Command {
    double due_s;
    bool stop;
    GripCommand move;
  };

  bool blocks(double width_mm, double force_N) const { return blocked_at && blocked_at(width_mm, force_N); }
  double nearest_step_mm(double width_mm) const;
  void take(const Command &command);
  void run(double seconds);
  void drive_to(double target_mm, double speed_mm_s, double force_N, double seconds);
  void follow();

  GripperMechanics mechanics_;
  Phase phase_;
  std::deque<Command> commands_;     // not yet counting, in order
  std::optional<GripCommand> asked_; // last
  double time_s_ = 0.0;
  double phase_began_s_ = 0.0;
  double drive_mm_, fingers_mm_;
  double target_mm_, speed_mm_s_, force_N_;
  bool moving_ = false;
  int blocked_ = 0;
};

// A simulated gripper at its line: once every poll_s a command goes out, if it is new, and what
// the gripper's state at that time arrives half of that time later.
class GripperLine {
public:
  // random: when the first exchange is.
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

} // namespace fingertip
