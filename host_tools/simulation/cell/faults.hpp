// What fails in a trial, from a moment on: fingertips, the gripper, its line, the object.
#pragma once

#include "simulation/cell/gripper_line.hpp"
#include "simulation/cell/simulated_fingertip.hpp"

#include <limits>
#include <optional>

namespace fingertip::cell {

struct Fault {
  enum class Kind {
    none,
    gone,          // no frames
    frozen,        // readings stay, so every frame is the last one
    uncertain,     // UNCERTAIN: location and load are anything, the force is half where one lies
    saturated,     // SATURATED and FORCE_LOWER_BOUND: half the force
    silent,        // neither commands nor answers come through
    garbage,       // half of the commands do
    unanswered,    // all commands do
    noisy,         // half of the commands, half of the answers
    late,          // answers come 30 ms late, and the line waits for them
    latency_timer, // answers come at the end of 16 ms, and the line waits for them
    fault,         // 9: the gripper stops and takes no moves
    power,         // was lost and is back: not active
    taken,         // nothing is between the fingers any more
  };
  Kind kind = Kind::none;
  std::array<bool, 2> fingers{}; // of which fingertips
  // Begins so long after the controller first said this state, lasts so long, is watched so long.
  std::uint8_t state = GRIP_HOLDING;
  double after_s = 0.0, lasts_s = std::numeric_limits<double>::infinity(), watched_s = 2.0;
};

class Faults {
public:
  Faults(const Fault &fault, Random random) : fault_(fault), random_(random) {}

  // After each step of the controller.
  void look(double t_s, std::uint8_t state);
  const Fault &fault() const { return fault_; }
  bool has_begun(double t_s) const { return t_s >= begins_s_; }
  double begins_s() const { return begins_s_; } // infinity: not known yet
  bool is(Fault::Kind kind, double t_s) const { return fault_.kind == kind && lasts(t_s); }

  // What comes of a frame; none: nothing.
  std::optional<FeltFinger::Frame> frame(std::size_t finger, const FeltFinger::Frame &felt, double t_s);
  struct Line {
    bool commands = true, answers = true; // come through
    double late_s = 0.0;                  // the answer, and what is asked next
  };
  Line line(double t_s);

private:
  bool lasts(double t_s) const { return has_begun(t_s) && t_s < begins_s_ + fault_.lasts_s; }

  Fault fault_;
  Random random_;
  double begins_s_ = std::numeric_limits<double>::infinity();
  std::array<std::optional<GripTouch>, 2> last_;
};

} // namespace fingertip::cell
