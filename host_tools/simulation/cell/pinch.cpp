#include "simulation/cell/pinch.hpp"

#include "simulation/twin/effects.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip::cell {
namespace {

constexpr double PER_M = 1e3;
constexpr double TABLE_N_mm = 20.0, TABLE_DAMPING = 0.3;

double size_of(const Vector &v) { return std::hypot(v.x, v.y); }

} // namespace

Pinch::Pinch(const KindOfGrasp &grasp) : grasp_(grasp), along_mm_(grasp.off_mm) {
  for (std::size_t i = 0; i < pads_.size(); i++) {
    pads_[i].strength = twin::relaxation_strengths(grasp.pads[i].relaxation);
  }
}

void Pinch::press(std::size_t i, double seconds, double indentation_mm) {
  Pad &pad = pads_[i];
  const double elastic_N =
      indentation_mm > 0.0 ? grasp_.pads[i].at_1_mm_N * std::pow(indentation_mm, grasp_.exponent) : 0.0;
  double loss_N = 0.0;
  for (std::size_t k = 0; k < pad.strength.size(); k++) {
    pad.follows_N[k] += seconds / twin::Pad::TIMES_s[k] * (elastic_N - pad.follows_N[k]);
    loss_N += pad.strength[k] * pad.follows_N[k];
  }
  pad.elastic_N = elastic_N;
  pad.force_N = std::clamp(elastic_N - loss_N, 0.0, elastic_N);
}

double Pinch::force_at_N(double width_mm) const {
  double force_N = 0.0;
  for (std::size_t i = 0; i < pads_.size(); i++) {
    const double indentation_mm = 0.5 * (grasp_.width_mm - width_mm) + (i == 0 ? -along_mm_ : along_mm_);
    if (indentation_mm > 0.0) {
      const double elastic_N = grasp_.pads[i].at_1_mm_N * std::pow(indentation_mm, grasp_.exponent);
      force_N = std::max(force_N, elastic_N - (pads_[i].elastic_N - pads_[i].force_N));
    }
  }
  return force_N;
}

void Pinch::drag(std::size_t i, double seconds, double friction_share) {
  Pad &pad = pads_[i];
  if (pad.force_N <= 0.0) {
    pad.bristle_mm = pad.load_N = {};
    pad.slips = true;
    return;
  }
  // Rubber's tangential stiffness grows with the radius of contact, as the cube root of the force.
  const double stiffness_N_mm = grasp_.shear_N_mm * std::cbrt(pad.force_N / 4.0);
  const double kinetic = grasp_.kinetic_share;
  const double falls = std::exp(-std::pow(pad.slid_mm_s / grasp_.stribeck_mm_s, 2));
  const double most_N = pad.force_N * friction_share * grasp_.pads[i].friction * (kinetic + (1.0 - kinetic) * falls);
  const Vector before = pad.bristle_mm;
  pad.bristle_mm.x += speed_mm_s_.x * seconds;
  pad.bristle_mm.y += speed_mm_s_.y * seconds;
  const double pull_N = stiffness_N_mm * size_of(pad.bristle_mm);
  pad.slips = pull_N > most_N;
  if (pad.slips) {
    pad.bristle_mm.x *= most_N / pull_N;
    pad.bristle_mm.y *= most_N / pull_N;
  }
  const Vector gives{(pad.bristle_mm.x - before.x) / seconds, (pad.bristle_mm.y - before.y) / seconds};
  pad.slid_mm_s = pad.slips ? std::hypot(speed_mm_s_.x - gives.x, speed_mm_s_.y - gives.y) : 0.0;
  pad.load_N = {stiffness_N_mm * pad.bristle_mm.x + grasp_.rubber_N_s_mm * gives.x,
                stiffness_N_mm * pad.bristle_mm.y + grasp_.rubber_N_s_mm * gives.y};
}

// On the object, upwards.
double Pinch::table_N(const KindOfGrasp::Inputs &inputs) const {
  const double table_mm = grasp_.mass_kg * GRAVITY_m_s2 / TABLE_N_mm;
  const double depth_mm = table_mm - at_mm_.y - inputs.lifted_mm;
  const double damping = 2.0 * TABLE_DAMPING * std::sqrt(inputs.mass_kg * TABLE_N_mm / PER_M);
  const double closing_mm_s = -(speed_mm_s_.y + inputs.lift_mm_s);
  return inputs.table && depth_mm > 0.0 ? std::max(0.0, TABLE_N_mm * depth_mm + damping * closing_mm_s) : 0.0;
}

void Pinch::push_along(double seconds, double squeezed_mm, double mass_kg, double table_N) {
  const double push_N = pads_[0].force_N - pads_[1].force_N;
  const double holds_N = grasp_.table_friction * table_N;
  if (along_mm_s_ == 0.0 && std::abs(push_N) <= holds_N) {
    return;
  }
  // Half of the pads' critical damping; implicit, as nothing limits it.
  double stiffness_N_mm = 0.0;
  for (std::size_t i = 0; i < pads_.size(); i++) {
    const double indentation_mm = squeezed_mm + (i == 0 ? -along_mm_ : along_mm_);
    stiffness_N_mm += indentation_mm > 0.0 ? grasp_.exponent * pads_[i].elastic_N / indentation_mm : 0.0;
  }
  const double damping_N_s_mm = std::sqrt(mass_kg * stiffness_N_mm / PER_M);
  const double against = along_mm_s_ != 0.0 ? along_mm_s_ : push_N;
  const double before_mm_s = along_mm_s_;
  along_mm_s_ += PER_M * (push_N - std::copysign(holds_N, against)) / mass_kg * seconds;
  along_mm_s_ /= 1.0 + PER_M * damping_N_s_mm / mass_kg * seconds;
  if (before_mm_s * along_mm_s_ < 0.0 && std::abs(push_N) <= holds_N) {
    along_mm_s_ = 0.0;
  }
  along_mm_ += along_mm_s_ * seconds;
}

void Pinch::step(double seconds, double width_mm, const KindOfGrasp::Inputs &inputs) {
  const double squeezed_mm = 0.5 * (grasp_.width_mm - width_mm);
  press(0, seconds, squeezed_mm - along_mm_);
  press(1, seconds, squeezed_mm + along_mm_);
  const double feet_N = table_N(inputs);
  push_along(seconds, squeezed_mm, inputs.mass_kg, feet_N);
  drag(0, seconds, inputs.friction_share);
  drag(1, seconds, inputs.friction_share);
  const Vector force_N{inputs.push_N.x - inputs.mass_kg * inputs.hand_m_s2.x - pads_[0].load_N.x - pads_[1].load_N.x,
                       inputs.push_N.y - inputs.mass_kg * (GRAVITY_m_s2 + inputs.hand_m_s2.y) + feet_N -
                           pads_[0].load_N.y - pads_[1].load_N.y};
  speed_mm_s_.x += PER_M * force_N.x / inputs.mass_kg * seconds;
  speed_mm_s_.y += PER_M * force_N.y / inputs.mass_kg * seconds;
  if (feet_N > 0.0 && force_N.y <= 0.0) { // the table's friction holds it in the plane too
    speed_mm_s_.x = 0.0;
  }
  at_mm_.x += speed_mm_s_.x * seconds;
  at_mm_.y += speed_mm_s_.y * seconds;
  if (slips()) {
    slid_mm_ += size_of(speed_mm_s_) * seconds;
  }
}

} // namespace fingertip::cell
