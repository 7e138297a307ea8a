#include "grasp/control/reach.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace fingertip {

namespace {

// Layers of 12 mm under spheres of 6 to 30 mm, 1 to 10 N (host_tools/simulation/twin).
constexpr double EXPONENT = 1.6;
constexpr double STIFFER = 1.2; // than what the moves have shown, where a cap is to hold
// An elastic force over what relaxation has left of it: a move adds to the elastic one.
constexpr double RELAXED = 1.1;
// Both pads, at the force of a touch; less is not told from nothing.
constexpr double TOUCHED_mm = 0.3;
constexpr double LEAST_N = 0.05;
// What is learnt: from moves that make so much, by so large a share, within these limits.
constexpr double TEACHES = 0.1; // of the force: the bound learns from no less
constexpr double TEACHES_N = 0.15, LEARNS = 0.5, LEAST_STEEP = 0.4, MOST_STEEP = 3.0;

constexpr double SPACED_s = 0.003;     // widths of the ring
constexpr double WIDTH_LAGS_s = 0.008; // newer forces tell nothing while the gripper moves
constexpr double SHOWS_s = 0.02;       // after a move, in the force, whatever the clocks differ by
constexpr double POLL_SHARE = 0.05;    // that an answer has in the mean
constexpr double MISSES = 0.35;        // of what the least move makes: less may be missing
constexpr double NEAR = 0.03;          // of the wanted force: near enough
constexpr double WEAK = 0.8;           // and too weak, where the cap leaves no room
constexpr double SHORT_mm = 0.5;       // a short move
constexpr double OPENS_mm = 0.3;       // at once
// A set force may be off by so many steps: by more than half of one, or it goes to and fro. Going
// round it keeps so much of it, and does so no more often in a grasp.
constexpr double OFF = 0.65, KEEPS = 0.25;
constexpr int ROUNDS = 4;
// Of a fingertip's force, below the cap. UNCERTAIN contacts report far more than the force is off;
// chosen with cylinders of fingertip_grasp_trials, seed 1.
constexpr double SDS = 2.5, SD_LEAST = 0.04, SD_MOST = 0.06;

// The larger force as it may truly be.
double most_N(const GripFelts &felt) {
  return felt.high_N + SDS * std::clamp(felt.sd_N, SD_LEAST * felt.high_N, SD_MOST * felt.high_N);
}

double indentation_mm(double width_mm, double touch_mm) {
  return std::max(touch_mm + TOUCHED_mm - width_mm, TOUCHED_mm);
}

// One pad's indentation at this force, by a power law.
double way_to_mm(double force_N, double at_1_mm_N, double exponent) {
  return std::pow(force_N / at_1_mm_N, 1.0 / exponent);
}

// Its force at 1 mm, if this way turned one force into the other.
double shown_at_1_mm_N(double from_N, double to_N, double way_mm, double exponent) {
  const double unit_mm = way_to_mm(to_N, 1.0, exponent) - way_to_mm(from_N, 1.0, exponent);
  return std::pow(unit_mm / way_mm, exponent);
}

} // namespace

void GripRubber::begin(double width_mm) {
  *this = GripRubber();
  both_mm_ = width_mm;
}

double GripRubber::force_at(double to_mm, double force_N, double from_mm) const {
  const double grown = indentation_mm(to_mm, both_mm_) / indentation_mm(from_mm, both_mm_);
  return std::max(0.0, force_N + std::max(force_N, LEAST_N) * (std::pow(grown, EXPONENT) - 1.0) *
                                     (to_mm < from_mm ? closing_ : opening_));
}

double GripRubber::width_for(double wanted_N, double force_N, double from_mm) const {
  const double share = (wanted_N - force_N) / std::max(force_N, LEAST_N) / (wanted_N > force_N ? closing_ : opening_);
  const double grown = std::pow(std::max(1.0 + share, 0.0), 1.0 / EXPONENT);
  return from_mm - (grown - 1.0) * indentation_mm(from_mm, both_mm_);
}

void GripRubber::learn(double force_N, double width_mm) {
  if (has_pair_) {
    double &steep = width_mm < pair_mm_ ? closing_ : opening_;
    const double made_N = force_N - pair_N_;
    const double expected_N = (force_at(width_mm, pair_N_, pair_mm_) - pair_N_) / steep;
    if (std::abs(expected_N) < TEACHES_N) {
      has_pair_ = std::abs(width_mm - pair_mm_) > 1e-6; // a way of many small moves teaches too
      pair_N_ = has_pair_ ? pair_N_ : force_N;
      pair_mm_ = has_pair_ ? pair_mm_ : width_mm;
      has_pair_ = true;
      return;
    }
    const double seen = std::clamp(made_N / expected_N, LEAST_STEEP, MOST_STEEP);
    steep += LEARNS * (seen - steep);
  }
  has_pair_ = true;
  pair_N_ = force_N;
  pair_mm_ = width_mm;
}

double GripBound::first_N(double way_mm) {
  double most_N = 0.0;
  for (const double exponent : EXPONENTS) {
    most_N = std::max(most_N, EXPECTED_N * std::pow(0.5 * way_mm, exponent));
  }
  return most_N;
}

double GripBound::width_below(double cap_N, double force_N, double from_mm) const {
  double room_mm = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < EXPONENTS.size(); i++) {
    const double elastic_N = RELAXED * force_N;
    const double most_N = std::max(elastic_N + cap_N - force_N, 0.0);
    room_mm = std::min(room_mm, way_to_mm(most_N, at_1_mm_N_[i], EXPONENTS[i]) -
                                    way_to_mm(elastic_N, at_1_mm_N_[i], EXPONENTS[i]));
  }
  return from_mm - 2.0 * room_mm;
}

void GripBound::learn(double force_N, double width_mm) {
  const double way_mm = 0.5 * (pair_mm_ - width_mm), made_N = force_N - pair_N_;
  if (pair_N_ > 0.0 && way_mm > 1e-6) {
    if (made_N < std::max(TEACHES_N, TEACHES * force_N)) {
      return; // a way of many small moves teaches too
    }
    for (std::size_t i = 0; i < EXPONENTS.size(); i++) {
      at_1_mm_N_[i] = STIFFER * shown_at_1_mm_N(pair_N_, force_N, way_mm, EXPONENTS[i]);
    }
  }
  pair_N_ = force_N;
  pair_mm_ = width_mm;
}

void GripReach::take(const GripperStatus &status, double silent_s) {
  const double t_s = 1e-6 * static_cast<double>(status.host_us);
  if (is_heard_) {
    const double passed_s = t_s - 1e-6 * static_cast<double>(status_.host_us);
    // Between what was said before a silence and after it no width is known.
    if (passed_s > silent_s) {
      count_ = 0;
    } else {
      poll_s_ += POLL_SHARE * (passed_s - poll_s_);
    }
  } else {
    poll_s_ = traits_.poll_s;
  }
  stood_s_ = is_heard_ && !status_.moving ? stood_s_ : t_s;
  status_ = status;
  is_heard_ = true;
  const double before_s = widths_[(newest_ + widths_.size() - 1) % widths_.size()].t_s;
  if (count_ < 2 || widths_[newest_].t_s - before_s >= SPACED_s) {
    newest_ = (newest_ + 1) % widths_.size();
    count_ = std::min(count_ + 1, widths_.size());
  }
  widths_[newest_] = {t_s, status.width_mm};
}

bool GripReach::knows(double t_s) const {
  const std::size_t oldest = (newest_ + widths_.size() + 1 - count_) % widths_.size();
  return count_ > 0 && widths_[oldest].t_s <= t_s;
}

double GripReach::width_at(double t_s) const {
  Width after = widths_[newest_];
  for (std::size_t back = 1; back < count_ && after.t_s > t_s; back++) {
    const Width before = widths_[(newest_ + widths_.size() - back) % widths_.size()];
    if (before.t_s <= t_s) {
      const double share = (t_s - before.t_s) / (after.t_s - before.t_s);
      return before.width_mm + share * (after.width_mm - before.width_mm);
    }
    after = before;
  }
  return after.width_mm;
}

bool GripReach::stands(double now_s) const {
  const double t_s = 1e-6 * static_cast<double>(status_.host_us);
  const double late_s = std::max(now_s - t_s, 0.0);
  return !status_.moving && t_s > aimed_s_ + traits_.latency_s + late_s + poll_s_;
}

bool GripReach::has_come(double now_s, double frame_s) const {
  return stands(now_s) && frame_s > aimed_s_ + traits_.latency_s + poll_s_ + SHOWS_s;
}

bool GripReach::rests(double now_s, double frame_s) const {
  return has_come(now_s, frame_s) && frame_s > stood_s_;
}

void GripReach::first_touch(double t_s) {
  rubber_.begin(width_at(t_s));
  bound_ = GripBound();
  rounds_ = 0;
}

// Where it is going to be. Where it stands, it makes no move that is shorter than its deadband.
double GripReach::coming_mm(double now_s) const {
  const bool stays = stands(now_s) && std::abs(status_.width_mm - target_mm_) <= traits_.deadband_mm + 1e-9;
  return stays ? status_.width_mm : target_mm_;
}

double GripReach::least_mm() const {
  return traits_.step_mm * std::max(1.0, std::ceil(traits_.deadband_mm / traits_.step_mm - 1e-9));
}

bool GripReach::limits_itself(const GripSettings &settings) const {
  return traits_.force_min_N <= LIMIT * settings.cap_N;
}

double GripReach::least_move_N(double force_N) const {
  return rubber_.force_at(target_mm_ - least_mm(), force_N, target_mm_) - force_N;
}

double GripReach::coming_N(const GripFelts &felt, double now_s) const {
  return rubber_.force_at(coming_mm(now_s), felt.grip_N, width_at(felt.t_s));
}

double GripReach::last_below_cap_mm(const GripFelts &felt, const GripSettings &settings) const {
  const double least_mm = bound_.width_below(settings.cap_N, most_N(felt), width_at(felt.t_s));
  const double steps = std::floor((target_mm_ - least_mm) / traits_.step_mm);
  return target_mm_ - std::max(steps, 0.0) * traits_.step_mm;
}

double GripReach::allowed(double width_mm, const GripFelts &felt, const GripSettings &settings,
                          std::uint32_t &trouble) const {
  const double least_mm = touch_width_mm() - settings.travel_cap_mm;
  if (width_mm < least_mm) {
    width_mm = least_mm;
    trouble |= GRIP_AT_TRAVEL_CAP;
  }
  // What is not believed to be below the cap is not added to.
  if (width_mm < target_mm_ && (felt.over || felt.fingers == 0)) {
    width_mm = target_mm_;
  }
  // Where it touched is as far as it opens without being asked to.
  return std::clamp(width_mm, 0.0, std::max(target_mm_, touch_width_mm()));
}

double GripReach::steps_off(double wanted_N, double force_N, double from_mm, double coming_mm) const {
  return (coming_mm - rubber_.width_for(wanted_N, force_N, from_mm)) / traits_.step_mm;
}

bool GripReach::may_go_round(const GripFelts &felt) const {
  return least_mm() > traits_.step_mm && !felt.is_alone() && !felt.over;
}

double GripReach::room_mm(const GripFelts &felt, const GripSettings &settings, double coming_mm) const {
  return coming_mm - bound_.width_below(settings.cap_N, most_N(felt), width_at(felt.t_s));
}

void GripReach::go_round(double to_mm, double now_s) {
  const double coming = coming_mm(now_s);
  goes_round_ = true;
  round_mm_ = to_mm;
  target_mm_ = std::max(coming, to_mm) + least_mm();
  aimed_s_ = now_s;
}

bool GripReach::goes_round_closer(const GripFelts &felt, const GripSettings &settings, double now_s) {
  const double coming = coming_mm(now_s);
  const bool goes = !limits_itself(settings) && may_go_round(felt) && room_mm(felt, settings, coming) > traits_.step_mm;
  if (goes) {
    go_round(coming - traits_.step_mm, now_s);
  }
  return goes;
}

bool GripReach::goes_round_to(double set_N, const GripFelts &felt, const GripSettings &settings, double now_s) {
  if (!may_go_round(felt) || rounds_ >= ROUNDS || !rests(now_s, felt.t_s)) {
    return false;
  }
  const double coming = coming_mm(now_s), width_mm = width_at(felt.t_s);
  const double off = steps_off(set_N, felt.low_N, width_mm, coming);
  const double to_mm = coming - std::copysign(traits_.step_mm, off);
  const double widest_mm = std::max(coming, to_mm) + least_mm();
  const bool has_room = off < 0.0 || room_mm(felt, settings, coming) > traits_.step_mm;
  if (std::abs(off) < OFF || !has_room || rubber_.force_at(widest_mm, felt.low_N, width_mm) < KEEPS * set_N) {
    return false;
  }
  rounds_++;
  go_round(to_mm, now_s);
  return true;
}

bool GripReach::comes_round(double now_s, double frame_s) {
  if (!rests(now_s, frame_s)) {
    return false;
  }
  goes_round_ = target_mm_ != round_mm_;
  if (goes_round_) {
    target_mm_ = round_mm_;
    aimed_s_ = now_s;
  }
  return !goes_round_;
}

// Whole steps to the position whose force is nearest. Less than the least move is left to going
// round, or where that is not possible to the least move.
double GripReach::nearest_steps(double off, double least_mm, bool may_round) const {
  const double least = std::round(least_mm / traits_.step_mm);
  const double steps = std::abs(off) > OFF ? std::round(off) : 0.0;
  if (std::abs(steps) >= least) {
    return steps;
  }
  const bool worth = std::abs(off) > 0.5 * least + OFF - 0.5;
  return worth && !(may_round && rounds_ < ROUNDS) ? std::copysign(least, off) : 0.0;
}

std::uint32_t GripReach::aim(const GripAim &aim, const GripFelts &felt, const GripSettings &settings, double now_s) {
  const double wanted_N = aim.wanted_N;
  const Haste haste = aim.haste;
  const bool nearest = aim.nearest;
  std::uint32_t trouble = 0;
  if (felt.fingers == 0 || !knows(felt.t_s)) {
    return trouble;
  }
  const double status_s = 1e-6 * static_cast<double>(status_.host_us);
  const bool come = has_come(now_s, felt.t_s);
  if (!stands(now_s) && felt.t_s > status_s + WIDTH_LAGS_s) {
    return trouble; // forces of widths that are not known yet
  }
  const double width_mm = width_at(felt.t_s), coming = coming_mm(now_s);
  const bool rested = rests(now_s, felt.t_s);
  if (come) {
    rubber_.learn(felt.grip_N, width_mm);
  }
  // A gripper that limits itself does not wait until a move has ended: the bound is not all that
  // keeps it below the cap.
  if (limits_itself(settings) ? come : rested) {
    felt.low_N > settings.touch_N && !felt.is_alone() ? bound_.learn(felt.grip_N, width_mm) : bound_.forget_pair();
  }
  // Nor does a gripper that cannot keep the cap itself add a move to one that does not show yet.
  if (!(limits_itself(settings) ? haste != Haste::patient || come : rested)) {
    return trouble;
  }
  const double low_N = nearest || haste == Haste::patient ? felt.low_N : felt.grip_N;
  const auto low_at = [&](double to_mm) { return rubber_.force_at(to_mm, low_N, width_mm); };
  const double now_N = low_at(coming), step_mm = traits_.step_mm;
  const bool standing = std::abs(coming - status_.width_mm) < 1e-6;
  const double least = standing ? least_mm() : step_mm;
  const double closes_N = low_at(coming - least) - now_N;
  const double near_N = NEAR * wanted_N;
  // What tells no load will not tell a slide either.
  const bool exact = haste == Haste::slides || !felt.tells_load;
  // An opening that does not show yet is not taken back for less than a step, nor is a move added to
  // where what slides slows down already.
  const bool waits = !come && (target_mm_ > width_mm || felt.slides);
  const double misses_N = exact ? near_N : std::max(near_N, (waits ? 1.0 : MISSES) * closes_N);
  const auto off = [&](double force_N) { return steps_off(force_N, low_N, width_mm, coming); };
  const bool may_round = felt.tells_load || haste == Haste::patient;
  const double near_steps = std::abs(now_N - wanted_N) > near_N ? nearest_steps(off(wanted_N), least, may_round) : 0.0;
  const bool closes = nearest ? near_steps > 0.0 : now_N < wanted_N - misses_N;
  double to_mm = coming;
  if (closes) {
    double way_mm = step_mm * (nearest ? near_steps : std::ceil(off(wanted_N - misses_N) - 1e-6));
    way_mm = haste == Haste::patient ? std::min(way_mm, step_mm * std::floor(SHORT_mm / step_mm)) : way_mm;
    way_mm = std::max(way_mm, least);
    const double room_mm = this->room_mm(felt, settings, coming);
    if (way_mm > room_mm) {
      // What is held too weakly gets a short move all the same, if the gripper's own limit keeps it
      // below the cap.
      const bool too_weak = !felt.is_alone() && (exact || now_N < WEAK * wanted_N);
      const double short_mm =
          too_weak && limits_itself(settings) ? std::max(least, step_mm * std::floor(SHORT_mm / step_mm)) : 0.0;
      way_mm = std::min(way_mm, std::max(step_mm * std::floor(room_mm / step_mm), short_mm));
      trouble |= GRIP_AT_CAP;
    }
    to_mm = way_mm >= least - 1e-9 ? coming - way_mm : coming;
  } else if (haste != Haste::patient && come && now_N - wanted_N > near_N) {
    double way_mm = std::min(step_mm * std::floor(1e-6 - off(wanted_N + near_N)),
                             std::max(step_mm * std::floor(OPENS_mm / step_mm), least));
    way_mm = low_at(coming + least) >= wanted_N ? std::max(way_mm, least) : way_mm;
    way_mm = nearest ? -step_mm * near_steps : way_mm;
    to_mm = way_mm >= least - 1e-9 ? coming + way_mm : coming;
  }
  if (to_mm != coming) {
    // In whole steps of where it was last sent.
    const double steps = std::round((to_mm - target_mm_) / step_mm);
    const double sent_mm = allowed(target_mm_ + steps * step_mm, felt, settings, trouble);
    if (sent_mm != target_mm_) {
      target_mm_ = sent_mm;
      aimed_s_ = now_s;
    }
  }
  return trouble;
}

} // namespace fingertip
