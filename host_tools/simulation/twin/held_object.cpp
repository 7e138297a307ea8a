#include "simulation/twin/held_object.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace fingertip::twin {

constexpr double mN_PER_N = 1e3; // and mm/s2 per m/s2

double mindlin(double share) { return 1.0 - std::pow(1.0 - share, 1.5); }

HeldObject::HeldObject(double mass_kg, double friction, double kinetic_share)
    : mass_kg_(mass_kg), static_(friction), kinetic_(kinetic_share * friction) {
  // Straight between as many points of the curve as there are elements; where its slope falls, one begins to slide.
  const auto slope = [](int i) {
    return i == ELEMENTS ? 0.0 : ELEMENTS * (mindlin(double(i + 1) / ELEMENTS) - mindlin(double(i) / ELEMENTS));
  };
  for (int i = 0; i < ELEMENTS; i++) {
    const double bend = slope(i) - slope(i + 1);
    elements_[std::size_t(i)] = {bend / 1.5, bend * (i + 1) / ELEMENTS, 0.0};
  }
}

double HeldObject::friction() const { return kinetic_ + (static_ - kinetic_) * rested_; }

void HeldObject::step(double seconds, double force_N, double stiffness_N_mm, double load_N) {
  const double holds_N = friction() * force_N;
  // Forces as they are now, then the motion they make, then what it does to the springs.
  std::array<double, ELEMENTS> forces_N{};
  std::array<bool, ELEMENTS> sliding{};
  tangential_N_ = 0.0;
  for (std::size_t i = 0; i < ELEMENTS; i++) {
    const Element &element = elements_[i];
    const double trial_N = element.spring_N + element.stiffness_share * stiffness_N_mm * LOSS_s * speed_mm_s_;
    sliding[i] = std::abs(trial_N) > element.friction_share * holds_N;
    forces_N[i] = sliding[i] ? std::copysign(element.friction_share * holds_N, trial_N) : trial_N;
    tangential_N_ += forces_N[i];
  }
  const double before_mm_s = speed_mm_s_;
  speed_mm_s_ += mN_PER_N * (load_N - tangential_N_) / mass_kg_ * seconds;
  way_mm_ += speed_mm_s_ * seconds;
  work_mJ_ += load_N * 0.5 * (before_mm_s + speed_mm_s_) * seconds;

  bool forward = true, back = true;
  double slowest_mm_s = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < ELEMENTS; i++) {
    Element &element = elements_[i];
    const double stiffness = element.stiffness_share * stiffness_N_mm;
    // A slider takes what its spring, which the damper slows, does not.
    const double stretch_mm_s = sliding[i] ? (forces_N[i] - element.spring_N) / (stiffness * LOSS_s) : speed_mm_s_;
    const double slip_mm_s = speed_mm_s_ - stretch_mm_s;
    damped_mJ_ += (forces_N[i] - element.spring_N) * stretch_mm_s * seconds;
    rubbed_mJ_ += forces_N[i] * slip_mm_s * seconds;
    element.spring_N += stiffness * stretch_mm_s * seconds;
    forward = forward && sliding[i] && forces_N[i] > 0.0;
    back = back && sliding[i] && forces_N[i] < 0.0;
    slowest_mm_s = std::min(slowest_mm_s, std::abs(slip_mm_s));
  }
  stiffness_N_mm_ = stiffness_N_mm;
  slips_ = forward || back;
  rested_ += seconds * ((1.0 - rested_) / HEALS_s - (slips_ ? rested_ * slowest_mm_s / SETTLES_mm : 0.0));
  rested_ = std::max(rested_, 0.0);
}

HeldObject::Energy HeldObject::energy() const {
  Energy energy;
  energy.work = work_mJ_;
  energy.kinetic = 0.5 * mass_kg_ * speed_mm_s_ * speed_mm_s_ / mN_PER_N;
  for (const Element &element : elements_) {
    energy.elastic += 0.5 * element.spring_N * element.spring_N / (element.stiffness_share * stiffness_N_mm_);
  }
  energy.damped = damped_mJ_;
  energy.rubbed = rubbed_mJ_;
  return energy;
}

} // namespace fingertip::twin
