#include "library/pad/point_lift.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

namespace fingertip::twin {
namespace {

// The rest is smooth over a thickness, 3 mm at least: the cubic between these is good to 1e-6.
constexpr double STEP_mm = 0.25;
// Waves with more than this many radians in a thickness are nothing at the surface, exp(-32).
constexpr double H_END = 32.0;
// Panels of eight points each: this many radians of wave number times the largest distance.
constexpr double PANEL_rad = 6.0;

// Gauss and Legendre, eight points in -1..1.
constexpr double POINT[4] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363};
constexpr double WEIGHT[4] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};

// Displacement (i u along the wave, w upward) of one wave and its derivatives by k z.
struct Wave {
  double u, w, du, dw;
};

// The four solutions of one wave number: fading upwards from the base or downwards from the
// surface, y = k z or k (z - h), each as a gradient and as Papkovich and Neuber's.
Wave solution(int n, double kz, double kh, double b) {
  const bool up = n < 2;
  const double y = up ? kz : kz - kh, e = std::exp(up ? -kz : kz - kh), s = up ? -1.0 : 1.0;
  if (n % 2 == 0) {
    return {e, s * e, s * e, e};
  }
  return {-y * e, (b - s * y) * e, -(1.0 + s * y) * e, (s * b - s - y) * e};
}

} // namespace

PointLift::PointLift(const Layer &layer, std::vector<double> heights_mm, double r_max_mm)
    : poisson_(layer.poisson), heights_mm_(std::move(heights_mm)),
      distances_(static_cast<std::size_t>(r_max_mm / STEP_mm) + 4) {
  const double h = layer.thickness_mm, b = 3.0 - 4.0 * poisson_;
  const double lame = 2.0 * poisson_ / (1.0 - 2.0 * poisson_); // per shear modulus
  const double k_end = H_END / h;
  const int panels = static_cast<int>(k_end * r_max_mm / PANEL_rad) + 8;
  const Eigen::Index waves = 8 * panels, heights = static_cast<Eigen::Index>(heights_mm_.size());
  Eigen::MatrixXd volume(waves, heights), along(waves, heights), shear(waves, heights);
  Eigen::VectorXd k_of(waves);
  for (Eigen::Index n = 0; n < waves; n++) {
    const std::size_t q = static_cast<std::size_t>(n % 8);
    const double half = 0.5 * k_end / panels, sign = q < 4 ? -1.0 : 1.0;
    const double k = half * (2.0 * static_cast<double>(n / 8) + 1.0 + sign * POINT[q % 4]);
    const double kh = k * h;
    // Free of stress at the surface, with the half-space's; held at the base.
    const auto stresses = [&](const Wave &wave) {
      return std::pair{lame * (wave.dw - wave.u) + 2.0 * wave.dw, wave.du + wave.w};
    };
    Eigen::Matrix4d conditions;
    for (int c = 0; c < 4; c++) {
      const Wave base = solution(c, 0.0, kh, b), top = solution(c, kh, kh, b);
      const auto [normal, tangential] = stresses(top);
      conditions.col(c) << base.u, base.w, normal, tangential;
    }
    const auto [normal, tangential] = stresses(solution(1, kh, kh, b));
    const Eigen::Vector4d amount =
        conditions.fullPivLu().solve(Eigen::Vector4d(0.0, 0.0, -normal / b, -tangential / b));
    const double weight = half * WEIGHT[q % 4] * k * k / (2.0 * M_PI);
    k_of[n] = k;
    for (Eigen::Index z = 0; z < heights; z++) {
      Wave sum{0.0, 0.0, 0.0, 0.0};
      for (int c = 0; c < 4; c++) {
        const Wave one = solution(c, k * heights_mm_[static_cast<std::size_t>(z)], kh, b);
        sum.u += amount[c] * one.u;
        sum.w += amount[c] * one.w;
        sum.du += amount[c] * one.du;
        sum.dw += amount[c] * one.dw;
      }
      volume(n, z) = weight * (sum.dw - sum.u);
      along(n, z) = -weight * sum.u;
      shear(n, z) = -weight * (sum.du + sum.w);
    }
  }
  Eigen::MatrixXd j0(distances_, waves), j1(distances_, waves), j2(distances_, waves);
  for (Eigen::Index r = 0; r < j0.rows(); r++) {
    for (Eigen::Index n = 0; n < waves; n++) {
      const double kr = k_of[n] * STEP_mm * static_cast<double>(r);
      j0(r, n) = ::j0(kr);
      j1(r, n) = ::j1(kr);
      j2(r, n) = kr > 0.0 ? 2.0 * j1(r, n) / kr - j0(r, n) : 0.0;
    }
  }
  const Eigen::MatrixXd volumes = j0 * volume, planes = j0 * along, stretches = -j2 * along, shears = j1 * shear;
  rest_.reserve(distances_ * heights_mm_.size());
  for (Eigen::Index z = 0; z < heights; z++) {
    for (Eigen::Index r = 0; r < j0.rows(); r++) {
      rest_.push_back({volumes(r, z), planes(r, z), stretches(r, z), shears(r, z)});
    }
  }
}

// With f = z / (2 pi R^3), which is harmonic, u = f e_z - z / b grad f.
PointLift::Parts PointLift::half_space(double r, double z) const {
  const double b = 3.0 - 4.0 * poisson_, R2 = r * r + z * z;
  const double by = 1.0 / (2.0 * M_PI * R2 * R2 * std::sqrt(R2)); // R^-5 / (2 pi)
  const double f_z = (r * r - 2.0 * z * z) * by, f_r = -3.0 * z * r * by;
  const double f_rz = 3.0 * r * (4.0 * z * z - r * r) / R2 * by;
  const double f_rr_less = 15.0 * z * r * r / R2 * by; // f_rr - f_r / r
  const double f_zz = 3.0 * z * (2.0 * z * z - 3.0 * r * r) / R2 * by;
  return {f_z * (1.0 - 1.0 / b), z / b * f_zz, -z / b * f_rr_less, f_r * (1.0 - 1.0 / b) - 2.0 * z / b * f_rz};
}

PointLift::Stress PointLift::stress(double r_mm, std::size_t height) const {
  const double at = r_mm / STEP_mm;
  const std::size_t first = std::min(static_cast<std::size_t>(std::max(at - 1.0, 0.0)), distances_ - 4);
  const double t = at - static_cast<double>(first) - 1.0;
  const double weight[4] = {-t * (t - 1.0) * (t - 2.0) / 6.0, (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
                            -(t + 1.0) * t * (t - 2.0) / 2.0, (t + 1.0) * t * (t - 1.0) / 6.0};
  Parts sum = half_space(r_mm, heights_mm_[height]);
  for (std::size_t n = 0; n < 4; n++) {
    const Parts &part = rest_[height * distances_ + first + n];
    sum.volume += weight[n] * part.volume;
    sum.plane += weight[n] * part.plane;
    sum.stretch += weight[n] * part.stretch;
    sum.shear += weight[n] * part.shear;
  }
  const double lame = 2.0 * poisson_ / (1.0 - 2.0 * poisson_);
  return {lame * sum.volume + sum.plane + sum.stretch, lame * sum.volume + sum.plane - sum.stretch, sum.shear};
}

} // namespace fingertip::twin
