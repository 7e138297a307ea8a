#include "grasp/control/grip.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip {

constexpr double READY_s = 0.15; // measurement of the zero of the load
constexpr double RISES_s = 0.27; // rise of the start force
// After a pause an approach or a release catches up on no more than this: a leap would be a blow.
constexpr double RAMP_s = 0.1;
constexpr double SQUEEZE_s = 3.0; // squeezing ends after this time with the force that it reached
constexpr double SQUEEZED = 0.8;  // share of the start force that is enough
constexpr double TAKEN = 0.2;     // share of the load that a table has left: it is placed
constexpr double PLACES_N = 0.1;  // a fingertip with less load than this is no evidence of a table
constexpr double BELOW_CAP = 0.9; // of a cap that was lowered below the force: where to open to
constexpr double HALF = 0.5;      // a smaller share is no grip
constexpr double ACTIVATION_s = 10.0;
constexpr double EMPTY_s = 0.06;  // without any contact for this time the object is gone
constexpr double CLOSED_s = 0.4;  // a gripper at rest where it was sent for this time has missed
constexpr double UNEVEN_s = 0.3;  // forces that differ at rest for this time are reported
constexpr double AGAIN_s = 0.003; // bad answers over this time are a fault
// An approach waits while the latest status is older than this: the width at the touch is the
// reference for all conversions from force to width.
constexpr double WIDTH_STALE_s = 0.1;
// Largest travel from the touch until the controller knows of it.
constexpr double OVERSHOOT_mm = 0.4;
constexpr double APPROACH_LEAST_mm_s = 1.0;
constexpr double MOVE_s = 0.02;        // duration of a move, unless the object slides
constexpr double WIDTH_SLACK_mm = 1.0; // rounding of the gripper's own units
constexpr double MARGIN_MOST = 100.0;

Grip::Grip(const GripSettings &settings, const GripperTraits &traits) : settings_(settings), traits_(traits), reach_(traits) {}

void Grip::take(std::size_t finger, const GripTouch &touch) {
  if (finger < fingers_.size()) {
    fingers_[finger].take(touch);
  }
}

void Grip::take(const GripperStatus &status) {
  if (hears_status_ && status.host_us <= status_.host_us) {
    return;
  }
  const bool was_bad = hears_status_ && (status_.fault != 0 || !status_.active);
  const bool is_bad = status.fault != 0 || !status.active;
  fault_s_ = is_bad && was_bad ? fault_s_ : status.t_s();
  status_ = status;
  hears_status_ = true;
  reach_.take(status, settings_.silent_s);
}

bool Grip::request(GripRequest request) {
  switch (request) {
  case GRIP_REQUEST_GRASP:
    if (state_ != GRIP_IDLE && state_ != GRIP_OPEN && state_ != GRIP_DROPPED && state_ != GRIP_MISSED && state_ != GRIP_STILL) {
      return false;
    }
    hold_ = {};
    fixed_ = {};
    for (GripFinger &finger : fingers_) {
      finger.begin_zero();
    }
    holds_ = GRIP_HOLDING;
    wanted_N_ = 0.0;
    may_activate_ = is_blind_ = was_held_ = false;
    enter(GRIP_ACTIVATING);
    return true;
  case GRIP_REQUEST_HOLD:
    if (state_ == GRIP_FAULT) {
      return false;
    }
    reach_.stop();
    still_grasps_ = is_grasping();
    enter(GRIP_STILL);
    return true;
  case GRIP_REQUEST_RELEASE:
    if (state_ == GRIP_FAULT && (fault_trouble_ & GRIP_GRIPPER_FAULTS) != 0) {
      return false;
    }
    enter(GRIP_RELEASE);
    return true;
  case GRIP_REQUEST_PLACE:
  case GRIP_REQUEST_HAND_OVER:
    if (state_ != GRIP_HOLDING || settings_.mode == GRIP_MODE_FIXED || !readings_.has_load ||
        (request == GRIP_REQUEST_PLACE && !hold_.is_loaded()) || !mark(request == GRIP_REQUEST_PLACE ? PLACES_N : 0.0)) {
      return false;
    }
    marked_N_ = readings_.load_N;
    kept_s_ = now_s_;
    holds_ = request == GRIP_REQUEST_PLACE ? GRIP_PLACING : GRIP_HANDING;
    enter(holds_);
    return true;
  default: return false;
  }
}

bool Grip::change(const GripSettings &settings) {
  if (settings.mode != settings_.mode) {
    return false;
  }
  settings_ = settings;
  return true;
}

std::uint32_t Grip::gripper_trouble() {
  if (!hears_status_ || now_s_ > status_.t_s() + settings_.silent_s) {
    return GRIP_GRIPPER_SILENT;
  }
  // A single bad answer may be a transmission error.
  if (status_.t_s() - fault_s_ < AGAIN_s) {
    return 0;
  }
  const bool was_active = state_ > GRIP_ACTIVATING;
  return (status_.fault != 0 ? GRIP_GRIPPER_FAULT : 0u) | (was_active && !status_.active ? GRIP_GRIPPER_INACTIVE : 0u);
}

// Moves the width towards to_mm, as far as this speed allows since the last step.
void Grip::ramp(double to_mm, double speed_mm_s) {
  if (is_entered_) {
    reach_.stop();
    ramped_s_ = now_s_;
  }
  // At a low speed one step takes longer than RAMP_s.
  const double most_s = std::max(RAMP_s, traits_.step_mm / speed_mm_s);
  const double passed_s = std::min(now_s_ - ramped_s_, most_s);
  const double steps = std::floor(speed_mm_s * passed_s / traits_.step_mm + 1e-9);
  if (steps < 1.0) {
    return;
  }
  const double made_mm = steps * traits_.step_mm;
  ramped_s_ = now_s_ - ramped_s_ > most_s ? now_s_ : ramped_s_ + made_mm / speed_mm_s;
  reach_.send(reach_.target_mm() + std::clamp(to_mm - reach_.target_mm(), -made_mm, made_mm));
}

void Grip::approach() {
  const bool blind = readings_.fingers == 0 && readings_.touches == 0;
  if (blind || now_s_ > status_.t_s() + WIDTH_STALE_s) {
    ramped_s_ = now_s_;
    return;
  }
  // One fingertip alone pushes the object to the other, but not harder than a grip or the cap. The
  // other may be frozen, or the object fixed; the controller cannot distinguish these.
  const bool both = readings_.touches >= readings_.fingers && readings_.low_N >= settings_.touch_N;
  if (readings_.touches == 0 || is_entered_) {
    reach_.first_touch(readings_.t_s);
  }
  const bool presses = readings_.high_N > 0.0;
  const double least_mm = presses ? std::max(reach_.last_below_cap_mm(readings_, settings_), 0.0) : 0.0;
  const bool at_cap = presses && least_mm == reach_.target_mm();
  if (readings_.fingers == 0 || both || at_cap || readings_.high_N >= start_force()) {
    reach_.both_touch(readings_.t_s);
    reach_.approach_ends(now_s_);
    enter(GRIP_SQUEEZE);
    return;
  }
  // Where a least move may exceed the cap, each step shows before the next.
  if (!is_entered_ && GripBound::first_N(reach_.least_mm()) > settings_.cap_N) {
    if (reach_.rests(now_s_, readings_.t_s) && reach_.target_mm() > least_mm) {
      reach_.move_to(std::max(reach_.target_mm() - traits_.step_mm, least_mm), now_s_, true);
    }
  } else {
    const double speed_mm_s = std::min(settings_.approach_mm_s, OVERSHOOT_mm / dead_s());
    ramp(least_mm, std::max(speed_mm_s, std::min(APPROACH_LEAST_mm_s, settings_.approach_mm_s)));
  }
  if (status_.moving || reach_.target_mm() != 0.0) {
    moved_s_ = now_s_;
  } else if (now_s_ - moved_s_ > CLOSED_s) {
    enter(GRIP_MISSED);
  }
}

std::uint32_t Grip::aim(const GripAim &aim) {
  GripAim below = aim;
  below.exact = !readings_.has_load && !hold_.has_seen_load(); // what never showed a load will not show a slide either
  wanted_N_ = below.wanted_N = std::min(aim.wanted_N, readings_.high_N > settings_.cap_N ? BELOW_CAP * settings_.cap_N : settings_.cap_N);
  return (aim.wanted_N >= settings_.cap_N ? GRIP_AT_CAP : 0u) | reach_.aim(below, readings_, settings_, now_s_);
}

std::uint32_t Grip::squeeze() {
  const bool fixed = settings_.mode == GRIP_MODE_FIXED;
  const double aimed_N = start_force();
  // An object that one fingertip alone pushes is not gripped yet.
  const bool alone = readings_.fingers == 2 && readings_.low_N < settings_.touch_N;
  was_held_ = was_held_ || !alone;
  if (alone) {
    reach_.both_touch(readings_.t_s);
  }
  const double from_N = is_blind_ ? settings_.first_N() : settings_.touch_N;
  const double risen_N = from_N + (aimed_N - from_N) * std::min((now_s_ - since_s_) / RISES_s, 1.0);
  const std::uint32_t trouble =
      fixed ? fixed_.step(readings_, settings_, traits_, now_s_, reach_) : aim({risen_N, GripAim::Haste::patient, settings_.sets_force()});
  wanted_N_ = fixed ? settings_.set_N : wanted_N_;
  // A force as near to it as a move brings it is enough as well.
  const bool nearest = readings_.fingers > 0 && reach_.rests(now_s_, readings_.t_s);
  const bool there = (readings_.low_N >= SQUEEZED * aimed_N || (!fixed && nearest)) && risen_N >= aimed_N;
  const bool capped = (trouble & GRIP_AT_CAP) != 0 && nearest;
  const bool over = now_s_ - since_s_ > SQUEEZE_s;
  const double least_N = fixed ? settings_.touch_N : HALF * aimed_N;
  if (over && (alone || readings_.fingers == 0 || (readings_.low_N < least_N && !capped))) {
    fault_trouble_ = trouble_ | trouble | GRIP_NO_GRIP;
    enter(GRIP_FAULT);
    return trouble;
  }
  if (!alone && (((there || capped) && !status_.moving) || over)) {
    if (!fixed && !is_blind_ && !readings_.has_load) {
      is_blind_ = true; // squeeze on to the grip that holds without a load
      since_s_ = now_s_;
    } else {
      for (GripFinger &finger : fingers_) {
        finger.begin_zero();
      }
      enter(GRIP_READY);
    }
  }
  return trouble;
}

std::uint32_t Grip::make_ready() {
  const std::uint32_t trouble = settings_.mode == GRIP_MODE_FIXED ? fixed_.step(readings_, settings_, traits_, now_s_, reach_) : 0u;
  if (now_s_ - since_s_ >= READY_s && fingers_[0].has_zero() && fingers_[1].has_zero()) {
    for (GripFinger &finger : fingers_) {
      finger.end_zero();
    }
    place_ = {};
    hold_ = {};
    enter(GRIP_HOLDING);
  }
  return trouble;
}

std::uint32_t Grip::hold() {
  if (settings_.mode == GRIP_MODE_FIXED) {
    return fixed_.step(readings_, settings_, traits_, now_s_, reach_);
  }
  if (holds_ != GRIP_HOLDING) {
    if (is_taken()) {
      enter(GRIP_RELEASE);
      return 0;
    }
    const bool places = holds_ == GRIP_PLACING;
    if (places && hold_.is_by_place() && readings_.high_N <= settings_.cap_N) {
      return 0; // a table that presses on a line or an area changes its force and place either way: the width stays
    }
    readings_.slides = readings_.slides && (places ? readings_.keeps > TAKEN : !is_pulled());
    readings_.load_N = std::min(readings_.load_N, places ? readings_.keeps * marked_N_ : marked_N_);
  }
  const double wanted_N = hold_.wants(readings_, reach_.coming_N(readings_, now_s_), settings_, now_s_, dead_s());
  const bool slides = hold_.is_sliding();
  std::uint32_t trouble = readings_.has_load ? 0u : GRIP_NO_LOAD;
  const bool opens = readings_.has_load || hold_.is_set() || readings_.high_N > settings_.cap_N;
  const bool stays = holds_ == GRIP_HANDING && !slides && readings_.high_N <= settings_.cap_N; // a pull changes the force either way
  trouble |= stays ? 0u : aim({wanted_N, hold_.goes_on() ? GripAim::Haste::slides : GripAim::Haste::usual, hold_.is_set(), opens});
  if (slides != (state_ == GRIP_SLIPPING)) {
    enter(slides ? GRIP_SLIPPING : holds_);
  }
  return trouble;
}

// The table has the load, or someone pulls: for as long as a silence may last, and as every fingertip that had a load
// reports. One that reports none any more is no evidence.
bool Grip::is_taken() {
  const bool slides = readings_.slides && is_pulled();
  const bool kept = holds_ == GRIP_PLACING ? readings_.keeps > TAKEN : readings_.pull_N < settings_.pull_N && !slides;
  kept_s_ = kept ? now_s_ : kept_s_;
  return now_s_ - kept_s_ >= settings_.stale_s;
}

bool Grip::is_gone() {
  const bool shows = state_ != GRIP_SQUEEZE || reach_.has_come(now_s_, readings_.t_s);
  const bool empty = shows && readings_.fingers > 0 && readings_.touches == 0;
  filled_s_ = empty ? filled_s_ : now_s_;
  return empty && now_s_ - filled_s_ >= EMPTY_s;
}

std::uint32_t Grip::go_on() {
  switch (state_) {
  case GRIP_ACTIVATING:
    if (status_.active) {
      reach_.stop();
      reach_.first_touch(status_.t_s());
      enter(readings_.touches == 0 ? GRIP_APPROACH : GRIP_SQUEEZE);
      return 0;
    }
    // Activation opens a gripper, so it waits until nothing is between the fingers.
    may_activate_ = may_activate_ || (readings_.fingers > 0 && readings_.touches == 0);
    return may_activate_ && now_s_ - since_s_ < ACTIVATION_s ? 0u : GRIP_GRIPPER_INACTIVE;
  case GRIP_APPROACH: approach(); return 0;
  case GRIP_SQUEEZE: return squeeze();
  case GRIP_READY: return make_ready();
  case GRIP_HOLDING:
  case GRIP_SLIPPING:
  case GRIP_PLACING:
  case GRIP_HANDING: return hold();
  case GRIP_RELEASE:
    ramp(settings_.release_width_mm, settings_.release_mm_s);
    if (status_.width_mm >= settings_.release_width_mm - WIDTH_SLACK_mm) {
      enter(GRIP_OPEN);
    }
    return 0;
  default: return 0;
  }
}

void Grip::sample() {
  const bool held = was_held_ && is_grasping() && state_ != GRIP_SQUEEZE;
  readings_ = combine_readings(fingers_, now_s_, settings_, held ? &reach_ : nullptr, place_);
  trouble_ = readings_.trouble | gripper_trouble();
  // The frames of the two are not simultaneous, so the forces always differ while they change.
  const bool uneven = readings_.fingers == 2 && readings_.high_N > 4.0 * settings_.touch_N &&
                      readings_.high_N - readings_.low_N > settings_.differ * readings_.high_N;
  const bool rests = state_ >= GRIP_SQUEEZE && state_ <= GRIP_STILL && state_ != GRIP_SLIPPING;
  even_s_ = uneven && rests && reach_.has_come(now_s_, readings_.t_s) ? even_s_ : now_s_;
  trouble_ |= now_s_ - even_s_ >= UNEVEN_s ? GRIP_FINGERS_DIFFER : 0u;
}

void Grip::fill(GripCommand &command) const {
  command = {};
  command.width_mm = reach_.command_mm();
  if (state_ == GRIP_ACTIVATING) {
    command.motion = may_activate_ ? GRIP_ACTIVATE : GRIP_STAY;
  }
  const bool moves = (state_ >= GRIP_APPROACH && state_ <= GRIP_HANDING) || state_ == GRIP_RELEASE;
  if (!moves || (trouble_ & (GRIP_GRIPPER_SILENT | GRIP_GRIPPER_FAULTS)) != 0) {
    return;
  }
  const double speed_mm_s = state_ == GRIP_APPROACH   ? settings_.approach_mm_s
                            : state_ == GRIP_RELEASE  ? settings_.release_mm_s
                            : state_ == GRIP_SLIPPING ? traits_.speed_max_mm_s
                                                      : std::abs(command.width_mm - status_.width_mm) / MOVE_s;
  command.motion = GRIP_MOVE;
  command.speed_mm_s = std::clamp(speed_mm_s, traits_.speed_min_mm_s, traits_.speed_max_mm_s);
  command.force_N = std::clamp(GripReach::LIMIT * settings_.cap_N, traits_.force_min_N, traits_.force_max_N);
}

GripReport Grip::report() const {
  GripReport report{};
  const bool failed = state_ == GRIP_FAULT && status_.fault == 0;
  report.state = state_;
  report.trouble = trouble_;
  report.gripper_fault = failed ? fault_code_ : status_.fault;
  report.wanted_N = wanted_N_;
  report.force_N = readings_.grip_N;
  std::copy(readings_.force_N.begin(), readings_.force_N.end(), report.finger_N);
  report.friction = hold_.friction(settings_);
  report.width_mm = status_.width_mm;
  report.delay_s = readings_.delay_s;
  report.slides = hold_.slides();
  const bool loaded = state_ >= GRIP_HOLDING && state_ <= GRIP_HANDING;
  if (loaded && readings_.has_load && settings_.mode == GRIP_MODE_HOLD) {
    report.load_N = hold_.load_N();
    if (hold_.is_loaded()) {
      report.margin = std::min(readings_.grip_N * report.friction / report.load_N, MARGIN_MOST);
    }
  }
  return report;
}

GripReport Grip::step(double now_s, GripCommand &command) {
  now_s_ = std::max(now_s, now_s_);
  sample();
  const bool silent = (trouble_ & GRIP_GRIPPER_SILENT) != 0, grasps = is_grasping();
  const GripState before = state_;
  if (before != GRIP_IDLE && before != GRIP_FAULT && (trouble_ & GRIP_GRIPPER_FAULTS) != 0) {
    fault_trouble_ = trouble_;
    fault_code_ = status_.fault;
    enter(GRIP_FAULT);
  } else if (grasps && is_gone()) {
    // An object that only one fingertip has pushed was never held: the approach goes on.
    const bool taken = state_ == GRIP_HANDING || (state_ == GRIP_SLIPPING && holds_ == GRIP_HANDING);
    enter(taken ? GRIP_RELEASE : was_held_ || state_ != GRIP_SQUEEZE ? GRIP_DROPPED : GRIP_APPROACH);
  } else if (!silent && !(grasps && readings_.fingers > 0 && readings_.touches == 0)) {
    trouble_ |= go_on();
  }
  is_entered_ = state_ != before;
  if (state_ == GRIP_FAULT) {
    trouble_ |= fault_trouble_;
  }
  fill(command);
  return report();
}

} // namespace fingertip
