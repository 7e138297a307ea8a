#include "simulation/twin/best_gaussian.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip::twin {

constexpr double REACH = 3.0; // thicknesses
constexpr int STEPS = 24;     // from the middle to there
constexpr int FORCES = 33;
constexpr double FORCE_MIN_N = ContactTable::FORCE_MIN_N, FORCE_MAX_N = ContactTable::FORCE_MAX_N;

BestGaussian::BestGaussian(const ContactTable &table, double layer_mm) {
  const double step_mm = REACH * layer_mm / STEPS;
  constexpr int SIDE = 2 * STEPS + 1;
  std::vector<double> pressure(SIDE * SIDE);
  for (int f = 0; f < FORCES; f++) {
    const double force_N = FORCE_MIN_N * std::pow(FORCE_MAX_N / FORCE_MIN_N, f / (FORCES - 1.0));
    double squares = 0.0;
    for (int i = 0; i < SIDE; i++) {
      for (int j = 0; j < SIDE; j++) {
        const double p = table.base_pressure_Pa(force_N, (i - STEPS) * step_mm, (j - STEPS) * step_mm) / force_N;
        pressure[static_cast<std::size_t>(i * SIDE + j)] = p;
        squares += p * p;
      }
    }
    // With the best peak for a width, what is left of the squares; and that peak.
    double p0 = 0.0;
    const auto left = [&](double sigma_mm) {
      std::vector<double> line(SIDE);
      for (int i = 0; i < SIDE; i++) {
        const double u = (i - STEPS) * step_mm / sigma_mm;
        line[static_cast<std::size_t>(i)] = std::exp(-0.5 * u * u);
      }
      double pg = 0.0, gg = 0.0;
      for (std::size_t i = 0; i < SIDE; i++) {
        for (std::size_t j = 0; j < SIDE; j++) {
          const double g = line[i] * line[j];
          pg += pressure[i * SIDE + j] * g;
          gg += g * g;
        }
      }
      p0 = pg / gg;
      return squares - pg * p0;
    };
    // Golden section.
    const double golden = 0.5 * (std::sqrt(5.0) - 1.0);
    double low = 0.1 * layer_mm, high = 3.0 * layer_mm;
    double a = high - golden * (high - low), b = low + golden * (high - low);
    double at_a = left(a), at_b = left(b);
    while (high - low > 1e-5 * layer_mm) {
      if (at_a < at_b) {
        high = b;
        b = a;
        at_b = at_a;
        a = high - golden * (high - low);
        at_a = left(a);
      } else {
        low = a;
        a = b;
        at_a = at_b;
        b = low + golden * (high - low);
        at_b = left(b);
      }
    }
    const double sigma_mm = 0.5 * (low + high);
    left(sigma_mm);
    p0_per_N_.push_back(p0);
    sigma_mm_.push_back(sigma_mm);
  }
}

BestGaussian::Fit BestGaussian::at(double force_N) const {
  const double range = std::log(FORCE_MAX_N / FORCE_MIN_N);
  const double within_N = std::clamp(force_N, FORCE_MIN_N, FORCE_MAX_N);
  const double at = std::log(within_N / FORCE_MIN_N) * (FORCES - 1) / range;
  const std::size_t i = std::min(static_cast<std::size_t>(at), std::size_t(FORCES - 2));
  const double t = at - static_cast<double>(i);
  return {force_N * (p0_per_N_[i] + t * (p0_per_N_[i + 1] - p0_per_N_[i])), sigma_mm_[i] + t * (sigma_mm_[i + 1] - sigma_mm_[i])};
}

} // namespace fingertip::twin
