#include "simulation/cell/faults.hpp"

extern "C" {
#include "common/contact_flags.h"
}

#include <cmath>

namespace fingertip::cell {
namespace {

using Kind = Fault::Kind;

constexpr double LATE_s = 0.03, LATENCY_TIMER_s = 0.016;
constexpr double WRONG_mm = 10.0; // of the location

} // namespace

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
  if (fault_.kind == Kind::gone) {
    return std::nullopt;
  }
  if (fault_.kind == Kind::frozen) {
    GripTouch frozen = last_[finger].value_or(touch);
    frozen.t_s = touch.t_s;
    last_[finger] = frozen;
    return frozen;
  }
  if (fault_.kind == Kind::uncertain && contact) {
    const double force_N = touch.force_N;
    touch.flags |= CONTACT_FLAG_UNCERTAIN;
    touch.x_mm = random_.uniform(-WRONG_mm, WRONG_mm);
    touch.y_mm = random_.uniform(-WRONG_mm, WRONG_mm);
    touch.qx_N = random_.uniform(-force_N, force_N);
    touch.qy_N = random_.uniform(-force_N, force_N);
    touch.force_N /= fault_.fingers[0] != fault_.fingers[1] ? 2 : 1;
  }
  if (fault_.kind == Kind::saturated && contact) {
    touch.flags |= CONTACT_FLAG_SATURATED | CONTACT_FLAG_FORCE_LOWER_BOUND;
    touch.force_N /= 2;
  }
  return touch;
}

Faults::Line Faults::line(double t_s) {
  Line line;
  if (!lasts(t_s)) {
    return line;
  }
  const Kind kind = fault_.kind;
  const bool one = random_.next() % 2 == 0, other = random_.next() % 2 == 0;
  const bool half = kind == Kind::garbage || kind == Kind::noisy;
  line.commands = kind != Kind::silent && kind != Kind::fault && (one || !half);
  line.answers =
      kind != Kind::silent && kind != Kind::garbage && kind != Kind::unanswered && (other || kind != Kind::noisy);
  line.late_s = kind == Kind::late ? LATE_s : kind == Kind::latency_timer ? LATENCY_TIMER_s : 0.0;
  return line;
}

} // namespace fingertip::cell
