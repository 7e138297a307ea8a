#include "grasp/control/grip.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip {

namespace {

constexpr double READY_s = 0.15; // of the zero of the load
constexpr double RISES_s = 0.27; // in which the start force rises
// An approach or a release that was kept waiting makes up for no more: a leap would be a blow.
constexpr double RAMP_s = 0.1;
constexpr double SQUEEZE_s = 3.0; // squeezing takes no longer, or it is what it is
constexpr double SQUEEZED = 0.8;  // of the start force: it is there
constexpr double ACTIVATION_s = 10.0;
constexpr double EMPTY_s = 0.06;  // neither fingertip feels anything: the object is gone
constexpr double STANDS_s = 0.4;  // a gripper that stands where it was sent has closed on nothing
constexpr double UNEVEN_s = 0.3;  // the fingertips' forces differ for so long at rest
constexpr double AGAIN_s = 0.003; // a bad answer of the gripper is looked at again, after so long
// An approach waits for a status that is no older: where the fingers are when they touch, and that
// they follow, is what all forces are turned into widths by.
constexpr double WIDTH_STALE_s = 0.1;
// What the fingers go on by after the touch, until the controller knows of it, at most.
constexpr double OVERSHOOT_mm = 0.4;
constexpr double APPROACH_LEAST_mm_s = 1.0;
constexpr double MOVE_s = 0.02;        // a move is to take so long, but where the object slides
constexpr double WIDTH_SLACK_mm = 1.0; // of the gripper's own units
constexpr double MARGIN_MOST = 100.0;
constexpr double ONLY_HELD_s = 1.0; // nothing has pulled for so long

double seconds(const GripperStatus &status) {
  return 1e-6 * static_cast<double>(status.host_us);
}

} // namespace

Grip::Grip(const GripSettings &settings, const GripperTraits &traits)
    : settings_(settings), traits_(traits), reach_(traits) {}

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
  fault_s_ = is_bad && was_bad ? fault_s_ : seconds(status);
  status_ = status;
  hears_status_ = true;
  reach_.take(status, settings_.silent_s);
}

void Grip::enter(GripState state) {
  state_ = state;
  since_s_ = now_s_;
  is_entered_ = true;
}

bool Grip::is_grasping() const {
  return state_ == GRIP_SQUEEZE || state_ == GRIP_READY || state_ == GRIP_HOLDING || state_ == GRIP_SLIPPING ||
         (state_ == GRIP_STILL && still_grasps_);
}

bool Grip::request(GripRequest request) {
  switch (request) {
  case GRIP_REQUEST_GRASP:
    if (state_ != GRIP_IDLE && state_ != GRIP_OPEN && state_ != GRIP_DROPPED && state_ != GRIP_MISSED &&
        state_ != GRIP_STILL) {
      return false;
    }
    hold_.begin();
    fixed_.begin();
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
  }
  return false;
}

std::uint32_t Grip::gripper_trouble() {
  if (!hears_status_ || now_s_ > seconds(status_) + settings_.silent_s) {
    return GRIP_GRIPPER_SILENT;
  }
  // One bad answer alone may be the line's.
  if (seconds(status_) - fault_s_ < AGAIN_s) {
    return 0;
  }
  const bool was_active = state_ > GRIP_ACTIVATING;
  return (status_.fault != 0 ? GRIP_GRIPPER_FAULT : 0u) | (was_active && !status_.active ? GRIP_GRIPPER_INACTIVE : 0u);
}

double Grip::dead_s() const {
  return felt_.delay_s + traits_.latency_s + reach_.poll_s();
}

double Grip::start_force() const {
  return settings_.mode == GRIP_MODE_FIXED ? settings_.set_N : is_blind_ ? settings_.blind_N : settings_.start_N;
}

// A step of the width at this speed since the last.
void Grip::ramp(double to_mm, double speed_mm_s) {
  if (is_entered_) {
    reach_.stop();
    ramped_s_ = now_s_;
  }
  // A slow one takes longer than that for a step.
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
  if (reach_.goes_round()) {
    if (felt_.fingers > 0 && reach_.comes_round(now_s_, felt_.t_s)) {
      enter(GRIP_SQUEEZE);
    }
    return;
  }
  const bool blind = felt_.fingers == 0 && felt_.touches == 0;
  if (blind || now_s_ > seconds(status_) + WIDTH_STALE_s) {
    ramped_s_ = now_s_;
    return;
  }
  // One fingertip alone pushes the object to the other, unless it has to push as hard as a grip,
  // or as the cap lets it. The other may be frozen, or the object fixed; that looks the same.
  const bool both = felt_.touches >= felt_.fingers && felt_.low_N >= settings_.touch_N;
  if (felt_.touches == 0 || is_entered_) {
    reach_.first_touch(felt_.t_s);
  }
  const bool presses = felt_.high_N > 0.0;
  const double least_mm = presses ? std::max(reach_.last_below_cap_mm(felt_, settings_), 0.0) : 0.0;
  const bool no_room = presses && least_mm == reach_.target_mm();
  if (felt_.fingers == 0 || both || no_room || felt_.high_N >= start_force()) {
    reach_.both_touch(felt_.t_s);
    reach_.approach_ends(now_s_);
    enter(GRIP_SQUEEZE);
    return;
  }
  const double speed_mm_s = std::min(settings_.approach_mm_s, OVERSHOOT_mm / dead_s());
  ramp(least_mm, std::max(speed_mm_s, std::min(APPROACH_LEAST_mm_s, settings_.approach_mm_s)));
  if (status_.moving || reach_.target_mm() != 0.0) {
    stood_s_ = now_s_;
  } else if (now_s_ - stood_s_ > STANDS_s) {
    enter(GRIP_MISSED);
  }
}

std::uint32_t Grip::aim(const GripAim &aim) {
  GripAim below = aim;
  wanted_N_ = below.wanted_N = std::min(aim.wanted_N, settings_.cap_N);
  return (aim.wanted_N >= settings_.cap_N ? GRIP_AT_CAP : 0u) | reach_.aim(below, felt_, settings_, now_s_);
}

std::uint32_t Grip::squeeze() {
  const bool fixed = settings_.mode == GRIP_MODE_FIXED;
  const double aimed_N = start_force();
  // What one fingertip alone pushes is not gripped yet.
  const bool alone = felt_.fingers == 2 && felt_.low_N < settings_.touch_N;
  was_held_ = was_held_ || !alone;
  if (alone) {
    reach_.both_touch(felt_.t_s);
  }
  const double from_N = is_blind_ ? settings_.start_N : settings_.touch_N;
  const double risen_N = from_N + (aimed_N - from_N) * std::min((now_s_ - since_s_) / RISES_s, 1.0);
  const std::uint32_t trouble = fixed ? fixed_.step(felt_, settings_, traits_, now_s_, reach_)
                                      : aim({risen_N, GripAim::Haste::patient, settings_.sets_force()});
  wanted_N_ = fixed ? settings_.set_N : wanted_N_;
  // Or as near to it as a move brings it.
  const bool nearest = !fixed && felt_.fingers > 0 && reach_.has_come(now_s_, felt_.t_s);
  const bool there = (felt_.low_N >= SQUEEZED * aimed_N || nearest) && risen_N >= aimed_N;
  const bool capped = (trouble & GRIP_AT_CAP) != 0 && reach_.has_come(now_s_, felt_.t_s);
  // A step nearer than its least moves bring it: to a set force, or where it is far too weak.
  const bool may_round = nearest && (capped || there);
  if (may_round && (settings_.sets_force()
                        ? reach_.goes_round_to(settings_.start_N, felt_, settings_, now_s_)
                        : felt_.low_N < SQUEEZED * aimed_N && reach_.goes_round_closer(felt_, settings_, now_s_))) {
    enter(GRIP_APPROACH);
    return trouble;
  }
  const bool over = now_s_ - since_s_ > SQUEEZE_s;
  if (!alone && (((there || capped) && !status_.moving) || over)) {
    if (!fixed && !is_blind_ && !felt_.tells_load) {
      is_blind_ = true; // on to the grip that holds without a load
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
  const bool fixed = settings_.mode == GRIP_MODE_FIXED;
  const std::uint32_t trouble = fixed ? fixed_.step(felt_, settings_, traits_, now_s_, reach_)
                                      : aim({start_force(), GripAim::Haste::patient, settings_.sets_force()});
  if (now_s_ - since_s_ >= READY_s && fingers_[0].has_zero() && fingers_[1].has_zero()) {
    for (GripFinger &finger : fingers_) {
      finger.end_zero();
    }
    hold_.begin();
    enter(GRIP_HOLDING);
  }
  return trouble;
}

std::uint32_t Grip::hold() {
  if (settings_.mode == GRIP_MODE_FIXED) {
    return fixed_.step(felt_, settings_, traits_, now_s_, reach_);
  }
  const double wanted_N = hold_.wants(felt_, reach_.coming_N(felt_, now_s_), settings_, now_s_, dead_s());
  const bool slides = hold_.is_sliding();
  std::uint32_t trouble = felt_.tells_load ? 0u : GRIP_NO_LOAD;
  // The rubber has relaxed, and a step brings it nearer to a force that is only held. Without a
  // load it may have been lifted.
  const bool only_held = hold_.is_set() && felt_.tells_load && now_s_ - since_s_ > ONLY_HELD_s;
  if (!only_held) {
    reach_.leave_round();
  }
  if (reach_.goes_round()) {
    reach_.comes_round(now_s_, felt_.t_s);
  } else if (!only_held || !reach_.goes_round_to(settings_.start_N, felt_, settings_, now_s_)) {
    trouble |= aim({wanted_N, hold_.goes_on() ? GripAim::Haste::slides : GripAim::Haste::usual, hold_.is_set()});
  }
  if (slides != (state_ == GRIP_SLIPPING)) {
    enter(slides ? GRIP_SLIPPING : GRIP_HOLDING);
  }
  return trouble;
}

bool Grip::is_gone() {
  const bool empty = felt_.fingers > 0 && felt_.touches == 0;
  filled_s_ = empty ? filled_s_ : now_s_;
  return empty && now_s_ - filled_s_ >= EMPTY_s;
}

std::uint32_t Grip::go_on() {
  switch (state_) {
  case GRIP_ACTIVATING:
    if (status_.active) {
      reach_.stop();
      reach_.first_touch(seconds(status_));
      enter(felt_.touches == 0 ? GRIP_APPROACH : GRIP_SQUEEZE);
      return 0;
    }
    // Activating opens a gripper: not with something between its fingers.
    may_activate_ = may_activate_ || (felt_.fingers > 0 && felt_.touches == 0);
    return may_activate_ && now_s_ - since_s_ < ACTIVATION_s ? 0u : GRIP_GRIPPER_INACTIVE;
  case GRIP_APPROACH:
    approach();
    return 0;
  case GRIP_SQUEEZE:
    return squeeze();
  case GRIP_READY:
    return make_ready();
  case GRIP_HOLDING:
  case GRIP_SLIPPING:
    return hold();
  case GRIP_RELEASE:
    ramp(settings_.release_width_mm, settings_.release_mm_s);
    if (status_.width_mm >= settings_.release_width_mm - WIDTH_SLACK_mm) {
      enter(GRIP_OPEN);
    }
    return 0;
  default:
    return 0;
  }
}

void Grip::look() {
  felt_ = look_at(fingers_, now_s_, settings_);
  trouble_ = felt_.trouble | gripper_trouble();
  // Their frames are of different moments: while the force changes they always differ.
  const bool uneven = felt_.fingers == 2 && felt_.high_N > 4.0 * settings_.touch_N &&
                      felt_.high_N - felt_.low_N > settings_.differ * felt_.high_N;
  const bool rests = state_ >= GRIP_SQUEEZE && state_ <= GRIP_STILL && state_ != GRIP_SLIPPING;
  even_s_ = uneven && rests && reach_.has_come(now_s_, felt_.t_s) ? even_s_ : now_s_;
  trouble_ |= now_s_ - even_s_ >= UNEVEN_s ? GRIP_FINGERS_DIFFER : 0u;
}

void Grip::tell(GripCommand &command) const {
  command = {};
  command.width_mm = reach_.target_mm();
  double speed_mm_s = traits_.speed_max_mm_s;
  switch (state_) {
  case GRIP_ACTIVATING:
    command.motion = may_activate_ ? GRIP_ACTIVATE : GRIP_STAY;
    return;
  case GRIP_APPROACH:
    speed_mm_s = settings_.approach_mm_s;
    break;
  case GRIP_RELEASE:
    speed_mm_s = settings_.release_mm_s;
    break;
  case GRIP_SQUEEZE:
  case GRIP_READY:
  case GRIP_HOLDING:
    speed_mm_s = std::abs(reach_.target_mm() - status_.width_mm) / MOVE_s;
    break;
  case GRIP_SLIPPING:
    break;
  default:
    return;
  }
  if ((trouble_ & (GRIP_GRIPPER_SILENT | GRIP_GRIPPER_FAULTS)) != 0) {
    return;
  }
  command.motion = GRIP_MOVE;
  command.speed_mm_s = std::clamp(speed_mm_s, traits_.speed_min_mm_s, traits_.speed_max_mm_s);
  command.force_N = std::clamp(GripReach::LIMIT * settings_.cap_N, traits_.force_min_N, traits_.force_max_N);
}

GripReport Grip::report() const {
  GripReport report;
  const bool failed = state_ == GRIP_FAULT && status_.fault == 0;
  report.state = state_;
  report.trouble = trouble_;
  report.gripper_fault = failed ? fault_code_ : status_.fault;
  report.wanted_N = wanted_N_;
  report.force_N = felt_.grip_N;
  report.felt_N = felt_.force_N;
  report.friction = hold_.friction(settings_);
  report.width_mm = status_.width_mm;
  report.delay_s = felt_.delay_s;
  report.slides = hold_.slides();
  const bool loaded = state_ == GRIP_HOLDING || state_ == GRIP_SLIPPING;
  if (loaded && felt_.tells_load && settings_.mode == GRIP_MODE_HOLD) {
    report.load_N = hold_.load_N();
    if (hold_.is_loaded()) {
      report.margin = std::min(felt_.grip_N * report.friction / report.load_N, MARGIN_MOST);
    }
  }
  return report;
}

GripReport Grip::step(double now_s, GripCommand &command) {
  now_s_ = std::max(now_s, now_s_);
  look();
  const bool silent = (trouble_ & GRIP_GRIPPER_SILENT) != 0, grasps = is_grasping();
  const GripState before = state_;
  if (before != GRIP_IDLE && before != GRIP_FAULT && (trouble_ & GRIP_GRIPPER_FAULTS) != 0) {
    fault_trouble_ = trouble_;
    fault_code_ = status_.fault;
    enter(GRIP_FAULT);
  } else if (grasps && is_gone()) {
    // What only one fingertip has pushed was never held: on to the other.
    enter(was_held_ || state_ != GRIP_SQUEEZE ? GRIP_DROPPED : GRIP_APPROACH);
  } else if (!silent && !(grasps && felt_.fingers > 0 && felt_.touches == 0)) {
    trouble_ |= go_on();
  }
  is_entered_ = state_ != before;
  if (state_ == GRIP_FAULT) {
    trouble_ |= fault_trouble_;
  }
  tell(command);
  return report();
}

} // namespace fingertip
