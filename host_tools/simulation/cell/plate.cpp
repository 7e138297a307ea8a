#include "simulation/cell/plate.hpp"

#include <cmath>

namespace fingertip::cell {
namespace {

constexpr int TERMS = 41; // of each axis, odd ones
constexpr double PA_PER_MPA = 1e6;
constexpr double DECAY = 4.212; // real part of the first root of sin z + z = 0

} // namespace

Plate::Plate(const twin::Layer &layer, double half_x_mm, double half_y_mm)
    : thickness_mm_(layer.thickness_mm), half_x_mm_(half_x_mm), half_y_mm_(half_y_mm) {
  mean_ = 1.0;
  for (int m = 1; m <= TERMS; m += 2) {
    for (int n = 1; n <= TERMS; n += 2) {
      const double kx = 0.5 * M_PI * m / half_x_mm_, ky = 0.5 * M_PI * n / half_y_mm_;
      mean_ +=
          256.0 / (M_PI * M_PI * M_PI * M_PI * m * m * n * n * thickness_mm_ * thickness_mm_ * (kx * kx + ky * ky));
    }
  }
  const double area_mm2 = 4.0 * half_x_mm_ * half_y_mm_;
  stiffness_N_mm_ = layer.youngs_modulus_Pa / PA_PER_MPA * mean_ * area_mm2 / thickness_mm_;
}

double Plate::radius_mm() const { return std::sqrt(4.0 * half_x_mm_ * half_y_mm_ / M_PI); }

double Plate::squeezed(double x_mm, double y_mm) const {
  double sum = 0.0;
  for (int m = 1; m <= TERMS; m += 2) {
    for (int n = 1; n <= TERMS; n += 2) {
      const double kx = 0.5 * M_PI * m / half_x_mm_, ky = 0.5 * M_PI * n / half_y_mm_;
      const double strength = 64.0 / (M_PI * M_PI * m * n * thickness_mm_ * thickness_mm_ * (kx * kx + ky * ky));
      sum += strength * std::sin(kx * (x_mm + half_x_mm_)) * std::sin(ky * (y_mm + half_y_mm_));
    }
  }
  return sum;
}

double Plate::normal_Pa_N(double x_mm, double y_mm) const {
  return PA_PER_MPA * (1.0 + squeezed(x_mm, y_mm)) / (mean_ * 4.0 * half_x_mm_ * half_y_mm_);
}

// Odd along the force; its moment is half of the thickness.
double Plate::edge_Pa_N(double half_mm, double at_mm) const {
  const double rate = DECAY / thickness_mm_;
  // Integral of x sinh(rate x) from -half to half.
  const double moment = 2.0 * (half_mm * std::cosh(rate * half_mm) / rate - std::sinh(rate * half_mm) / (rate * rate));
  return 0.5 * thickness_mm_ * std::sinh(rate * at_mm) / moment;
}

double Plate::along_x_Pa_N(double x_mm) const { return PA_PER_MPA * edge_Pa_N(half_x_mm_, x_mm) / (2.0 * half_y_mm_); }

double Plate::along_y_Pa_N(double y_mm) const { return PA_PER_MPA * edge_Pa_N(half_y_mm_, y_mm) / (2.0 * half_x_mm_); }

} // namespace fingertip::cell
