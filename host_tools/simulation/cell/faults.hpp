// The faults of a trial: of fingertips, the gripper, its line, the object.
#pragma once

#include "grasp/control/grip.hpp"
#include "libfingertip/random.hpp"

#include <array>
#include <limits>
#include <optional>

namespace fingertip::cell {

struct Fault {
  enum class Kind {
    none,
    gone,       // no frames arrive
    frozen,     // the readings do not change, so every frame is the last one
    uncertain,  // UNCERTAIN: location and load are random; the force is halved if only one fingertip has it
    saturated,  // SATURATED and FORCE_LOWER_BOUND: the force is halved
    silent,     // neither commands nor answers arrive
    unanswered, // commands arrive, no answer does
    noisy,      // half of the commands and half of the answers arrive
    late,       // answers come 30 ms late, and the line waits for them
    fault,      // 9: the gripper stops and takes no moves
    power,      // power was lost and is back: the gripper is not active
    taken,      // the object is taken away
    nothing,    // no contact is reported
    tared,      // the present force and load count as zero
    reboot,     // no frames for 1.5 s, then as tared
    moved_zero, // the force is 1.5 N less
    weak,       // force and load are 30 % less
    spike,      // force and load are 10 N more
  };
  Kind kind = Kind::none;
  std::array<bool, 2> fingers{}; // of which fingertips
  // The fault begins after_s after the controller first reported this state; GRIP_STATES: never.
  std::uint8_t state = GRIP_STATES;
  double after_s = 0.0, lasts_s = std::numeric_limits<double>::infinity(), watched_s = 2.0;
  bool is_followed_by_pouring = true; // kind_trial.hpp
};

class Faults {
public:
  Faults(const Fault &fault, Random random) : fault_(fault), random_(random) {}

  // After each step of the controller.
  void watch(double t_s, std::uint8_t state);
  bool has_begun(double t_s) const { return t_s >= begins_s_; }
  double begins_s() const { return begins_s_; } // infinity: not known yet
  bool is(Fault::Kind kind, double t_s) const { return fault_.kind == kind && lasts(t_s); }

  // The frame that arrives, if any.
  std::optional<GripTouch> frame(std::size_t finger, GripTouch measured);
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
  std::array<std::optional<GripTouch>, 2> last_, zero_;
};

} // namespace fingertip::cell
