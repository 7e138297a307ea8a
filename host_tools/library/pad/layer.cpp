#include "library/pad/layer.hpp"

#include <cmath>

namespace fingertip::twin {

constexpr double SHORE_A = 15.0;
constexpr double POISSON = 0.49;
// Beyond, exp(-2 H) is nothing beside 1.
constexpr double H_LARGE = 300.0;
// Below, W / H by its limit: the error is of the order of H^2.
constexpr double H_SMALL = 1e-4;

// The denominator of T, W and Q.
static double denominator(double H, double poisson) {
  const double cosh = std::cosh(H), b = 1.0 - 2.0 * poisson;
  return (3.0 - 4.0 * poisson) * cosh * cosh + H * H + b * b;
}

double youngs_modulus_Pa(double shore_a) { return 1e6 * 0.0981 * (56.0 + 7.62336 * shore_a) / (0.137505 * (254.0 - 2.54 * shore_a)); }

Layer silicone(double thickness_mm) { return {thickness_mm, youngs_modulus_Pa(SHORE_A), POISSON}; }

double base_transfer(double H, double poisson) {
  if (H > H_LARGE) {
    return 0.0;
  }
  const double a = 2.0 * (1.0 - poisson);
  return a * (a * std::cosh(H) + H * std::sinh(H)) / denominator(H, poisson);
}

double tangential_share(double H, double poisson) {
  const double sinh_per_cosh = std::tanh(H);
  return (H + (1.0 - 2.0 * poisson) * sinh_per_cosh) / (2.0 * (1.0 - poisson) + H * sinh_per_cosh);
}

double tangential_transfer(double H, double poisson) { return base_transfer(H, poisson) * tangential_share(H, poisson); }

double surface_compliance(double H, double poisson) {
  if (H > H_LARGE) {
    return 1.0 / H;
  }
  if (H < H_SMALL) {
    return (1.0 - 2.0 * poisson) / (2.0 * (1.0 - poisson) * (1.0 - poisson));
  }
  const double b = 3.0 - 4.0 * poisson;
  return (b * std::sinh(H) * std::cosh(H) - H) / (H * denominator(H, poisson));
}

} // namespace fingertip::twin
