#include "common/contact_flags.h"
#include "report/fit/compared.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace fingertip::fitting {
namespace {

using Vector4 = Eigen::Vector4d;
using Matrix4 = Eigen::Matrix4d;

struct Normal {
  Matrix4 matrix = Matrix4::Zero();
  Vector4 rhs = Vector4::Zero();

  void add(const Vector4 &row, double value) {
    matrix += row * row.transpose();
    rhs += row * value;
  }
};

constexpr double GUESS_SHARE = 0.01;
constexpr double GUESS_NOISE_SDS = 5.0;
constexpr double GUESS_WEIGHT = 3e-3;
constexpr double GUESS_SIGMA = 0.42;
constexpr double STEP_MAX = 0.65;
constexpr double WIDTH_STEP_MAX = 0.5;
constexpr double OVERSHOOT = 0.25;
constexpr double P0_MIN = 0.05;
constexpr double P0_MAX = 1e6;
constexpr double SIGMA_MIN = 0.158;
constexpr double SIGMA_MAX = 5.0;

double limited(double value, double low, double high) { return value > low ? std::min(value, high) : low; }

double best_amplitude(const Samples &samples, const Gaussian &theta) {
  double numerator = 0.0, denominator = 1e-30;
  for (std::size_t k = 0; k < samples.count; k++) {
    const double x = samples.x[k] - theta.x, y = samples.y[k] - theta.y;
    const double e = std::exp(-0.5 * (x * x + y * y) / (theta.sigma * theta.sigma));
    numerator += e * samples.p[k];
    denominator += e * e;
  }
  return limited(numerator / denominator, P0_MIN, P0_MAX);
}

// What the firmware's fit of these readings starts from.
Gaussian firmware_guess(const fit_array &array, const std::int32_t *pressure_Pa_q10, sensor_map usable, const Samples &samples) {
  fit_settings none{};
  none.noise_Pa_q10 = 1;
  fit_result result;
  fit_gaussian(&array, pressure_Pa_q10, usable, &none, &result);
  const double pitch_mm = static_cast<double>(array.pitch_mm);
  Gaussian theta{1.0, static_cast<double>(result.x_mm) / pitch_mm, static_cast<double>(result.y_mm) / pitch_mm,
                 std::max(static_cast<double>(result.sigma_mm) / pitch_mm, SIGMA_MIN)};
  theta.p0 = best_amplitude(samples, theta);
  return theta;
}

} // namespace

Samples normalise(const fit_array &array, const std::int32_t *pressure_Pa_q10, sensor_map usable) {
  Samples samples;
  std::int32_t largest = 0;
  for (unsigned k = 0; k < array.sensor_count; k++) {
    if (usable >> k & 1u) {
      largest = std::max(largest, pressure_Pa_q10[k]);
    }
  }
  if (largest <= 0) {
    return samples;
  }
  samples.unit_Pa = largest / 1024.0;
  for (unsigned k = 0; k < array.sensor_count; k++) {
    if (usable >> k & 1u) {
      const double p = std::max(static_cast<double>(pressure_Pa_q10[k]) / largest, -1.0);
      samples.x[samples.count] = static_cast<double>(array.x[k]);
      samples.y[samples.count] = static_cast<double>(array.y[k]);
      samples.p[samples.count++] = p;
    }
  }
  return samples;
}

// A paraboloid through the logarithms of the large readings, about the peak.
Gaussian first_guess(const Samples &samples, double noise_Pa) {
  const auto first = samples.p.begin();
  const auto peak = static_cast<std::size_t>(std::max_element(first, first + static_cast<std::ptrdiff_t>(samples.count)) - first);
  const double x_peak = samples.x[peak], y_peak = samples.y[peak];
  const double least = std::clamp(GUESS_NOISE_SDS * noise_Pa / samples.unit_Pa, GUESS_SHARE, 0.99);
  Normal normal;
  normal.matrix.diagonal().setConstant(GUESS_WEIGHT);
  normal.rhs[3] = -GUESS_WEIGHT * 0.5 / (GUESS_SIGMA * GUESS_SIGMA);
  for (std::size_t k = 0; k < samples.count; k++) {
    const double p = samples.p[k];
    if (p >= least) {
      const double x = samples.x[k] - x_peak, y = samples.y[k] - y_peak;
      normal.add(p * Vector4(1.0, x, y, x * x + y * y), p * std::log(p));
    }
  }
  const Vector4 c = normal.matrix.ldlt().solve(normal.rhs);
  const double half_inverse = 0.5 / limited(-c[3], 0.5 / (SIGMA_MAX * SIGMA_MAX), 0.5 / (0.25 * 0.25));
  Gaussian theta{1.0, x_peak + limited(c[1] * half_inverse, -1.0, 1.0), y_peak + limited(c[2] * half_inverse, -1.0, 1.0),
                 std::sqrt(half_inverse)};
  theta.p0 = best_amplitude(samples, theta);
  return theta;
}

KernelResult in_units(const fit_array &array, const Samples &samples, const Gaussian &theta) {
  const double pitch_mm = static_cast<double>(array.pitch_mm);
  return {theta.x * pitch_mm, theta.y * pitch_mm, theta.p0 * samples.unit_Pa, theta.sigma * pitch_mm, CONTACT_FLAG_FIT_VALID};
}

KernelResult double_kernel(const fit_array &array, const std::int32_t *pressure_Pa_q10, sensor_map usable, const KernelSettings &settings) {
  const Samples samples = normalise(array, pressure_Pa_q10, usable);
  if (samples.count < 4) {
    return {};
  }
  Gaussian theta =
      settings.firmware_guess ? firmware_guess(array, pressure_Pa_q10, usable, samples) : first_guess(samples, settings.noise_Pa);
  const double x_min = static_cast<double>(array.x_min), x_max = static_cast<double>(array.x_max);
  const double y_min = static_cast<double>(array.y_min), y_max = static_cast<double>(array.y_max);
  for (int i = 0; i < settings.iterations; i++) {
    theta.p0 = best_amplitude(samples, theta);
    Normal normal;
    for (std::size_t k = 0; k < samples.count; k++) {
      const double x = samples.x[k] - theta.x, y = samples.y[k] - theta.y;
      const double r2 = x * x + y * y;
      const double e = std::exp(-0.5 * r2 / (theta.sigma * theta.sigma));
      normal.add(e * Vector4(1.0, x, y, r2), samples.p[k] - theta.p0 * e);
    }
    const double gain = theta.sigma * theta.sigma / theta.p0;
    const Vector4 b = normal.matrix.ldlt().solve(normal.rhs);
    const double excess = gain * std::max({std::abs(b[1]) / STEP_MAX, std::abs(b[2]) / STEP_MAX, std::abs(b[3]) / WIDTH_STEP_MAX});
    const double share = excess > 1.0 ? 1.0 / excess : 1.0;
    theta.p0 = limited(theta.p0 + share * b[0], P0_MIN, P0_MAX);
    theta.x = limited(theta.x + share * gain * b[1], x_min - OVERSHOOT, x_max + OVERSHOOT);
    theta.y = limited(theta.y + share * gain * b[2], y_min - OVERSHOOT, y_max + OVERSHOOT);
    theta.sigma = limited(theta.sigma * (1.0 + share * gain * b[3]), SIGMA_MIN, SIGMA_MAX);
  }
  theta.x = limited(theta.x, x_min, x_max);
  theta.y = limited(theta.y, y_min, y_max);
  return in_units(array, samples, theta);
}

} // namespace fingertip::fitting
