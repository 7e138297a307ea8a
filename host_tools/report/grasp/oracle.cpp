#include "report/grasp/oracle.hpp"

#include "simulation/twin/effects.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip::grasp {
namespace {

constexpr double MARGIN = 1.2, REMEMBERS_s = 0.5, RESTS_s = 0.3, SPARES = 1.1;

constexpr double TOUCHED_N = 0.05, REPORTS_N = 1.0; // what shows how a fingertip's force is off
constexpr double REPORTED_s = 0.2;                  // time of the mean
constexpr double SHOWS_s = 0.02;                    // as ours: after a move, in the force
constexpr int PARTS = 24;                           // of the rest of a hold
constexpr double FIRST_mm = 6.0;                    // from the touch, at most
constexpr int FAR_STEPS = 12;                       // and from there

double least_move_mm(const GripperTraits &traits) {
  return traits.step_mm * std::max(1.0, std::ceil(traits.deadband_mm / traits.step_mm - 1e-9));
}

} // namespace

void Oracle::see(const cell::KindMoment &moment) {
  const double force_N = 0.5 * (moment.left_N + moment.right_N);
  const bool lifts = moment.lift_s >= 0.0;
  moments_.push_back({moment.t_s, lifts ? grasp_.least_N(moment.lift_s) / grasp_.kinetic_share : 0.0,
                      lifts ? std::max(grasp_.elastic_N(moment.width_mm) - force_N, 0.0) : 0.0, lifts});
}

double Oracle::wanted_N() const {
  if (!moments_.back().lifts) {
    return settings_.start_N;
  }
  double need_N = 0.0;
  for (auto one = moments_.rbegin(); one != moments_.rend() && one->t_s > newest_s_ - REMEMBERS_s; ++one) {
    need_N = one->t_s <= newest_s_ ? std::max(need_N, one->need_N) : need_N;
  }
  return std::max(MARGIN * need_N, settings_.floor_N);
}

GripReport Oracle::step(double now_s, GripCommand &command) {
  if (status_.host_us == 0 || moments_.empty()) {
    return report_;
  }
  const GripperTraits &traits = gripper_.traits;
  const double half_mm = 0.5 * gripper_.backlash_mm, relaxed_N = moments_.back().relaxed_N;
  const auto force_N = [&](double drive_mm) { return std::max(grasp_.elastic_N(drive_mm + half_mm) - relaxed_N, 0.0); };
  const double wanted_N = std::min(this->wanted_N(), settings_.cap_N);
  report_.wanted_N = wanted_N;
  if (report_.state == GRIP_IDLE) {
    target_mm_ = status_.width_mm;
    report_.state = GRIP_SQUEEZE;
    moved_s_ = now_s;
  }
  // The widest position whose force is enough and that stays below the cap, or this one.
  const double now_N = force_N(target_mm_);
  double to_mm = target_mm_;
  const double least_mm = least_move_mm(traits);
  for (double mm = std::floor(grasp_.width_mm / traits.step_mm) * traits.step_mm;
       mm > 0.0 && force_N(mm) < settings_.cap_N && (now_N < wanted_N || now_N > SPARES * wanted_N);
       mm -= traits.step_mm) {
    if (std::abs(mm - target_mm_) < least_mm - 1e-9 && mm != target_mm_) {
      continue;
    }
    to_mm = mm;
    if (force_N(mm) >= wanted_N) {
      break;
    }
  }
  moved_s_ = status_.moving || to_mm != target_mm_ ? now_s : moved_s_;
  target_mm_ = to_mm;
  if (now_s - moved_s_ > RESTS_s) {
    report_.state = GRIP_HOLDING;
  }
  command.motion = GRIP_MOVE;
  command.width_mm = target_mm_;
  command.speed_mm_s = report_.state == GRIP_SQUEEZE ? settings_.approach_mm_s : traits.speed_max_mm_s;
  command.force_N = traits.force_max_N;
  return report_;
}

StillOracle::StillOracle(const cell::KindTrial &trial)
    : trial_(trial), gripper_(trial.gripper),
      strength_(twin::relaxation_strengths(0.5 * (trial.grasp.pads[0].relaxation + trial.grasp.pads[1].relaxation))) {}

double StillOracle::elastic_N(double drive_mm) const {
  return trial_.grasp.elastic_N(drive_mm + 0.5 * gripper_.backlash_mm);
}

double StillOracle::error_of(double force_N) const { return reported_ * force_N / trial_.set_N - 1.0; }

void StillOracle::see(const cell::KindMoment &moment) {
  const double elastic_N = trial_.grasp.elastic_N(moment.width_mm);
  const double force_N = 0.5 * (moment.left_N + moment.right_N);
  for (std::size_t k = 0; k < follows_N_.size(); k++) {
    const double share = std::min((moment.t_s - seen_s_) / twin::Pad::TIMES_s[k], 1.0);
    follows_N_[k] += share * (elastic_N - follows_N_[k]);
  }
  if (force_N > TOUCHED_N) {
    touched_s_ = std::min(touched_s_, moment.t_s);
  }
  const bool rests = moment.t_s > sent_s_ + gripper_.traits.latency_s + SHOWS_s && !status_.moving;
  if (rests && force_N > REPORTS_N) {
    const double weaker_N = std::min(touch_[0].force_N, touch_[1].force_N);
    reported_ += (moment.t_s - seen_s_) / REPORTED_s * (weaker_N / force_N - reported_);
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
  const double step_mm = gripper_.traits.step_mm, now_mm = target_mm_;
  const double least_mm = least_move_mm(gripper_.traits);
  double least_s = cost_s(now_mm, rest_s);
  for (double way_mm = -far_mm; way_mm <= far_mm; way_mm += step_mm) {
    const double to_mm = step_mm * std::round((now_mm + way_mm) / step_mm), moved_mm = to_mm - now_mm;
    const bool detours = std::abs(moved_mm) < least_mm - 1e-9;
    const double over_mm = now_mm + std::copysign(least_mm, -moved_mm);
    const double cost = cost_s(to_mm, rest_s) + (detours ? passing_cost_s(over_mm) : 0.0);
    if (std::abs(moved_mm) > 1e-6 && cost < least_s) {
      least_s = cost;
      then_mm_ = to_mm;
      target_mm_ = detours ? over_mm : to_mm;
    }
  }
}

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
    target_mm_ = then_mm_ = traits.step_mm * std::round(trial_.grasp.width_mm / traits.step_mm);
    choose(trial_.still_s, FIRST_mm);
    target_mm_ = then_mm_;
    sent_s_ = now_s;
  } else if (!status_.moving && frame_s > sent_s_ + traits.latency_s + traits.poll_s + SHOWS_s) {
    const double before_mm = target_mm_;
    if (target_mm_ != then_mm_) {
      target_mm_ = then_mm_;
    } else if (touched_s_ < now_s) {
      choose(std::max(end_s - now_s, 0.0), FAR_STEPS * traits.step_mm);
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
