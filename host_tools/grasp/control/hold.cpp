#include "grasp/control/hold.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip {

constexpr double FRICTION_LEAST = 0.08;
// Time constants of the rate, of the mean, and of a peak that is forgotten.
constexpr double RATE_s = 0.02, MEAN_s = 0.06, FORGETS_s = 0.3;
// A rate may add this force to the load, or this share of it.
constexpr double AHEAD_N = 2.0, AHEAD = 0.65;
// Added to margin and floor for each second of delay between SOON_s and SOON_s + LATEST_s.
constexpr double SOON_s = 0.01, LATEST_s = 0.04, MARGIN_1_s = 12.0, FLOOR_N_s = 28.0;
constexpr double REMEMBERS_s = 1.0; // a recent load may return
constexpr double SWINGS_s = 0.25;   // an object that was caught swings for this time
constexpr double HELD_s = 0.015;    // averaging time of a ratio that held
// A load is steady if it changes within STEADY_s by less than this share or this force.
constexpr double STEADY = 0.15, STEADY_s = 0.1, STEADY_N = 0.15;
constexpr double LOADED_s = 0.3; // a load is known once it was steady for this time
// A reported slide below this speed is a contact that settles, unless it lasts longer than CREEPS_s.
constexpr double CREEPS_mm_s = 4.0, CREEPS_s = 0.15;
// Below this share of the ratio that held within LATELY_s, a motion is a slide only from FAR_mm on.
constexpr double LATELY_s = 0.2, BEGINS_AT = 0.7, FAR_mm = 1.0;
// The place of a contact moves by less than this times the share by which the measured grip has fallen lately.
constexpr double SHIFTS_mm = 1.0;
// Friction that falls as a slide begins is followed with this time constant.
constexpr double FALLS_s = 0.06;
// What slides and does not slow down is to be stopped within STOPS_s; the load follows with the time constant FOLLOWS_s.
constexpr double STOPS_s = 0.04, FOLLOWS_s = 0.035, GRAVITY_mm_s2 = 9810.0;
// Friction falls by less than this factor as a slide begins.
constexpr double GROWN = 1.4;

static double late_s(double delay_s) { return std::clamp(delay_s - SOON_s, 0.0, LATEST_s); }

void GripFriction::held(double ratio) { held_ = std::clamp(ratio, held_, MOST); }

void GripFriction::slid(double ratio, double lately) {
  now_ = std::min(now_, std::max(ratio, FRICTION_LEAST));
  slid_ = std::min(slid_ > 0.0 ? slid_ : MOST, std::max(lately, FRICTION_LEAST));
  held_ = 0.0;
}

double GripFriction::value(double assumed) const {
  return std::min(now_, slid_ > 0.0 ? std::max(slid_, held_ / GROWN) : std::max(assumed, held_));
}

void GripLoad::rests(double load_N, double sd_N, double passed_s, bool swings) {
  peak_N_ -= std::min(passed_s / FORGETS_s, 1.0) * (peak_N_ - load_N_);
  const bool rises = load_N >= peak_N_ && !swings;
  swings_s_ = load_N < peak_N_ - 2.0 * sd_N ? SWINGS_s : swings_s_ - passed_s;
  rate_N_s_ = rises && swings_s_ <= 0.0 ? std::max(load_N - slow_N_ - sd_N, 0.0) / RATE_s : 0.0;
  slow_N_ += std::min(passed_s / RATE_s, 1.0) * (load_N - slow_N_);
  if (rises) {
    load_N_ = peak_N_ = load_N;
  } else {
    load_N_ += std::min(passed_s / MEAN_s, 1.0) * (load_N - load_N_);
  }
}

double GripLoad::ahead_N(double seconds) const { return load_N_ + std::min(rate_N_s_ * seconds, std::max(AHEAD * load_N_, AHEAD_N)); }

bool GripLoad::is_steady() const { return rate_N_s_ * STEADY_s < std::max(STEADY * load_N_, STEADY_N); }

void GripLoad::slides_at(double load_N, double speed_mm_s, double passed_s) {
  const double stops_N = load_N * (1.0 + speed_mm_s / (GRAVITY_mm_s2 * STOPS_s));
  slow_N_ += std::min(passed_s / FOLLOWS_s, 1.0) * (stops_N - slow_N_);
  load_N_ = std::max(load_N_, slow_N_);
  peak_N_ = std::max(peak_N_, load_N_);
  rate_N_s_ = 0.0;
}

double GripHold::friction(const GripSettings &settings) const {
  const double known = friction_.value(settings.friction);
  return by_place_ ? std::min(known, PLACE_FRICTION) : known;
}

double GripHold::need_N(const GripSettings &settings, double delay_s, double dead_s) const {
  const double load_N = sliding_ ? load_.now_N() : std::max({load_.ahead_N(dead_s), was_N_, settings.expected_N(was_loaded_)});
  const double margin = settings.margin + MARGIN_1_s * late_s(delay_s);
  return (slides_ > 0 ? settings.slid : 1.0) * margin * load_N / friction(settings);
}

void GripHold::update(const GripReadings &readings, const GripSettings &settings, double now_s) {
  const double passed_s = std::clamp(now_s - updated_s_, 0.0, 0.1);
  updated_s_ = now_s;
  by_place_ = readings.has_load ? readings.by_place : by_place_;
  still_s_ = readings.slides ? still_s_ : now_s;
  moved_mm_ = readings.slides ? moved_mm_ + readings.speed_mm_s * passed_s : 0.0;
  // The largest speed within LATELY_s: a slower slide slows down.
  fastest_mm_s_ -= std::min(passed_s / LATELY_s, 1.0) * fastest_mm_s_;
  fastest_mm_s_ = std::max(fastest_mm_s_, readings.speed_mm_s);
  lately_ -= std::min(passed_s / (sliding_ ? FALLS_s : LATELY_s), 1.0) * lately_;
  const bool creeps = readings.speed_mm_s < CREEPS_mm_s && now_s - still_s_ < CREEPS_s;
  most_N_ = std::max(most_N_ - std::min(passed_s / LATELY_s, 1.0) * most_N_, readings.grip_N);
  const bool shifts = moved_mm_ < SHIFTS_mm * (1.0 - readings.grip_N / most_N_);
  const bool holds = moved_mm_ < FAR_mm && (shifts || readings.load_N < BEGINS_AT * lately_ * readings.grip_N);
  const bool was_sliding = sliding_;
  sliding_ = readings.slides && (was_sliding || !(holds || creeps));
  goes_on_ = sliding_ && !holds && readings.speed_mm_s >= fastest_mm_s_;
  if (sliding_) {
    slides_ += was_sliding ? 0 : 1;
    slid_s_ = now_s;
    place_N_ = was_sliding || !by_place_ ? place_N_ : GROWN * settings.margin * readings.grip_N;
    if (goes_on_) {
      lately_ = std::max(lately_, readings.ratio);
      readings.by_place ? void() : friction_.slid(readings.ratio, lately_);
      load_.slides_at(readings.load_N, readings.speed_mm_s, passed_s);
    }
    return;
  }
  friction_.rests();
  if (!readings.has_load) {
    return;
  }
  has_seen_load_ = true;
  load_.rests(readings.load_N, readings.load_sd_N, passed_s, slides_ > 0 && now_s - slid_s_ < SWINGS_s);
  was_N_ = std::max(was_N_ - std::min(passed_s / REMEMBERS_s, 1.0) * was_N_, load_.now_N());
  ratio_ += std::min(passed_s / HELD_s, 1.0) * (readings.ratio - ratio_);
  if (readings.grip_N > 2.0 * settings.touch_N) {
    lately_ = std::max(lately_, readings.ratio);
    readings.slides || readings.by_place ? void() : friction_.held(ratio_);
  }
  steady_s_ = load_.now_N() > LOADED_N && load_.is_steady() ? steady_s_ : now_s;
  was_loaded_ = was_loaded_ || now_s - steady_s_ > LOADED_s;
}

double GripHold::wants(const GripReadings &readings, double coming_N, const GripSettings &settings, double now_s, double dead_s) {
  const double passed_s = begun_ ? now_s - now_s_ : 0.0;
  if (!begun_) {
    begun_ = true;
    updated_s_ = still_s_ = steady_s_ = now_s;
    wanted_N_ = readings.grip_N;
  }
  now_s_ = now_s;
  if (readings.fresh) {
    update(readings, settings, now_s);
  }
  const double late_N = settings.sets_force() ? 0.0 : FLOOR_N_s * late_s(readings.delay_s);
  const double least_N = !has_seen_load_ && !readings.has_load ? settings.unseen_N()
                         : was_loaded_                         ? settings.floor_N + late_N
                                                               : settings.first_N();
  double need = need_N(settings, readings.delay_s, dead_s);
  if (by_place_) { // which may drift: it opens nothing, and raises only what has not slid up to unseen_N
    need = place_N_ = std::max(place_N_, slides_ > 0 ? need : std::min(need, settings.unseen_N()));
  }
  need = std::min(std::max(need, least_N), settings.cap_N);
  is_set_ = settings.sets_force() && need == least_N && !is_loaded() && slides_ == 0;
  // A force that was wanted and is not under way is given up: the load that it was for has not come.
  if (readings.has_load && !goes_on_) {
    wanted_N_ = std::min(wanted_N_, coming_N);
    // The present grip decays slowly.
    const bool rests = !readings.slides && (slides_ == 0 || now_s - slid_s_ > settings.rest_s);
    const double share = rests ? 1.0 - std::exp(-settings.decay_1_s * passed_s) : 0.0;
    wanted_N_ -= share * std::max(wanted_N_ - need, 0.0);
  }
  return wanted_N_ = std::max(wanted_N_, need);
}

} // namespace fingertip
