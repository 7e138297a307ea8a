#include "simulation/cell/faults.hpp"

extern "C" {
#include "common/contact_flags.h"
}

#include <cmath>

namespace fingertip::cell {

using Kind = Fault::Kind;

constexpr double LATE_s = 0.03;
constexpr double WRONG_mm = 10.0; // of the location
constexpr double BOOTS_s = 1.5, MOVED_N = 1.5, LESS = 0.3, SPIKE_N = 10.0, GATE_N = 0.05;

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

void Faults::watch(double t_s, std::uint8_t state) {
  if (state == fault_.state && std::isinf(begins_s_)) {
    begins_s_ = t_s + fault_.after_s;
  }
}

std::optional<GripTouch> Faults::frame(std::size_t finger, GripTouch touch) {
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
  case Kind::tared:
    if (fault_.kind == Kind::reboot && touch.t_s < begins_s_ + BOOTS_s) {
      return std::nullopt;
    }
    zero_[finger] = zero_[finger].value_or(touch);
    return less_by(touch, zero_[finger]->force_N, zero_[finger]->qx_N, zero_[finger]->qy_N);
  case Kind::frozen: {
    GripTouch frozen = last_[finger].value_or(touch);
    frozen.t_s = touch.t_s;
    last_[finger] = frozen;
    return frozen;
  }
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
    touch.flags |= contact ? CONTACT_FLAG_SATURATED | CONTACT_FLAG_FORCE_LOWER_BOUND : 0;
    touch.force_N /= contact ? 2 : 1;
    return touch;
  default: return touch;
  }
}

Faults::Line Faults::line(double t_s) {
  Line line;
  if (!lasts(t_s)) {
    return line;
  }
  const Kind kind = fault_.kind;
  const bool one = random_.next() % 2 == 0, other = random_.next() % 2 == 0;
  line.commands = kind != Kind::silent && kind != Kind::fault && (one || kind != Kind::noisy);
  line.answers = kind != Kind::silent && kind != Kind::unanswered && (other || kind != Kind::noisy);
  line.late_s = kind == Kind::late ? LATE_s : 0.0;
  return line;
}

} // namespace fingertip::cell
