#include "grasp/oracle.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip::grasp {
namespace {

constexpr double MARGIN = 1.2, REMEMBERS_s = 0.5, STANDS_s = 0.3, SPARES = 1.1;

} // namespace

Oracle::Oracle(const cell::KindOfGrasp &grasp, const GripperMechanics &gripper, const GripSettings &settings)
    : grasp_(grasp), gripper_(gripper), settings_(settings) {
  // One force on two springs: their ways add up.
  const double power = 1.0 / grasp.exponent;
  pads_N_ =
      std::pow(std::pow(grasp.pads[0].at_1_mm_N, -power) + std::pow(grasp.pads[1].at_1_mm_N, -power), -grasp.exponent);
}

double Oracle::elastic_N(double width_mm) const {
  return pads_N_ * std::pow(std::max(grasp_.width_mm - width_mm, 0.0), grasp_.exponent);
}

void Oracle::see(const cell::KindMoment &moment) {
  const double force_N = 0.5 * (moment.left_N + moment.right_N);
  const bool lifts = moment.lift_s >= 0.0;
  moments_.push_back({moment.t_s, lifts ? grasp_.least_N(moment.lift_s) / grasp_.kinetic_share : 0.0,
                      lifts ? std::max(elastic_N(moment.width_mm) - force_N, 0.0) : 0.0, lifts});
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
  const auto force_N = [&](double drive_mm) { return std::max(elastic_N(drive_mm + half_mm) - relaxed_N, 0.0); };
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
  const double least_mm = traits.step_mm * std::max(1.0, std::ceil(traits.deadband_mm / traits.step_mm - 1e-9));
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
  if (now_s - moved_s_ > STANDS_s) {
    report_.state = GRIP_HOLDING;
  }
  command.motion = GRIP_MOVE;
  command.width_mm = target_mm_;
  command.speed_mm_s = report_.state == GRIP_SQUEEZE ? settings_.approach_mm_s : traits.speed_max_mm_s;
  command.force_N = traits.force_max_N;
  return report_;
}

} // namespace fingertip::grasp
