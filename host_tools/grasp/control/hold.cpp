#include "grasp/control/hold.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip {

namespace {

constexpr double FRICTION_LEAST = 0.08, FRICTION_MOST = 1.5;
constexpr double LOAD_NOISE_N = 0.06;
// A load that rises above its latest peak counts as it is, with its rate. Below that it swings on
// the rubber, or has begun to slide, and its mean counts.
constexpr double RATE_s = 0.02, MEAN_s = 0.06, FORGETS_s = 0.3;
// A rate is believed to add that much, or such a share.
constexpr double AHEAD_N = 2.0, AHEAD = 0.65;
constexpr double REMEMBERS_s = 1.0; // what a load has been it may be again
// Where frames come later than SOON_s a push or a slide is answered late, so the grip is stronger
// beforehand: for each second more, and no more than LATEST_s.
constexpr double SOON_s = 0.01, LATEST_s = 0.04, MARGIN_1_s = 12.0, FLOOR_N_s = 28.0;
constexpr double SWINGS_s = 0.25; // what was caught swings for so long
constexpr double HELD_s = 0.015;  // a ratio that held, the mean of so long
// A load is steady that changes by less than this share within 0.1 s, or by less than that.
constexpr double STEADY = 0.15, STEADY_s = 0.1, STEADY_N = 0.15;
constexpr double LOADED_s = 0.3; // a load has been steady
// A reported slide that is slower is a contact that settles, until it has lasted.
constexpr double CREEPS_mm_s = 4.0, CREEPS_s = 0.15;
// What held within so long does not slide at a smaller share of that ratio, unless it has become
// slick; and then it slides so far. Squeezed rubber and what has just been caught move less.
constexpr double LATELY_s = 0.2, BEGINS_AT = 0.7, FAR_mm = 1.0;
// Of what slides and does not slow down: the load is its friction, and what stops it within so
// long; it is followed so quickly.
constexpr double STOPS_s = 0.04, FOLLOWS_s = 0.035, GRAVITY_mm_s2 = 9810.0;
// Friction falls by less than this as a slide quickens. So what slides carries more once its grip
// has grown by so much, and what does not has been caught.
constexpr double GROWN = 1.4;
constexpr double MORE = 1.3; // of its grip, where what slides tells no load

double late_s(double delay_s) {
  return std::clamp(delay_s - SOON_s, 0.0, LATEST_s);
}

} // namespace

void GripFriction::held(double ratio) {
  held_ = std::clamp(ratio, held_, FRICTION_MOST);
}

void GripFriction::slid(double ratio) {
  ratio = std::clamp(ratio, FRICTION_LEAST, FRICTION_MOST);
  slid_ = slid_ > 0.0 ? std::min(slid_, ratio) : ratio;
}

double GripFriction::value(double assumed) const {
  return slid_ > 0.0 ? slid_ : std::max(assumed, held_);
}

void GripLoad::rests(double load_N, double passed_s, bool swings) {
  peak_N_ -= std::min(passed_s / FORGETS_s, 1.0) * (peak_N_ - load_N_);
  const bool rises = load_N >= peak_N_ && !swings;
  swings_s_ = load_N < peak_N_ - 2.0 * LOAD_NOISE_N ? SWINGS_s : swings_s_ - passed_s;
  rate_N_s_ = rises && swings_s_ <= 0.0 ? std::max(load_N - slow_N_ - LOAD_NOISE_N, 0.0) / RATE_s : 0.0;
  slow_N_ += std::min(passed_s / RATE_s, 1.0) * (load_N - slow_N_);
  if (rises) {
    load_N_ = peak_N_ = load_N;
  } else {
    load_N_ += std::min(passed_s / MEAN_s, 1.0) * (load_N - load_N_);
  }
}

double GripLoad::ahead_N(double seconds) const {
  return load_N_ + std::min(rate_N_s_ * seconds, std::max(AHEAD * load_N_, AHEAD_N));
}

bool GripLoad::is_steady() const {
  return rate_N_s_ * STEADY_s < std::max(STEADY * load_N_, STEADY_N);
}

void GripLoad::slides_at(double load_N, double speed_mm_s, double passed_s) {
  const double stops_N = load_N * (1.0 + speed_mm_s / (GRAVITY_mm_s2 * STOPS_s));
  slow_N_ += std::min(passed_s / FOLLOWS_s, 1.0) * (stops_N - slow_N_);
  load_N_ = std::max(load_N_, slow_N_);
  peak_N_ = std::max(peak_N_, load_N_);
  rate_N_s_ = 0.0;
}

void GripHold::begin() {
  *this = GripHold();
}

double GripHold::need_N(const GripSettings &settings, double delay_s, double dead_s) const {
  const double load_N = sliding_ ? load_.now_N() : std::max(load_.ahead_N(dead_s), was_N_);
  const double margin = settings.margin + MARGIN_1_s * late_s(delay_s);
  return (slides_ > 0 ? settings.slid : 1.0) * margin * load_N / friction(settings);
}

void GripHold::look(const GripFelts &felt, const GripSettings &settings, double now_s) {
  const double passed_s = std::clamp(now_s - looked_s_, 0.0, 0.1);
  looked_s_ = now_s;
  still_s_ = felt.slides ? still_s_ : now_s;
  moved_mm_ = felt.slides ? moved_mm_ + felt.speed_mm_s * passed_s : 0.0;
  // The fastest within LATELY_s: what is slower slows down.
  fastest_mm_s_ -= std::min(passed_s / LATELY_s, 1.0) * fastest_mm_s_;
  fastest_mm_s_ = std::max(fastest_mm_s_, felt.speed_mm_s);
  const bool creeps = felt.speed_mm_s < CREEPS_mm_s && now_s - still_s_ < CREEPS_s;
  const bool holds = moved_mm_ < FAR_mm && felt.load_N + LOAD_NOISE_N < BEGINS_AT * lately_ * felt.grip_N;
  const bool was_sliding = sliding_;
  sliding_ = felt.slides && (was_sliding || !felt.tells_load || !(holds || creeps));
  goes_on_ = sliding_ && (!felt.tells_load || (!holds && felt.speed_mm_s >= fastest_mm_s_));
  if (sliding_) {
    slides_ += was_sliding ? 0 : 1;
    slid_s_ = now_s;
    if (goes_on_ && felt.tells_load) {
      // The ratio of what has been caught is no friction.
      const bool grown = was_sliding && felt.grip_N > GROWN * going_N_;
      const bool caught = grown && felt.load_N < going_load_N_;
      if (!caught) {
        friction_.slid(std::max(felt.ratio, FRICTION_LEAST));
      }
      if (!was_sliding || (grown && !caught)) {
        going_N_ = felt.grip_N;
        going_load_N_ = felt.load_N;
      }
      load_.slides_at(felt.load_N, felt.speed_mm_s, passed_s);
    }
    return;
  }
  if (!felt.tells_load) {
    return;
  }
  has_told_ = true;
  load_.rests(felt.load_N, passed_s, slides_ > 0 && now_s - slid_s_ < SWINGS_s);
  was_N_ = std::max(was_N_ - std::min(passed_s / REMEMBERS_s, 1.0) * was_N_, load_.now_N());
  ratio_ += std::min(passed_s / HELD_s, 1.0) * (felt.ratio - ratio_);
  lately_ -= std::min(passed_s / LATELY_s, 1.0) * lately_;
  if (felt.grip_N > 2.0 * settings.touch_N) {
    lately_ = std::max(lately_, felt.ratio);
    felt.slides ? void() : friction_.held(ratio_);
  }
  steady_s_ = load_.now_N() > LOADED_N && load_.is_steady() ? steady_s_ : now_s;
  was_loaded_ = was_loaded_ || now_s - steady_s_ > LOADED_s;
}

double GripHold::wants(const GripFelts &felt, double coming_N, const GripSettings &settings, double now_s,
                       double dead_s) {
  const double passed_s = begun_ ? now_s - now_s_ : 0.0;
  if (!begun_) {
    begun_ = true;
    looked_s_ = still_s_ = steady_s_ = now_s;
    wanted_N_ = felt.grip_N;
  }
  now_s_ = now_s;
  if (felt.fresh) {
    look(felt, settings, now_s);
  }
  const double late_N = settings.sets_force() ? 0.0 : FLOOR_N_s * late_s(felt.delay_s);
  const double least_N = !has_told_ && !felt.tells_load ? settings.blind_N
                         : was_loaded_                  ? settings.floor_N + late_N
                                                        : settings.start_N;
  double need = std::max(need_N(settings, felt.delay_s, dead_s), least_N);
  if (goes_on_ && !felt.tells_load) {
    need = std::max(need, MORE * felt.grip_N);
  }
  need = std::min(need, settings.cap_N);
  is_set_ = settings.sets_force() && need == least_N && !is_loaded() && slides_ == 0;
  if (felt.tells_load && !goes_on_) {
    // What was wanted and is not under way is no longer wanted: a load that was expected has not
    // come. What is there decays slowly.
    wanted_N_ = std::min(wanted_N_, coming_N);
    const bool rests = !felt.slides && (slides_ == 0 || now_s - slid_s_ > settings.rest_s);
    const double share = rests ? 1.0 - std::exp(-settings.decay_1_s * passed_s) : 0.0;
    wanted_N_ -= share * std::max(wanted_N_ - need, 0.0);
  }
  wanted_N_ = std::max(wanted_N_, need);
  return wanted_N_;
}

} // namespace fingertip
