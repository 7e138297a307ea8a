#include "grasp/still_oracle.hpp"

#include "simulation/twin/effects.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace fingertip::grasp {
namespace {

constexpr double TOUCHED_N = 0.05, REPORTS_N = 1.0; // what shows how a fingertip's force is off
constexpr double REPORTED_s = 0.2;                  // time of the mean
constexpr double SHOWS_s = 0.02;                    // as ours: after a move, in the force
constexpr int PARTS = 24;                           // of the rest of a hold
constexpr double FIRST_mm = 6.0;                    // from the touch, at most
constexpr int LOOKS_STEPS = 12;                     // and from there

} // namespace

StillOracle::StillOracle(const cell::Trial &trial, const cell::Face &face)
    : trial_(trial), gripper_(trial.gripper), untouched_(face, trial.scene.object, trial.scene.grasp),
      strength_(twin::relaxation_strengths(trial.scene.grasp.relaxation)),
      touched_s_(std::numeric_limits<double>::infinity()) {}

double StillOracle::elastic_N(double drive_mm) const {
  return untouched_.force_at_N(drive_mm + 0.5 * gripper_.backlash_mm);
}

double StillOracle::error_of(double force_N) const { return reported_ * force_N / trial_.set_N - 1.0; }

void StillOracle::see(const cell::Moment &moment) {
  const double elastic_N = untouched_.force_at_N(moment.width_mm);
  for (std::size_t k = 0; k < follows_N_.size(); k++) {
    const double share = std::min((moment.t_s - seen_s_) / twin::Pad::TIMES_s[k], 1.0);
    follows_N_[k] += share * (elastic_N - follows_N_[k]);
  }
  if (moment.force_N > TOUCHED_N) {
    touched_s_ = std::min(touched_s_, moment.t_s);
  }
  const bool rests = moment.t_s > sent_s_ + gripper_.traits.latency_s + SHOWS_s && !status_.moving;
  if (rests && moment.force_N > REPORTS_N) {
    const double weaker_N = std::min(touch_[0].force_N, touch_[1].force_N);
    reported_ += (moment.t_s - seen_s_) / REPORTED_s * (weaker_N / moment.force_N - reported_);
  }
  seen_s_ = moment.t_s;
}

double StillOracle::cost_s(double drive_mm, double rest_s) const {
  const double elastic = elastic_N(drive_mm);
  double squares = 0.0;
  for (int part = 0; part < PARTS; part++) {
    const double ahead_s = rest_s * (part + 0.5) / PARTS;
    double force_N = elastic;
    for (std::size_t k = 0; k < follows_N_.size(); k++) {
      const double left = std::exp(-ahead_s / twin::Pad::TIMES_s[k]);
      force_N -= strength_[k] * (elastic + left * (follows_N_[k] - elastic));
    }
    squares += std::pow(error_of(force_N), 2);
  }
  return squares / PARTS * rest_s;
}

double StillOracle::passing_cost_s(double drive_mm) const {
  double force_N = elastic_N(drive_mm);
  for (std::size_t k = 0; k < follows_N_.size(); k++) {
    force_N -= strength_[k] * follows_N_[k];
  }
  const double stays_s = gripper_.traits.latency_s + gripper_.traits.poll_s + SHOWS_s;
  return std::pow(error_of(std::max(force_N, 0.0)), 2) * stays_s;
}

void StillOracle::choose(double rest_s, double far_mm) {
  const double step_mm = gripper_.traits.step_mm, stands_mm = target_mm_;
  const double least_mm = step_mm * std::max(1.0, std::ceil(gripper_.traits.deadband_mm / step_mm - 1e-9));
  double least_s = cost_s(stands_mm, rest_s);
  for (double way_mm = -far_mm; way_mm <= far_mm; way_mm += step_mm) {
    const double to_mm = step_mm * std::round((stands_mm + way_mm) / step_mm), moved_mm = to_mm - stands_mm;
    const bool round = std::abs(moved_mm) < least_mm - 1e-9;
    const double over_mm = stands_mm + std::copysign(least_mm, -moved_mm);
    const double cost = cost_s(to_mm, rest_s) + (round ? passing_cost_s(over_mm) : 0.0);
    if (std::abs(moved_mm) > 1e-6 && cost < least_s) {
      least_s = cost;
      then_mm_ = to_mm;
      target_mm_ = round ? over_mm : to_mm;
    }
  }
}

void StillOracle::take_touch(std::size_t finger, const GripTouch &touch) { touch_[finger] = touch; }

GripReport StillOracle::step(double now_s, GripCommand &command) {
  const GripperTraits &traits = gripper_.traits;
  if (status_.host_us == 0) {
    return report_;
  }
  const bool first = sent_s_ == 0.0;
  const double frame_s = std::min(touch_[0].t_s, touch_[1].t_s);
  const double end_s = std::min(touched_s_, now_s) + trial_.still_s;
  if (first) {
    // The object's width in whole steps; from there on as from any other position.
    target_mm_ = then_mm_ = traits.step_mm * std::round(trial_.scene.object.width_mm / traits.step_mm);
    choose(trial_.still_s, FIRST_mm);
    target_mm_ = then_mm_;
    sent_s_ = now_s;
  } else if (!status_.moving && frame_s > sent_s_ + traits.latency_s + traits.poll_s + SHOWS_s) {
    const double before_mm = target_mm_;
    if (target_mm_ != then_mm_) {
      target_mm_ = then_mm_;
    } else if (touched_s_ < now_s) {
      choose(std::max(end_s - now_s, 0.0), LOOKS_STEPS * traits.step_mm);
    }
    sent_s_ = target_mm_ != before_mm ? now_s : sent_s_;
  }
  report_.state = GRIP_SQUEEZE;
  report_.wanted_N = trial_.set_N;
  command.motion = GRIP_MOVE;
  command.width_mm = target_mm_;
  command.speed_mm_s = traits.speed_max_mm_s;
  command.force_N = traits.force_max_N;
  return report_;
}

} // namespace fingertip::grasp
