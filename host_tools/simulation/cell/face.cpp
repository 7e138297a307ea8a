#include "simulation/cell/face.hpp"

extern "C" {
#include "config/geometry.h"
}

#include <algorithm>
#include <cmath>

namespace fingertip::cell {

Face::Face(const std::string &name, double layer_mm, const std::filesystem::path &cache) {
  const twin::Layer layer = twin::silicone(layer_mm);
  if (name == "plate") {
    make_plate(layer);
    return;
  }
  table_ = twin::ContactTable::load_or_build(twin::indenter(name), layer, cache);
  traction_.emplace(*table_, layer);
}

void Face::make_plate(const twin::Layer &layer) {
  double half_x_mm = PAD_OVERHANG_mm, half_y_mm = PAD_OVERHANG_mm;
  for (std::size_t k = 0; k < SENSORS; k++) {
    half_x_mm = std::max(half_x_mm, PAD_OVERHANG_mm + static_cast<double>(geometry.x_mm[k]));
    half_y_mm = std::max(half_y_mm, PAD_OVERHANG_mm + static_cast<double>(geometry.y_mm[k]));
  }
  plate_.emplace(layer, half_x_mm, half_y_mm);
  for (std::size_t k = 0; k < SENSORS; k++) {
    const double x = static_cast<double>(geometry.x_mm[k]);
    const double y = static_cast<double>(geometry.y_mm[k]);
    plate_Pa_N_.push_back({plate_->normal_Pa_N(x, y), plate_->along_x_Pa_N(x), plate_->along_y_Pa_N(y)});
  }
}

double Face::indentation_mm(double force_N) const {
  return plate_ ? std::min(force_N, FORCE_MAX_N) / plate_->stiffness_N_mm() : table_->indentation_mm(force_N);
}

double Face::radius_mm(double force_N) const {
  return plate_ ? plate_->radius_mm() : table_->contact_radius_mm(std::max(force_N, twin::ContactTable::FORCE_MIN_N));
}

Pressures Face::base_Pa(const twin::Touch &touch) const {
  Pressures base_Pa{};
  if (!(touch.force_N > 0.0)) {
    return base_Pa;
  }
  const double c = std::cos(touch.angle_rad), s = std::sin(touch.angle_rad);
  const twin::TractionLoad load{touch.force_N, touch.stuck_N, c * touch.pull_x_N + s * touch.pull_y_N,
                                c * touch.pull_y_N - s * touch.pull_x_N};
  for (std::size_t k = 0; k < SENSORS; k++) {
    if (plate_) {
      const auto [down, along_x, along_y] = plate_Pa_N_[k];
      base_Pa[k] = touch.force_N * down + touch.pull_x_N * along_x + touch.pull_y_N * along_y;
      continue;
    }
    const double dx = static_cast<double>(geometry.x_mm[k]) - touch.x_mm;
    const double dy = static_cast<double>(geometry.y_mm[k]) - touch.y_mm;
    const double x = c * dx + s * dy, y = c * dy - s * dx;
    base_Pa[k] = table_->base_pressure_Pa(touch.force_N, x, y) + traction_->base_pressure_Pa(load, x, y);
  }
  return base_Pa;
}

} // namespace fingertip::cell
