// The faults of a trial: of fingertips, the gripper, its line, the object.
#pragma once

#include "grasp/control/grip.hpp"
#include "libfingertip/random.hpp"

extern "C" {
#include "common/contact_flags.h"
}

#include <array>
#include <cmath>
#include <limits>
#include <optional>

namespace fingertip::cell {

struct Fault {
  enum class Kind {
    none,
    gone,          // no frames arrive
    frozen,        // the readings do not change, so every frame is the last one
    uncertain,     // UNCERTAIN: location and load are random; the force is halved if only one fingertip has it
    saturated,     // SATURATED and FORCE_LOWER_BOUND: the force is halved
    silent,        // neither commands nor answers arrive
    garbage,       // half of the commands arrive, no answer does
    unanswered,    // all commands arrive, no answer does
    noisy,         // half of the commands and half of the answers arrive
    late,          // answers come 30 ms late, and the line waits for them
    latency_timer, // answers come at the end of 16 ms, and the line waits for them
    fault,         // 9: the gripper stops and takes no moves
    power,         // power was lost and is back: the gripper is not active
    taken,         // the object is taken away
    nothing,       // no contact is reported
    tared,         // the present force and load count as zero
    reboot,        // no frames for 1.5 s, then as tared
    moved_zero,    // the force is 1.5 N less
    weak,          // force and load are 30 % less
    spike,         // force and load are 10 N more
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
  void watch(double t_s, std::uint8_t state) {
    if (state == fault_.state && std::isinf(begins_s_)) {
      begins_s_ = t_s + fault_.after_s;
    }
  }
  bool has_begun(double t_s) const { return t_s >= begins_s_; }
  double begins_s() const { return begins_s_; } // infinity: not known yet
  bool is(Fault::Kind kind, double t_s) const { return fault_.kind == kind && lasts(t_s); }

  // The frame that arrives, if any.
  std::optional<GripTouch> frame(std::size_t finger, GripTouch touch) {
    if (!lasts(touch.t_s) || !fault_.fingers[finger]) {
      last_[finger] = touch;
      return touch;
    }
    const bool contact = (touch.flags & CONTACT_FLAG_CONTACT) != 0;
    switch (fault_.kind) {
    case Kind::gone: return std::nullopt;
    case Kind::nothing: return less_by(touch, touch.force_N, 0.0, 0.0);
    case Kind::weak: return less_by(touch, LESS * touch.force_N, LESS * touch.qx_N, LESS * touch.qy_N);
    case Kind::moved_zero: return less_by(touch, MOVED_N, 0.0, 0.0);
    case Kind::spike: return less_by(touch, -SPIKE_N, 0.0, -SPIKE_N);
    case Kind::reboot:
      if (touch.t_s < begins_s_ + BOOTS_s) {
        return std::nullopt;
      }
      [[fallthrough]];
    case Kind::tared:
      zero_[finger] = zero_[finger].value_or(touch);
      return less_by(touch, zero_[finger]->force_N, zero_[finger]->qx_N, zero_[finger]->qy_N);
    case Kind::frozen:
      last_[finger] = last_[finger].value_or(touch);
      last_[finger]->t_s = touch.t_s;
      return last_[finger];
    case Kind::uncertain:
      if (contact) {
        const double force_N = touch.force_N;
        touch.flags |= CONTACT_FLAG_UNCERTAIN;
        touch.x_mm = random_.uniform(-WRONG_mm, WRONG_mm);
        touch.y_mm = random_.uniform(-WRONG_mm, WRONG_mm);
        touch.qx_N = random_.uniform(-force_N, force_N);
        touch.qy_N = random_.uniform(-force_N, force_N);
        touch.force_N /= fault_.fingers[0] != fault_.fingers[1] ? 2 : 1;
      }
      return touch;
    case Kind::saturated:
      if (contact) {
        touch.flags |= CONTACT_FLAG_SATURATED | CONTACT_FLAG_FORCE_LOWER_BOUND;
        touch.force_N /= 2;
      }
      return touch;
    default: return touch;
    }
  }
  struct Line {
    bool commands = true, answers = true; // come through
    double late_s = 0.0;                  // the answer, and what is asked next
  };
  Line line(double t_s) {
    Line line;
    if (!lasts(t_s)) {
      return line;
    }
    const Kind kind = fault_.kind;
    const bool one = random_.next() % 2 == 0, other = random_.next() % 2 == 0;
    const bool half = kind == Kind::garbage || kind == Kind::noisy;
    line.commands = kind != Kind::silent && kind != Kind::fault && (one || !half);
    line.answers = kind != Kind::silent && kind != Kind::garbage && kind != Kind::unanswered && (other || kind != Kind::noisy);
    line.late_s = kind == Kind::late ? LATE_s : kind == Kind::latency_timer ? LATENCY_TIMER_s : 0.0;
    return line;
  }

private:
  using Kind = Fault::Kind;
  static constexpr double LATE_s = 0.03, LATENCY_TIMER_s = 0.016;
  static constexpr double WRONG_mm = 10.0; // of the location
  static constexpr double BOOTS_s = 1.5, MOVED_N = 1.5, LESS = 0.3, SPIKE_N = 10.0, GATE_N = 0.05;

  // Less than a contact's least force is none.
  static GripTouch less_by(GripTouch touch, double force_N, double qx_N, double qy_N) {
    touch.force_N -= force_N;
    touch.qx_N -= qx_N;
    touch.qy_N -= qy_N;
    if (touch.force_N < GATE_N) {
      GripTouch nothing;
      nothing.t_s = touch.t_s;
      return nothing;
    }
    return touch;
  }

  bool lasts(double t_s) const { return has_begun(t_s) && t_s < begins_s_ + fault_.lasts_s; }

  Fault fault_;
  Random random_;
  double begins_s_ = std::numeric_limits<double>::infinity();
  std::array<std::optional<GripTouch>, 2> last_, zero_;
};

} // namespace fingertip::cell
