#include "simulation/cell/face.hpp"

#include "simulation/cell/plate.hpp"
#include "simulation/twin/traction_table.hpp"

extern "C" {
#include "config/geometry.h"
}

#include <algorithm>
#include <cmath>

namespace fingertip::cell {
namespace {

using twin::ForcePlanes;

constexpr int NODES = (ForcePlanes::NODES + 1) / 2;
constexpr double STEP_mm = 2.0 * ForcePlanes::STEP_mm;
constexpr int FORCES = ForcePlanes::FORCES;
constexpr std::size_t ROOTS = 1001; // of lookups by force

using Weights = std::array<float, 4>;

// Weights of the cubic through four equally spaced nodes, at `t` between the second and the third.
Weights cubic(double t) {
  return {static_cast<float>(-t * (t - 1.0) * (t - 2.0) / 6.0),
          static_cast<float>((t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0),
          static_cast<float>(-(t + 1.0) * t * (t - 2.0) / 2.0), static_cast<float>((t + 1.0) * t * (t - 1.0) / 6.0)};
}

struct Between {
  int first;
  Weights weight;
};

Between between_forces(double force_N) {
  static const double SCALE = (FORCES - 1) / std::log(ForcePlanes::FORCE_MAX_N / ForcePlanes::FORCE_MIN_N);
  const double at = SCALE * std::log(std::clamp(force_N, ForcePlanes::FORCE_MIN_N, ForcePlanes::FORCE_MAX_N) /
                                     ForcePlanes::FORCE_MIN_N);
  const int first = std::clamp(static_cast<int>(at) - 1, 0, FORCES - 4);
  return {first, cubic(at - first - 1)};
}

} // namespace

Face::Face(const std::string &name, double layer_mm, const std::filesystem::path &cache)
    : name_(name), layer_mm_(layer_mm) {
  const twin::Layer layer = twin::silicone(layer_mm);
  if (name == "plate") {
    make_plate(layer);
    return;
  }
  const auto table = twin::ContactTable::load_or_build(twin::indenter(name), layer, cache);
  const twin::TractionTable traction(table, layer);
  for (std::size_t i = 0; i < ROOTS; i++) {
    const double root = static_cast<double>(i) / (ROOTS - 1);
    const double force_N = FORCE_MAX_N * root * root;
    indentation_mm_.push_back(static_cast<float>(table.indentation_mm(force_N)));
    radius_mm_.push_back(static_cast<float>(table.contact_radius_mm(std::max(force_N, ForcePlanes::FORCE_MIN_N))));
  }
  values_.reserve(std::size_t(NODES) * NODES * FORCES * FIELDS);
  for (int i = 0; i < NODES; i++) {
    for (int j = 0; j < NODES; j++) {
      // The last node of the twin's is there for the cubic alone.
      const double x_mm = STEP_mm * i, y_mm = STEP_mm * j;
      for (int f = 0; f < FORCES; f++) {
        const double force_N = ForcePlanes::force_at(f);
        values_.push_back(static_cast<float>(table.base_pressure_Pa(force_N, x_mm, y_mm) / force_N));
        for (const bool along_x : {true, false}) {
          const twin::TractionTable::Load load{force_N, 0.0, along_x ? force_N : 0.0, along_x ? 0.0 : force_N};
          values_.push_back(static_cast<float>(traction.base_pressure_Pa(load, x_mm, y_mm) / force_N));
        }
      }
    }
  }
}

void Face::make_plate(const twin::Layer &layer) {
  double half_x_mm = PAD_OVERHANG_mm, half_y_mm = PAD_OVERHANG_mm;
  for (std::size_t k = 0; k < SENSORS; k++) {
    half_x_mm = std::max(half_x_mm, PAD_OVERHANG_mm + static_cast<double>(geometry.x_mm[k]));
    half_y_mm = std::max(half_y_mm, PAD_OVERHANG_mm + static_cast<double>(geometry.y_mm[k]));
  }
  const Plate plate(layer, half_x_mm, half_y_mm);
  for (std::size_t i = 0; i < ROOTS; i++) {
    const double root = static_cast<double>(i) / (ROOTS - 1);
    indentation_mm_.push_back(static_cast<float>(FORCE_MAX_N * root * root / plate.stiffness_N_mm()));
    radius_mm_.push_back(static_cast<float>(plate.radius_mm()));
  }
  for (std::size_t k = 0; k < SENSORS; k++) {
    const double x = static_cast<double>(geometry.x_mm[k]);
    const double y = static_cast<double>(geometry.y_mm[k]);
    plate_.push_back({plate.normal_Pa_N(x, y), plate.along_x_Pa_N(x), plate.along_y_Pa_N(y)});
  }
}

double Face::at(const std::vector<float> &values, double force_N) {
  const double at = std::sqrt(std::clamp(force_N / FORCE_MAX_N, 0.0, 1.0)) * (ROOTS - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(at), ROOTS - 2);
  const double t = at - static_cast<double>(i);
  return (1.0 - t) * static_cast<double>(values[i]) + t * static_cast<double>(values[i + 1]);
}

Pressures Face::base_Pa(const twin::Touch &touch) const {
  Pressures base_Pa{};
  const double carried_N = touch.force_N - touch.stuck_N;
  if (!(touch.force_N > 0.0)) {
    return base_Pa;
  }
  for (std::size_t k = 0; k < plate_.size(); k++) {
    base_Pa[k] =
        touch.force_N * plate_[k][NORMAL] + touch.pull_x_N * plate_[k][ALONG_X] + touch.pull_y_N * plate_[k][ALONG_Y];
  }
  if (!plate_.empty()) {
    return base_Pa;
  }
  const double c = std::cos(touch.angle_rad), s = std::sin(touch.angle_rad);
  const double share = carried_N > 0.0 ? 1.0 / carried_N : 0.0;
  const float along_x = static_cast<float>(share * (c * touch.pull_x_N + s * touch.pull_y_N));
  const float along_y = static_cast<float>(share * (c * touch.pull_y_N - s * touch.pull_x_N));
  const Between pressed = between_forces(touch.force_N), stuck = between_forces(touch.stuck_N);
  const float force_N = static_cast<float>(touch.force_N);
  const float stuck_N = static_cast<float>(touch.stuck_N);
  for (std::size_t k = 0; k < SENSORS; k++) {
    const double dx = static_cast<double>(geometry.x_mm[k]) - touch.x_mm;
    const double dy = static_cast<double>(geometry.y_mm[k]) - touch.y_mm;
    const double x = (c * dx + s * dy) / STEP_mm, y = (c * dy - s * dx) / STEP_mm;
    const double far_x = std::abs(x), far_y = std::abs(y);
    if (far_x >= NODES - 2 || far_y >= NODES - 2) {
      continue;
    }
    const int i = static_cast<int>(far_x), j = static_cast<int>(far_y);
    const Weights of_x = cubic(far_x - i), of_y = cubic(far_y - j);
    float normal = 0.0F, pull_x = 0.0F, pull_y = 0.0F;
    for (int a = 0; a < 4; a++) {
      for (int b = 0; b < 4; b++) {
        const float *node =
            values_.data() + std::size_t(std::abs(i + a - 1) * NODES + std::abs(j + b - 1)) * FORCES * FIELDS;
        std::array<float, FIELDS> by_force{}, by_stuck{};
        for (std::size_t f = 0; f < 4; f++) {
          const float *at_force = node + (std::size_t(pressed.first) + f) * FIELDS;
          const float *at_stuck = node + (std::size_t(stuck.first) + f) * FIELDS;
          for (std::size_t field = 0; field < FIELDS; field++) {
            by_force[field] += pressed.weight[f] * at_force[field];
            by_stuck[field] += stuck.weight[f] * at_stuck[field];
          }
        }
        const float weight = of_x[std::size_t(a)] * of_y[std::size_t(b)];
        // The node before the middle is the mirror of the one after it.
        const float odd_x = i + a == 0 ? -weight : weight, odd_y = j + b == 0 ? -weight : weight;
        normal += weight * by_force[NORMAL];
        pull_x += odd_x * (force_N * by_force[ALONG_X] - stuck_N * by_stuck[ALONG_X]);
        pull_y += odd_y * (force_N * by_force[ALONG_Y] - stuck_N * by_stuck[ALONG_Y]);
      }
    }
    base_Pa[k] = static_cast<double>(force_N * normal + (x < 0.0 ? -along_x : along_x) * pull_x +
                                     (y < 0.0 ? -along_y : along_y) * pull_y);
  }
  return base_Pa;
}

} // namespace fingertip::cell
