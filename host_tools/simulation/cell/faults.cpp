#include "simulation/cell/faults.hpp"

extern "C" {
#include "common/contact_flags.h"
}

#include <cmath>

namespace fingertip::cell {
namespace {

constexpr double LATE_s = 0.03, LATENCY_TIMER_s = 0.016;
constexpr double LIES_mm = 10.0; // about where it touches

} // namespace

void Faults::watch(double t_s, std::uint8_t state) {
  if (state == fault_.state && std::isinf(begins_s_)) {
    begins_s_ = t_s + fault_.after_s;
  }
}

std::optional<SimulatedFingertip::Frame> Faults::frame(std::size_t finger, const SimulatedFingertip::Frame &measured,
                                                       double t_s) {
  using Kind = Fault::Kind;
  SimulatedFingertip::Frame frame = measured;
  if (!lasts(t_s) || !fault_.fingers[finger]) {
    last_[finger] = measured.touch;
    return frame;
  }
  GripTouch &touch = frame.touch;
  const bool contact = (touch.flags & CONTACT_FLAG_CONTACT) != 0;
  switch (fault_.kind) {
  case Kind::gone:
    return std::nullopt;
  case Kind::frozen:
    last_[finger] = last_[finger].value_or(touch);
    last_[finger]->t_s = touch.t_s;
    touch = *last_[finger];
    break;
  case Kind::uncertain:
    if (contact) {
      const double force_N = touch.force_N;
      touch.flags |= CONTACT_FLAG_UNCERTAIN;
      touch.x_mm = random_.uniform(-LIES_mm, LIES_mm);
      touch.y_mm = random_.uniform(-LIES_mm, LIES_mm);
      touch.qx_N = random_.uniform(-force_N, force_N);
      touch.qy_N = random_.uniform(-force_N, force_N);
      touch.force_N /= fault_.fingers[0] != fault_.fingers[1] ? 2 : 1;
    }
    break;
  case Kind::saturated:
    if (contact) {
      touch.flags |= CONTACT_FLAG_SATURATED | CONTACT_FLAG_FORCE_LOWER_BOUND;
      touch.force_N /= 2;
    }
    break;
  default:
    break;
  }
  return frame;
}

Faults::Line Faults::line(double t_s) {
  using Kind = Fault::Kind;
  Line line;
  if (!lasts(t_s)) {
    return line;
  }
  const bool one = random_.next() % 2 == 0, other = random_.next() % 2 == 0;
  switch (fault_.kind) {
  case Kind::silent:
    line.commands = line.answers = false;
    break;
  case Kind::garbage:
    line.commands = one;
    line.answers = false;
    break;
  case Kind::unanswered:
    line.answers = false;
    break;
  case Kind::noisy:
    line.commands = one;
    line.answers = other;
    break;
  case Kind::late:
    line.late_s = LATE_s;
    break;
  case Kind::latency_timer:
    line.late_s = LATENCY_TIMER_s;
    break;
  case Kind::fault:
    line.commands = false;
    break;
  default:
    break;
  }
  return line;
}

} // namespace fingertip::cell
