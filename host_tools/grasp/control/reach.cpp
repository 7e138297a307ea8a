#include "grasp/control/reach.hpp"

#include <limits>

namespace fingertip {

// Layers of 12 mm under spheres of 6 to 30 mm, 1 to 10 N (host_tools/simulation/twin).
constexpr double EXPONENT = 1.6;
constexpr double STIFFER = 1.2; // safety factor on the stiffness that moves have shown, for the cap
// Elastic over relaxed force: a move adds to the elastic one.
constexpr double RELAXED = 1.1;
// Indentation of both pads at the force of a touch; less cannot be distinguished from none.
constexpr double TOUCHED_mm = 0.3;
constexpr double LEAST_N = 0.05;
// A move teaches if it changes the force by this share or this force; how fast, within which limits.
constexpr double TEACHES = 0.1; // least share of the force, for the bound
constexpr double TEACHES_N = 0.15, LEARNS = 0.5, LEAST_STEEP = 0.4, MOST_STEEP = 3.0;

constexpr double SPACED_s = 0.003;     // least spacing of the widths in the ring
constexpr double WIDTH_LAGS_s = 0.008; // while the gripper moves, the width of a newer force is unknown
constexpr double SHOWS_s = 0.02;       // from a move to its effect in the force, clock errors included
constexpr double POLL_SHARE = 0.05;    // weight of an answer in the moving average
constexpr double MISSES = 0.35;        // share of the effect of the least move that may be missing
constexpr double NEAR = 0.03;          // error that is near enough, as a share of the wanted force
constexpr double WEAK = 0.8;           // a grip below this share of it is too weak
constexpr double SHORT_mm = 0.5;       // length of a short move
constexpr double OPENS_mm = 0.3;       // largest single opening
// A set force may be off by this number of steps: more than half a step, or the gripper would oscillate.
constexpr double OFF = 0.65;
// Distance from the cap in standard deviations of a force, limited to these shares of it: UNCERTAIN contacts report too much.
constexpr double SDS = 2.5, SD_LEAST = 0.04, SD_MOST = 0.06;

// Upper limit of the larger of both true forces.
static double most_N(const GripReadings &readings) {
  return readings.high_N + SDS * std::clamp(readings.sd_N, SD_LEAST * readings.high_N, SD_MOST * readings.high_N);
}

static double indentation_mm(double width_mm, double touch_mm) { return std::max(touch_mm + TOUCHED_mm - width_mm, TOUCHED_mm); }

// One pad's indentation at this force, by a power law.
static double way_to_mm(double force_N, double at_1_mm_N, double exponent) { return std::pow(force_N / at_1_mm_N, 1.0 / exponent); }

// The pad's force at 1 mm, if this travel turned one force into the other.
static double shown_at_1_mm_N(double from_N, double to_N, double way_mm, double exponent) {
  const double unit_mm = way_to_mm(to_N, 1.0, exponent) - way_to_mm(from_N, 1.0, exponent);
  return std::pow(unit_mm / way_mm, exponent);
}

double GripRubber::force_at(double to_mm, double force_N, double from_mm) const {
  const double grown = indentation_mm(to_mm, both_mm_) / indentation_mm(from_mm, both_mm_);
  return std::max(0.0, force_N + std::max(force_N, LEAST_N) * (std::pow(grown, EXPONENT) - 1.0) * (to_mm < from_mm ? closing_ : opening_));
}

double GripRubber::width_for(double wanted_N, double force_N, double from_mm) const {
  const double share = (wanted_N - force_N) / std::max(force_N, LEAST_N) / (wanted_N > force_N ? closing_ : opening_);
  const double grown = std::pow(std::max(1.0 + share, 0.0), 1.0 / EXPONENT);
  return from_mm - (grown - 1.0) * indentation_mm(from_mm, both_mm_);
}

double GripRubber::furthest_mm(double from_mm) const { return from_mm - indentation_mm(from_mm, both_mm_); }

void GripRubber::learn(double force_N, double width_mm) {
  if (has_pair_) {
    double &steep = width_mm < pair_mm_ ? closing_ : opening_;
    const double expected_N = (force_at(width_mm, pair_N_, pair_mm_) - pair_N_) / steep;
    if (std::abs(expected_N) >= TEACHES_N) {
      steep += LEARNS * (std::clamp((force_N - pair_N_) / expected_N, LEAST_STEEP, MOST_STEEP) - steep);
    } else if (std::abs(width_mm - pair_mm_) > 1e-6) {
      return; // a way of many small moves teaches too
    }
  }
  has_pair_ = true;
  pair_N_ = force_N;
  pair_mm_ = width_mm;
}

double GripBound::first_N(double way_mm) {
  return EXPECTED_N * std::max(std::pow(0.5 * way_mm, EXPONENTS[0]), std::pow(0.5 * way_mm, EXPONENTS[1]));
}

double GripBound::width_below(double cap_N, double force_N, double from_mm) const {
  double travel_mm = std::numeric_limits<double>::infinity();
  const double elastic_N = RELAXED * force_N, most_N = std::max(elastic_N + cap_N - force_N, 0.0);
  for (std::size_t i = 0; i < EXPONENTS.size(); i++) {
    travel_mm = std::min(travel_mm, way_to_mm(most_N, at_1_mm_N_[i], EXPONENTS[i]) - way_to_mm(elastic_N, at_1_mm_N_[i], EXPONENTS[i]));
  }
  return from_mm - 2.0 * travel_mm;
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
  const double t_s = status.t_s(), passed_s = t_s - status_.t_s();
  if (!is_heard_) {
    poll_s_ = traits_.poll_s;
  } else if (passed_s > silent_s) {
    count_ = 0; // the widths during a silence are unknown
  } else {
    poll_s_ += POLL_SHARE * (passed_s - poll_s_);
  }
  stopped_s_ = is_heard_ && !status_.moving ? stopped_s_ : t_s;
  status_ = status;
  is_heard_ = true;
  const bool is_back = backs_ && status.width_mm - target_mm_ > traits_.deadband_mm;
  aimed_s_ = is_back ? t_s : aimed_s_;
  backs_ = backs_ && !is_back;
  const double before_s = widths_[(newest_ + widths_.size() - 1) % widths_.size()].t_s;
  if (count_ < 2 || widths_[newest_].t_s - before_s >= SPACED_s) {
    newest_ = (newest_ + 1) % widths_.size();
    count_ = std::min(count_ + 1, widths_.size());
  }
  widths_[newest_] = {t_s, status.width_mm};
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

bool GripReach::has_come(double now_s, double frame_s) const {
  return has_stopped(now_s) && frame_s > aimed_s_ + traits_.latency_s + poll_s_ + SHOWS_s;
}

bool GripReach::limits_itself(const GripSettings &settings) const {
  return traits_.force_max_N > 0.0 && traits_.force_min_N <= LIMIT * settings.cap_N;
}

double GripReach::last_below_cap_mm(const GripReadings &readings, const GripSettings &settings) const {
  const double least_mm = bound_.width_below(settings.cap_N, most_N(readings), width_at(readings.t_s));
  const double steps = std::floor((target_mm_ - least_mm) / traits_.step_mm);
  return target_mm_ - std::max(steps, 0.0) * traits_.step_mm;
}

double GripReach::allowed(double width_mm, const GripReadings &readings, const GripSettings &settings, std::uint32_t &trouble) const {
  const double least_mm = touch_width_mm() - settings.travel_cap_mm;
  if (width_mm < least_mm) {
    width_mm = least_mm;
    trouble |= GRIP_AT_TRAVEL_CAP;
  }
  // A force that may be above the cap is never increased.
  width_mm = readings.over || readings.fingers == 0 ? std::max(width_mm, target_mm_) : width_mm;
  // Without a request the gripper opens no further than the width of the touch.
  return std::clamp(width_mm, 0.0, std::max(target_mm_, touch_width_mm()));
}

bool GripReach::explains(double from_N, double from_s, double to_N, double to_s, const GripSettings &settings) const {
  const double from_mm = width_at(from_s);
  const auto [narrow_mm, wide_mm] = std::minmax({from_mm, width_at(to_s), status_.width_mm, target_mm_});
  const double least_N = rubber_.force_at(wide_mm, from_N, from_mm), most_N = rubber_.force_at(narrow_mm, from_N, from_mm);
  return knows(from_s) && to_N >= least_N - 0.5 * settings.alike_N(least_N) && to_N <= most_N + 0.5 * settings.alike_N(most_N);
}

// Whole steps to the position whose force is nearest. The least move is made when it reduces the error.
double GripReach::nearest_steps(double off, double least_mm) const {
  const double least = std::round(least_mm / traits_.step_mm);
  const double steps = std::abs(off) > 0.5 * least + OFF - 0.5 ? std::max(std::round(std::abs(off)), least) : 0.0;
  return std::copysign(steps, off);
}

void GripReach::learn(const GripReadings &readings, const GripSettings &settings, double now_s) {
  const double width_mm = width_at(readings.t_s);
  const bool come = has_come(now_s, readings.t_s);
  if (come) {
    rubber_.learn(readings.grip_N, width_mm);
  }
  // A gripper that limits its own force may be bounded from moves that overlap: the bound alone does not have to keep it below the cap.
  if (limits_itself(settings) ? come : rests(now_s, readings.t_s)) {
    if (readings.low_N > settings.touch_N && !readings.is_alone()) {
      bound_.learn(readings.grip_N, width_mm);
    } else {
      bound_.forget_pair();
    }
  }
}

GripReach::Outlook GripReach::predict(const GripAim &aim, const GripReadings &readings, double now_s) const {
  Outlook outlook;
  outlook.force_N = aim.nearest || aim.haste == Haste::patient ? readings.low_N : readings.grip_N;
  outlook.width_mm = width_at(readings.t_s);
  outlook.coming_mm = coming_mm(now_s);
  outlook.come = has_come(now_s, readings.t_s);
  const bool at_rest = std::abs(outlook.coming_mm - status_.width_mm) < 1e-6;
  outlook.least_mm = at_rest && (aim.haste != Haste::patient || !can_back()) ? least_mm() : traits_.step_mm;
  outlook.coming_N = force_at(outlook, outlook.coming_mm);
  outlook.near_N = NEAR * aim.wanted_N;
  outlook.exact = aim.haste == Haste::slides || aim.exact;
  // Until the effect of an opening is measured, the controller does not reverse it for less than a
  // step. Nor does it add a smaller move to one under way if a slide is already slowing down.
  const bool waits = !outlook.come && (target_mm_ > outlook.width_mm || readings.slides);
  const double least_N = force_at(outlook, outlook.coming_mm - outlook.least_mm) - outlook.coming_N;
  outlook.misses_N = outlook.exact ? outlook.near_N : std::max(outlook.near_N, (waits ? 1.0 : MISSES) * least_N);
  if (std::abs(outlook.coming_N - aim.wanted_N) > outlook.near_N) {
    outlook.nearest_steps = nearest_steps(steps_to(outlook, aim.wanted_N), outlook.least_mm);
  }
  return outlook;
}

double GripReach::closed_mm(const Outlook &outlook, const GripAim &aim, const GripReadings &readings, const GripSettings &settings,
                            std::uint32_t &trouble) const {
  const double steps = aim.nearest ? outlook.nearest_steps : std::ceil(steps_to(outlook, aim.wanted_N - outlook.misses_N) - 1e-6);
  double way_mm = traits_.step_mm * steps;
  if (aim.haste == Haste::patient) {
    way_mm = std::min(way_mm, std::max(whole_steps(SHORT_mm), least_mm()));
  }
  way_mm = std::min(way_mm, whole_steps(outlook.coming_mm - rubber_.furthest_mm(outlook.width_mm)));
  way_mm = std::max(way_mm, outlook.least_mm);
  const double below_cap_mm = outlook.coming_mm - bound_.width_below(settings.cap_N, most_N(readings), outlook.width_mm);
  if (way_mm > below_cap_mm) {
    // A grip that is too weak gets a short move even then, if the gripper's own limit keeps it below the cap.
    const bool too_weak = !readings.is_alone() && (outlook.exact || outlook.coming_N < WEAK * aim.wanted_N);
    const double short_mm = too_weak && limits_itself(settings) ? std::max(outlook.least_mm, whole_steps(SHORT_mm)) : 0.0;
    way_mm = std::min(way_mm, std::max(whole_steps(below_cap_mm), short_mm));
    trouble |= GRIP_AT_CAP;
  }
  return way_mm >= outlook.least_mm - 1e-9 ? outlook.coming_mm - way_mm : outlook.coming_mm;
}

double GripReach::opened_mm(const Outlook &outlook, const GripAim &aim) const {
  const double least_mm = outlook.least_mm;
  double way_mm = -traits_.step_mm * outlook.nearest_steps;
  if (!aim.nearest) {
    way_mm = std::min(traits_.step_mm * std::floor(1e-6 - steps_to(outlook, aim.wanted_N + outlook.near_N)),
                      std::max(whole_steps(OPENS_mm), least_mm));
    if (force_at(outlook, outlook.coming_mm + least_mm) >= aim.wanted_N) {
      way_mm = std::max(way_mm, least_mm);
    }
  }
  return way_mm >= least_mm - 1e-9 ? outlook.coming_mm + way_mm : outlook.coming_mm;
}

std::uint32_t GripReach::aim(const GripAim &aim, const GripReadings &readings, const GripSettings &settings, double now_s) {
  std::uint32_t trouble = 0;
  const bool knows_width = knows(readings.t_s) && (has_stopped(now_s) || readings.t_s <= status_.t_s() + WIDTH_LAGS_s);
  if (readings.fingers == 0 || !knows_width) {
    return trouble;
  }
  learn(readings, settings, now_s);
  const bool patient = aim.haste == Haste::patient;
  // A gripper that cannot limit its own force moves only after the effect of its last move is measured.
  const bool may_move = limits_itself(settings) ? !patient || has_come(now_s, readings.t_s) : rests(now_s, readings.t_s);
  if (!may_move || (patient && readings.over)) {
    return trouble;
  }
  const Outlook outlook = predict(aim, readings, now_s);
  const bool closes = aim.nearest ? outlook.nearest_steps > 0.0 : outlook.coming_N < aim.wanted_N - outlook.misses_N;
  const bool opens = aim.opens && !closes && !patient && outlook.come && outlook.coming_N - aim.wanted_N > outlook.near_N;
  const double to_mm = closes ? closed_mm(outlook, aim, readings, settings, trouble) : opens ? opened_mm(outlook, aim) : outlook.coming_mm;
  if (to_mm != outlook.coming_mm) {
    const double steps = std::round((to_mm - target_mm_) / traits_.step_mm);
    const double sent_mm = allowed(target_mm_ + steps * traits_.step_mm, readings, settings, trouble);
    if (patient ? sent_mm < outlook.coming_mm : sent_mm != target_mm_) {
      move_to(sent_mm, now_s, patient);
    }
  }
  return trouble;
}

} // namespace fingertip
