#include "web/wasm/world.hpp"

#include "simulation/twin/traction.hpp"

extern "C" {
#include "config/geometry.h"
}

#include <algorithm>
#include <cmath>

namespace fingertip::web {

constexpr double AMBIENT_Pa = 101325.0;
constexpr double PAD_mm = 12.0;
constexpr double BEYOND_X_mm = 6.0, BEYOND_Y_mm = 7.0; // the outer sensors
constexpr double GRAVITY_mm_s2 = 9806.65;
constexpr double mN_PER_N = 1e3; // and mm/s2 per m/s2
constexpr double SHEAR_N_mm2 = 1.0;
constexpr int STEPS_WITHIN = 20; // Bundle's longest step while all slides
constexpr double LEAST_N = twin::ForcePlanes::FORCE_MIN_N;

static bool all_finite(std::initializer_list<double> values) {
  return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
}

static double outermost_mm(const float *places_mm) {
  const auto further = [](float one, float other) { return std::abs(one) < std::abs(other); };
  return static_cast<double>(std::abs(*std::max_element(places_mm, places_mm + geometry.sensor_count, further)));
}

double World::half_width_mm() { return outermost_mm(geometry.x_mm) + BEYOND_X_mm; }
double World::half_length_mm() { return outermost_mm(geometry.y_mm) + BEYOND_Y_mm; }

static bool on_pad(double x_mm, double y_mm) {
  return std::abs(x_mm) <= World::half_width_mm() && std::abs(y_mm) <= World::half_length_mm();
}

World::World(std::vector<Object> objects, const twin::EffectValues &errors, std::uint64_t seed)
    : objects_(std::move(objects)), object_(objects_.data()), errors_(errors, geometry.sensor_count, PAD_mm, AMBIENT_Pa, seed),
      bundle_(friction_, KINETIC_SHARE), base_Pa_(geometry.sensor_count), before_Pa_(geometry.sensor_count),
      now_Pa_(geometry.sensor_count) {
  report();
  before_Pa_ = now_Pa_;
}

void World::choose(std::size_t object) {
  if (object < objects_.size()) {
    object_ = &objects_[object];
    lift();
  }
}

void World::lift() { way_ = Way::none; }

void World::set_friction(double friction) {
  if (std::isfinite(friction)) {
    friction_ = std::clamp(friction, FRICTION_MIN, FRICTION_MAX);
    bundle_.set_friction(friction_);
  }
}

void World::begin_touch(Way way, double x_mm, double y_mm) {
  way_ = way;
  bundle_ = Bundle(friction_, KINETIC_SHARE);
  x_mm_ = x_mm;
  y_mm_ = y_mm;
  vx_mm_s_ = vy_mm_s_ = force_N_ = 0.0;
  load_x_N_ = load_y_N_ = wanted_load_x_N_ = wanted_load_y_N_ = 0.0;
}

void World::press(double x_mm, double y_mm, double force_N) {
  if (!all_finite({x_mm, y_mm, force_N})) {
    return;
  }
  if (way_ != Way::hand) {
    begin_touch(Way::hand, x_mm, y_mm);
  }
  wanted_x_mm_ = x_mm;
  wanted_y_mm_ = y_mm;
  wanted_force_N_ = std::clamp(force_N, 0.0, FORCE_MAX_N);
}

void World::hold(double x_mm, double y_mm, double force_N, double load_N, double angle_rad) {
  if (!all_finite({x_mm, y_mm, force_N, load_N, angle_rad}) || way_ == Way::lost) {
    return;
  }
  if (way_ != Way::grip) {
    begin_touch(Way::grip, x_mm, y_mm);
  }
  wanted_force_N_ = std::clamp(force_N, 0.0, FORCE_MAX_N);
  const double pulls_N = std::clamp(load_N, 0.0, FORCE_MAX_N);
  wanted_load_x_N_ = pulls_N * std::cos(angle_rad);
  wanted_load_y_N_ = pulls_N * std::sin(angle_rad);
  mass_kg_ = std::clamp(mN_PER_N * pulls_N / GRAVITY_mm_s2, MASS_MIN_kg, MASS_MAX_kg);
}

void World::drop(double x_mm, double y_mm, double mass_kg) {
  if (!all_finite({x_mm, y_mm, mass_kg})) {
    return;
  }
  begin_touch(Way::fallen, x_mm, y_mm);
  mass_kg_ = std::clamp(mass_kg, MASS_MIN_kg, MASS_MAX_kg);
  depth_mm_ = -DROP_mm;
  deeper_mm_s_ = 0.0;
}

// Below the least force of the tables, in proportion to the depth.
double World::force_at_N(double depth_mm) const {
  const auto depth_at_mm = [&](double force_N) { return twin::ForcePlanes::between_forces(object_->indentation_mm, force_N); };
  const double least_mm = depth_at_mm(LEAST_N);
  if (depth_mm <= least_mm) {
    return depth_mm > 0.0 ? LEAST_N * depth_mm / least_mm : 0.0;
  }
  // Halving the logarithm's interval to a millionth.
  double low = std::log(LEAST_N), high = std::log(FORCE_MAX_N);
  for (int i = 0; i < 23; i++) {
    const double middle = 0.5 * (low + high);
    (depth_at_mm(std::exp(middle)) < depth_mm ? low : high) = middle;
  }
  return std::exp(0.5 * (low + high));
}

void World::move(double seconds) {
  if (way_ == Way::fallen) {
    const double damped = 1.0 + LOSS_s_mm * deeper_mm_s_;
    force_N_ = std::clamp(force_at_N(depth_mm_) * damped, 0.0, FORCE_MAX_N);
    deeper_mm_s_ += (GRAVITY_mm_s2 - mN_PER_N * force_N_ / mass_kg_) * seconds;
    depth_mm_ += deeper_mm_s_ * seconds;
  } else {
    force_N_ += (wanted_force_N_ - force_N_) * seconds / FOLLOWS_s;
  }
  load_x_N_ += (wanted_load_x_N_ - load_x_N_) * seconds / LOAD_FOLLOWS_s;
  load_y_N_ += (wanted_load_y_N_ - load_y_N_) * seconds / LOAD_FOLLOWS_s;
  if (way_ == Way::hand) {
    vx_mm_s_ = (wanted_x_mm_ - x_mm_) / FOLLOWS_s;
    vy_mm_s_ = (wanted_y_mm_ - y_mm_) / FOLLOWS_s;
  }
  const double radius_mm = force_N_ > 0.0 ? twin::ForcePlanes::between_forces(object_->radius_mm, std::max(force_N_, LEAST_N)) : 0.0;
  const double touching_mm = std::max(radius_mm, 0.05);
  bundle_.step(seconds, force_N_, SHEAR_N_mm2 * touching_mm, {vx_mm_s_, vy_mm_s_});
  if (way_ != Way::hand) {
    vx_mm_s_ += mN_PER_N * (load_x_N_ - bundle_.pull_x_N()) / mass_kg_ * seconds;
    vy_mm_s_ += mN_PER_N * (load_y_N_ - bundle_.pull_y_N()) / mass_kg_ * seconds;
  }
  x_mm_ += vx_mm_s_ * seconds;
  y_mm_ += vy_mm_s_ * seconds;
  if (way_ != Way::hand && !on_pad(x_mm_, y_mm_)) {
    way_ = Way::lost;
  }
}

void World::report() {
  const bool touches = is_pressing() && force_N_ > 0.0 && on_pad(x_mm_, y_mm_);
  truth_ = {};
  truth_.t_s = static_cast<double>(steps_) * STEP_s;
  std::fill(base_Pa_.begin(), base_Pa_.end(), 0.0);
  if (touches) {
    truth_.contact = true;
    truth_.x_mm = x_mm_;
    truth_.y_mm = y_mm_;
    truth_.force_N = force_N_;
    truth_.qx_N = bundle_.pull_x_N();
    truth_.qy_N = bundle_.pull_y_N();
    truth_.slips = bundle_.slips();
    const double pull_N = std::hypot(truth_.qx_N, truth_.qy_N);
    const twin::TractionLoad load{force_N_, twin::stuck_force_N(force_N_, pull_N, bundle_.friction()), truth_.qx_N, truth_.qy_N};
    for (std::size_t k = 0; k < base_Pa_.size(); k++) {
      const double dx_mm = static_cast<double>(geometry.x_mm[k]) - x_mm_;
      const double dy_mm = static_cast<double>(geometry.y_mm[k]) - y_mm_;
      base_Pa_[k] =
          object_->normal.at(force_N_, dx_mm, dy_mm) + twin::traction_pressure_Pa(object_->along_x, object_->along_y, load, dx_mm, dy_mm);
    }
  }
  errors_.report(truth_.t_s, base_Pa_, now_Pa_);
}

void World::step() {
  before_Pa_ = now_Pa_;
  for (int i = 0; i < STEPS_WITHIN && is_pressing(); i++) {
    move(STEP_s / STEPS_WITHIN);
  }
  steps_++;
  report();
}

double World::pressure_Pa(unsigned sensor, std::uint64_t t_us) {
  const double steps = 1e-6 * static_cast<double>(t_us) / STEP_s;
  while (static_cast<double>(steps_) < steps) {
    step();
  }
  const double share = std::clamp(1.0 + steps - static_cast<double>(steps_), 0.0, 1.0);
  return AMBIENT_Pa + before_Pa_[sensor] + share * (now_Pa_[sensor] - before_Pa_[sensor]);
}

} // namespace fingertip::web
