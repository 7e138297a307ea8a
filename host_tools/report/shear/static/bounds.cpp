#include "shear/static/bounds.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip::shear {
namespace {

// As fit_tangential.c has them: how much wider the pull is spread than the press, and the prior.
constexpr double KAPPA = 1.3;
constexpr double ELONGATION_SD_mm2 = 3.0;

enum { FORCE, X, Y, SPREAD, STRETCH, SLANT, PULL_X, PULL_Y, UNKNOWNS };
using Unknowns = Eigen::Matrix<double, UNKNOWNS, 1>;
using Information = Eigen::Matrix<double, UNKNOWNS, UNKNOWNS>;

// N, mm; elongations per force.
double model_Pa(const pad_profile &profile, const Unknowns &u, double x_mm, double y_mm) {
  const double dx = x_mm - u[X], dy = y_mm - u[Y], square = dx * dx + dy * dy;
  const double elongated = 0.5 * u[STRETCH] * (dx * dx - dy * dy) + u[SLANT] * dx * dy;
  double sum = 0.0;
  for (const auto &term : profile.normal) {
    const double sd = static_cast<double>(term.sd_mm), v = sd * sd + u[SPREAD];
    sum += u[FORCE] * (1.0 + elongated / (v * v)) * static_cast<double>(term.share) / (2.0 * M_PI * v) *
           std::exp(-0.5 * square / v);
  }
  for (const auto &term : profile.tangential) {
    const double sd = static_cast<double>(term.sd_mm), v = sd * sd + KAPPA * u[SPREAD];
    sum += (u[PULL_X] * dx + u[PULL_Y] * dy) * static_cast<double>(term.moment_mm) / (2.0 * M_PI * v * v) *
           std::exp(-0.5 * square / v);
  }
  return 1e6 * sum;
}

Unknowns slope(const pad_profile &profile, const Unknowns &at, double x_mm, double y_mm) {
  constexpr double STEP = 1e-4; // of unknowns of 1 to 10: the error is 1e-8 of the slope
  Unknowns slope;
  for (int i = 0; i < UNKNOWNS; i++) {
    Unknowns up = at, down = at;
    up[i] += STEP;
    down[i] -= STEP;
    slope[i] = (model_Pa(profile, up, x_mm, y_mm) - model_Pa(profile, down, x_mm, y_mm)) / (2.0 * STEP);
  }
  return slope;
}

} // namespace

Bound bound_of(const fit_array &array, const pad_profile &profile, const twin::Touch &touch, const Errors &errors,
               Told told) {
  Unknowns at;
  at << touch.force_N, touch.x_mm, touch.y_mm, static_cast<double>(profile.spread_mm2), 0.0, 0.0, touch.pull_x_N,
      touch.pull_y_N;
  Unknowns round = at;
  round[PULL_X] = round[PULL_Y] = 0.0;
  const double peak_Pa = model_Pa(profile, round, touch.x_mm, touch.y_mm);
  const double pitch_mm = static_cast<double>(array.pitch_mm);
  Information information = Information::Zero();
  for (std::size_t k = 0; k < SENSORS; k++) {
    const double x_mm = pitch_mm * static_cast<double>(array.x[k]);
    const double y_mm = pitch_mm * static_cast<double>(array.y[k]);
    const double gain_Pa = errors.gain_sd ? (*errors.gain_sd)[k] * model_Pa(profile, at, x_mm, y_mm) : 0.0;
    const double model = errors.model_share * peak_Pa;
    const double variance = errors.noise_Pa * errors.noise_Pa + gain_Pa * gain_Pa + model * model;
    const Unknowns J = slope(profile, at, x_mm, y_mm);
    information += J * J.transpose() / variance;
  }
  if (told != Told::nothing) {
    const double spread_sd = static_cast<double>(profile.spread_sd_mm2);
    // Roundness known for certain: so narrow that it leaves nothing open.
    constexpr double CERTAIN_mm2 = 1e-4;
    const double long_sd = told == Told::round ? CERTAIN_mm2 : ELONGATION_SD_mm2;
    information(SPREAD, SPREAD) += 1.0 / (spread_sd * spread_sd);
    information(STRETCH, STRETCH) += 1.0 / (long_sd * long_sd);
    information(SLANT, SLANT) += 1.0 / (long_sd * long_sd);
  }
  // Scaled to a diagonal of ones: forces and squares of millimetres are far apart.
  const Unknowns scale = information.diagonal().cwiseSqrt().cwiseInverse();
  const Information scaled = scale.asDiagonal() * information * scale.asDiagonal();
  const Information covariance = scale.asDiagonal() * scaled.ldlt().solve(Information::Identity()) * scale.asDiagonal();
  Eigen::Matrix<double, 2, UNKNOWNS> ratio = Eigen::Matrix<double, 2, UNKNOWNS>::Zero();
  ratio(0, PULL_X) = ratio(1, PULL_Y) = 1.0 / touch.force_N;
  ratio(0, FORCE) = -touch.pull_x_N / (touch.force_N * touch.force_N);
  ratio(1, FORCE) = -touch.pull_y_N / (touch.force_N * touch.force_N);
  return {ratio * covariance * ratio.transpose(), covariance.block<2, 2>(X, X)};
}

} // namespace fingertip::shear
