#include "tool/validation/walk.hpp"

#include "libfingertip/text.hpp"
#include "tool/calibration/gain_session.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip::validating {
namespace {

using Finder = calibrating::PlacementFinder;

std::string seconds_left(double all_s, double done_s) {
  return fixed(std::ceil(std::max(all_s - done_s, 0.0)), 0) + " s";
}

} // namespace

Walk::Walk(const wire_info &info, double weight_g, double skin_mm, const Pulling &pulling)
    : marks_(marks_of(calibrating::array_of(info)).size()), gatherer_(info) {
  steps_ = steps_of(marks_of(calibrating::array_of(info)), weight_g, skin_mm, pulling);
}

void Walk::begin(std::vector<Step> &begun) {
  begun.push_back(steps_[next_++]);
  gatherer_.step(begun.back());
  is_taken_ = false;
}

std::vector<Step> Walk::take(const wire_packet &packet) {
  std::vector<Step> begun;
  if (is_done()) {
    return begun;
  }
  if (next_ == 0) {
    begin(begun); /* the weight */
    begin(begun); /* the empty minute */
    return begun;
  }
  gatherer_.packet(packet);
  if (packet.type != WIRE_RAW) {
    return begun; /* a frame is whole with its readings */
  }
  is_taken_ = is_taken_ || gatherer_.has_done();
  const bool is_free = gatherer_.finder().state() == Finder::State::resting;
  bool is_over = false;
  switch (now().kind) {
  case Step::Kind::empty:
    is_over = gatherer_.step_s() >= EMPTY_s && is_free;
    break;
  case Step::Kind::press:
  case Step::Kind::pull:
    is_over = is_taken_ && is_free;
    break;
  case Step::Kind::hold:
    is_over = gatherer_.touched_s() >= HOLD_s;
    break;
  case Step::Kind::rest:
    is_over = gatherer_.released_s() >= REST_s;
    break;
  case Step::Kind::begin:
  case Step::Kind::take_back:
  case Step::Kind::end:
    break;
  }
  if (is_over) {
    begin(begun);
  }
  return begun;
}

std::vector<Step> Walk::take_back() {
  std::vector<Step> begun;
  if (next_ == 0 || is_done()) {
    return begun;
  }
  /* The last that was taken: of this step, or of the one before. */
  const std::size_t last = is_taken_ ? next_ - 1 : next_ - 2;
  const Step::Kind kind = now().kind;
  if ((kind != Step::Kind::press && kind != Step::Kind::pull) || steps_[last].kind != kind) {
    return begun;
  }
  begun.push_back({Step::Kind::take_back});
  gatherer_.step(begun.back());
  next_ = last;
  begin(begun);
  return begun;
}

std::string Walk::pull_advice() const {
  const std::string thread = "its thread slack towards " + way_of(now().toward_deg);
  switch (gatherer_.pull_watch().state()) {
  case PullWatch::State::free:
    return "set the weight down in the middle, " + thread;
  case PullWatch::State::settling:
    return "let it stand, " + thread;
  case PullWatch::State::resting:
    return "pull: hang the other weight on the thread towards " + way_of(now().toward_deg);
  case PullWatch::State::pulled:
    return "let it hang still";
  case PullWatch::State::taken:
    break;
  }
  return "taken: lift it";
}

std::string Walk::advice() const {
  if (next_ == 0) {
    return "wait";
  }
  const Finder &finder = gatherer_.finder();
  const bool is_free = finder.state() == Finder::State::resting;
  switch (now().kind) {
  case Step::Kind::empty:
    return is_free ? "leave it alone: " + seconds_left(EMPTY_s, gatherer_.step_s())
                   : "take off what touches it: the empty minute begins again";
  case Step::Kind::press: {
    if (is_taken_) {
      return "taken: lift it";
    }
    if (finder.state() == Finder::State::settling) {
      return "hold on";
    }
    if (finder.state() == Finder::State::refused) {
      return "it did not stand still: lift it, and let it stand by itself";
    }
    const std::size_t turn = (next_ - 3) / marks_;
    return (finder.refusal() == Finder::Refusal::light ? "too light. " : "") +
           std::string("set the weight down on mark ") + std::to_string(now().mark + 1) + ", turn " +
           std::to_string(turn + 1) + " of " + std::to_string(TURNS);
  }
  case Step::Kind::hold:
    return gatherer_.touched_s() > 0.0 ? "let it stand: " + seconds_left(HOLD_s, gatherer_.touched_s())
                                       : "set the weight down in the middle, and let it stand";
  case Step::Kind::rest:
    return gatherer_.released_s() > 0.0 ? "leave it alone: " + seconds_left(REST_s, gatherer_.released_s()) : "lift it";
  case Step::Kind::pull:
    return pull_advice();
  case Step::Kind::begin:
  case Step::Kind::take_back:
  case Step::Kind::end:
    break;
  }
  return "done";
}

} // namespace fingertip::validating
