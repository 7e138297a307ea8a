#include "simulation/cell/cell.hpp"

#include "simulation/twin/effects.hpp"
#include "simulation/twin/traction_table.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip::cell {
namespace {

constexpr double PER_M = 1e3;
constexpr double SQUEEZE_STEP_mm = 0.005;
// Stiffness of each foot, and its damping.
constexpr double TABLE_N_mm = 20.0, TABLE_DAMPING = 0.3;
constexpr double FEET_BELOW_mm = 40.0; // the centre of mass

Vector turned(const Vector &v, double rad) {
  const double c = std::cos(rad), s = std::sin(rad);
  return {c * v.x - s * v.y, s * v.x + c * v.y};
}

} // namespace

Cell::Cell(const Face &face, const Object &object, const Grasp &grasp)
    : face_(face), object_(object), grasp_(grasp), down_{std::cos(grasp.down_rad), std::sin(grasp.down_rad)},
      bundles_{Bundle(object.friction * (1.0 + object.uneven_friction), object.kinetic_share),
               Bundle(object.friction * (1.0 - object.uneven_friction), object.kinetic_share)},
      strength_(twin::relaxation_strengths(grasp.relaxation)), com_mm_(object.com_mm), mass_kg_(object.mass_kg),
      table_mm_(object.mass_kg * GRAVITY_m_s2 / (2.0 * TABLE_N_mm)) {
  // The squeeze over the force is the known direction.
  const double gives = 1.0 / grasp.fingers_N_mm + 1.0 / object.stiffness_N_mm;
  const auto squeezed = [&](double force_N) { return 2.0 * face_.indentation_mm(force_N) + gives * force_N; };
  constexpr double FORCE_STEP_N = 0.002;
  double force_N = 0.0;
  force_by_squeeze_.push_back(0.0F);
  for (double at_mm = SQUEEZE_STEP_mm; force_N < Face::FORCE_MAX_N; at_mm += SQUEEZE_STEP_mm) {
    while (squeezed(force_N + FORCE_STEP_N) < at_mm && force_N < Face::FORCE_MAX_N) {
      force_N += FORCE_STEP_N;
    }
    const double below_mm = squeezed(force_N), above_mm = squeezed(force_N + FORCE_STEP_N);
    force_by_squeeze_.push_back(
        static_cast<float>(force_N + FORCE_STEP_N * (at_mm - below_mm) / std::max(above_mm - below_mm, 1e-12)));
  }
}

double Cell::elastic_N(double squeezed_mm) const {
  if (!(squeezed_mm > 0.0)) {
    return 0.0;
  }
  const double at = squeezed_mm / SQUEEZE_STEP_mm;
  const std::size_t i = static_cast<std::size_t>(at);
  if (i + 1 >= force_by_squeeze_.size()) {
    return static_cast<double>(force_by_squeeze_.back());
  }
  const double t = at - static_cast<double>(i);
  return (1.0 - t) * static_cast<double>(force_by_squeeze_[i]) + t * static_cast<double>(force_by_squeeze_[i + 1]);
}

double Cell::force_at_N(double width_mm) const {
  // What has relaxed by now stays away.
  const double elastic = elastic_N(object_.width_mm - width_mm);
  return std::max(0.0, elastic - (elastic_N_ - force_N_));
}

void Cell::press(double seconds, double width_mm) {
  const double elastic = elastic_N(object_.width_mm - width_mm);
  double loss_N = 0.0;
  for (std::size_t i = 0; i < strength_.size(); i++) {
    // Trapezoid: steps are a ten-thousandth of the times.
    const double share = seconds / twin::Pad::TIMES_s[i];
    follows_N_[i] += share * (0.5 * (elastic + elastic_N_) - follows_N_[i]);
    loss_N += strength_[i] * follows_N_[i];
  }
  elastic_N_ = elastic;
  force_N_ = std::clamp(elastic - loss_N, 0.0, elastic);
}

Vector Cell::arm() const { return turned(object_.com_mm, turn_rad_); }

Vector Cell::way_mm() const {
  const Vector to = arm();
  return {com_mm_.x - to.x, com_mm_.y - to.y};
}

// On the centre of mass.
Wrench Cell::table(const Drive &drive) {
  table_N_ = 0.0;
  Wrench sum;
  if (!drive.table) {
    return sum;
  }
  const double damping = 2.0 * TABLE_DAMPING * std::sqrt(0.5 * mass_kg_ * TABLE_N_mm / PER_M); // N s/mm
  const Vector along{-down_.y, down_.x};
  for (const double side : {-0.5, 0.5}) {
    const Vector foot{FEET_BELOW_mm * down_.x + side * object_.base_mm * along.x,
                      FEET_BELOW_mm * down_.y + side * object_.base_mm * along.y};
    const Vector now = turned(foot, turn_rad_);
    const Vector moved{com_mm_.x - object_.com_mm.x + now.x - foot.x, com_mm_.y - object_.com_mm.y + now.y - foot.y};
    const Vector speed{com_mm_s_.x - turning_ * now.y, com_mm_s_.y + turning_ * now.x};
    const double depth_mm = table_mm_ + moved.dot(down_) - drive.lifted_mm;
    const double closing_mm_s = speed.dot(down_) - drive.lift_mm_s;
    if (depth_mm <= 0.0) {
      continue;
    }
    const double push_N = std::max(0.0, TABLE_N_mm * depth_mm + damping * closing_mm_s);
    table_N_ += push_N;
    const Vector force{-push_N * down_.x, -push_N * down_.y};
    sum.x_N += force.x;
    sum.y_N += force.y;
    sum.turn_Nmm += now.x * force.y - now.y * force.x;
  }
  return sum;
}

void Cell::step(double seconds, const Drive &drive) {
  press(seconds, drive.width_mm);
  mass_kg_ = drive.mass_kg;
  const double radius_mm = face_.radius_mm(force_N_);
  const double stiffness_N_mm = grasp_.shear_N_mm2 * radius_mm;
  Wrench held;
  const Motion motion{speed_.x, speed_.y, turning_};
  for (std::size_t f = 0; f < bundles_.size(); f++) {
    const double uneven = f == 0 ? object_.uneven_friction : -object_.uneven_friction;
    bundles_[f].set_friction(object_.friction * (1.0 + uneven) * drive.friction_share);
    const Wrench one = bundles_[f].step(seconds, force_N_, stiffness_N_mm, radius_mm, motion);
    held.x_N += one.x_N;
    held.y_N += one.y_N;
    held.turn_Nmm += one.turn_Nmm;
  }
  const Wrench feet = table(drive);
  const Vector outer_N{mass_kg_ * (GRAVITY_m_s2 * down_.x - drive.hand_m_s2.x) + drive.knock_N.x,
                       mass_kg_ * (GRAVITY_m_s2 * down_.y - drive.hand_m_s2.y) + drive.knock_N.y};
  const Vector to_com = arm();
  const double inertia_kg_mm2 = mass_kg_ * object_.gyration_mm * object_.gyration_mm;
  const double torque_Nmm = held.turn_Nmm + feet.turn_Nmm - (to_com.x * held.y_N - to_com.y * held.x_N);
  const Vector before = com_mm_s_;
  com_mm_s_.x += PER_M * (outer_N.x + held.x_N + feet.x_N) / mass_kg_ * seconds;
  com_mm_s_.y += PER_M * (outer_N.y + held.y_N + feet.y_N) / mass_kg_ * seconds;
  turning_ += PER_M * torque_Nmm / inertia_kg_mm2 * seconds;
  const Vector mean{0.5 * (before.x + com_mm_s_.x), 0.5 * (before.y + com_mm_s_.y)};
  work_mJ_ += outer_N.dot(mean) * seconds;
  table_lost_mJ_ -= (feet.x_N * mean.x + feet.y_N * mean.y + feet.turn_Nmm * turning_) * seconds;
  com_mm_.x += com_mm_s_.x * seconds;
  com_mm_.y += com_mm_s_.y * seconds;
  turn_rad_ += turning_ * seconds;
  const Vector now = arm();
  speed_ = {com_mm_s_.x + turning_ * now.y, com_mm_s_.y - turning_ * now.x};
  if (slips()) {
    slid_mm_ += std::hypot(speed_.x, speed_.y) * seconds;
  }
}

void Cell::run(double seconds, const Drive &drive) {
  constexpr double SLOW_mm_s = 20.0;
  for (double left_s = seconds; left_s > 0.0;) {
    const bool fast = bundles_[0].slips() || bundles_[1].slips() || std::abs(speed_.x) + std::abs(speed_.y) > SLOW_mm_s;
    const double longest_s = fast ? SLIP_s : REST_s;
    // Equal parts, so that no step is a mere remainder.
    const double parts = std::ceil(left_s / longest_s - 1e-9);
    const double step_s = left_s / std::max(parts, 1.0);
    step(step_s, drive);
    left_s = parts > 1.0 ? left_s - step_s : 0.0;
  }
}

twin::Touch Cell::touch(std::size_t finger) const {
  const Bundle &bundle = bundles_[finger];
  const Vector way = way_mm();
  const double mirror = finger == 0 ? 1.0 : -1.0;
  twin::Touch touch;
  touch.force_N = force_N_;
  touch.x_mm = mirror * (grasp_.place_mm.x + way.x);
  touch.y_mm = grasp_.place_mm.y + way.y;
  touch.angle_rad = mirror * (grasp_.angle_rad + turn_rad_);
  touch.pull_x_N = mirror * bundle.pull_x_N();
  touch.pull_y_N = bundle.pull_y_N();
  touch.stuck_N = bundle.slips()
                      ? 0.0
                      : twin::stuck_force_N(force_N_, std::hypot(touch.pull_x_N, touch.pull_y_N), bundle.friction());
  return touch;
}

Cell::Energy Cell::energy() const {
  Energy energy;
  energy.work = work_mJ_;
  energy.kinetic = 0.5 * mass_kg_ / PER_M *
                   (com_mm_s_.dot(com_mm_s_) + object_.gyration_mm * object_.gyration_mm * turning_ * turning_);
  energy.lost = table_lost_mJ_;
  for (const Bundle &bundle : bundles_) {
    energy.elastic += bundle.elastic_mJ(grasp_.shear_N_mm2 * face_.radius_mm(force_N_));
    energy.lost += bundle.lost_mJ();
  }
  return energy;
}

} // namespace fingertip::cell
