#include "simulation/twin/force_planes.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace fingertip::twin {
namespace {

// Weights of the cubic through four equally spaced nodes, at `t` between the second and the third.
inline std::array<double, 4> cubic(double t) {
  return {-t * (t - 1.0) * (t - 2.0) / 6.0, (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0, -(t + 1.0) * t * (t - 2.0) / 2.0,
          (t + 1.0) * t * (t - 1.0) / 6.0};
}

// Four neighbouring forces and their weights.
struct Between {
  int first;
  std::array<double, 4> weight;
};

Between between(double force_N) {
  constexpr double LOWEST_N = ForcePlanes::FORCE_MIN_N, HIGHEST_N = ForcePlanes::FORCE_MAX_N;
  const double at =
      std::log(std::clamp(force_N, LOWEST_N, HIGHEST_N) / LOWEST_N) * (ForcePlanes::FORCES - 1) / std::log(HIGHEST_N / LOWEST_N);
  const int first = std::clamp(static_cast<int>(at) - 1, 0, ForcePlanes::FORCES - 4);
  return {first, cubic(at - first - 1)};
}

double sign(double x, ForcePlanes::Symmetry symmetry) { return symmetry == ForcePlanes::Symmetry::odd && x < 0.0 ? -1.0 : 1.0; }

} // namespace

double ForcePlanes::force_at(int n) { return FORCE_MIN_N * std::pow(FORCE_MAX_N / FORCE_MIN_N, double(n) / (FORCES - 1)); }

double ForcePlanes::node(int force, int i, int j) const {
  return static_cast<double>(values_[std::size_t((force * nodes_ + i) * nodes_ + j)]);
}

double ForcePlanes::at(double force_N, double dx_mm, double dy_mm) const {
  const double x = std::abs(dx_mm) / step_mm_, y = std::abs(dy_mm) / step_mm_;
  if (force_N <= 0.0 || x >= nodes_ - 2 || y >= nodes_ - 2) {
    return 0.0;
  }
  const int i = static_cast<int>(x), j = static_cast<int>(y);
  std::array<double, 4> of_x = cubic(x - i), of_y = cubic(y - j);
  // The node before the middle is the mirror of the one after it.
  of_x[0] *= i == 0 ? sign(-1.0, in_x_) : 1.0;
  of_y[0] *= j == 0 ? sign(-1.0, in_y_) : 1.0;
  const Between force = between(force_N);
  const std::size_t plane = std::size_t(nodes_) * std::size_t(nodes_);
  const float *values = values_.data() + std::size_t(force.first) * plane;
  double sum = 0.0;
  for (int a = 0; a < 4; a++) {
    for (int b = 0; b < 4; b++) {
      const float *value = values + std::abs(i + a - 1) * nodes_ + std::abs(j + b - 1);
      double over_forces = 0.0;
      for (std::size_t f = 0; f < 4; f++) {
        over_forces += force.weight[f] * static_cast<double>(value[f * plane]);
      }
      sum += of_x[std::size_t(a)] * of_y[std::size_t(b)] * over_forces;
    }
  }
  return sum * force_N * sign(dx_mm, in_x_) * sign(dy_mm, in_y_);
}

double ForcePlanes::between_forces(const std::vector<float> &values, double force_N) {
  const Between force = between(force_N);
  double sum = 0.0;
  for (int f = 0; f < 4; f++) {
    sum += force.weight[std::size_t(f)] * static_cast<double>(values[std::size_t(force.first + f)]);
  }
  return sum;
}

} // namespace fingertip::twin
