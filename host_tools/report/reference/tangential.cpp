#include "report/reference/tangential.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <ceres/ceres.h>
#include <cmath>

namespace fingertip::reference {
namespace {

enum { F, X, Y, T, E1, E2, QX, QY, UNKNOWNS };

constexpr double KAPPA = 1.3;
constexpr double MODEL_SD = 0.005;
constexpr double ELONGATION_SD_mm2 = 4.0;
constexpr double GAUSSIAN_VARIANCE = 0.912, GAUSSIAN_FORCE = 1.0753;
constexpr double SPREAD_LEAST = 0.3; // of the narrowest term's variance, below zero
constexpr double SPREAD_MOST = 2.0;  // of the widest term's

// Standard deviations add as in the firmware: the longer and three eighths of the shorter.
double together(double a, double b) { return std::max(a, b) + 0.375 * std::min(a, b); }

struct Reading {
  const pad_profile &profile;
  TangentialSample sample;
  double weight;

  template <typename Real> bool operator()(const Real *u, Real *residual) const {
    using std::exp;
    const Real dx = sample.x_mm - u[X], dy = sample.y_mm - u[Y], r2 = dx * dx + dy * dy;
    const Real longer = u[E1] * (dx * dx - dy * dy) / 2.0 + u[E2] * dx * dy;
    Real sum(0.0);
    for (const auto &term : profile.normal) {
      const double sd = static_cast<double>(term.sd_mm);
      const Real v = sd * sd + u[T];
      sum += static_cast<double>(term.share) / v * exp(-r2 / (2.0 * v)) * (u[F] + longer / (v * v));
    }
    for (const auto &term : profile.tangential) {
      const double sd = static_cast<double>(term.sd_mm);
      const Real v = sd * sd + KAPPA * u[T];
      sum += static_cast<double>(term.moment_mm) / (v * v) * exp(-r2 / (2.0 * v)) * (u[QX] * dx + u[QY] * dy);
    }
    residual[0] = weight * (1e6 / (2.0 * M_PI) * sum - sample.pressure_Pa);
    return true;
  }
};

struct Prior {
  int unknown;
  double mean, sd;

  template <typename Real> bool operator()(const Real *u, Real *residual) const {
    residual[0] = (u[unknown] - mean) / sd;
    return true;
  }
};

} // namespace

TangentialFit fit_tangential_estimate(const pad_profile &profile, const std::vector<TangentialSample> &samples, double noise_Pa,
                                      const TangentialStart &start) {
  double largest_Pa = 0.0;
  for (const TangentialSample &sample : samples) {
    largest_Pa = std::max(largest_Pa, sample.pressure_Pa);
  }
  const double base_Pa = together(noise_Pa, MODEL_SD * largest_Pa);
  const double narrow = std::pow(static_cast<double>(profile.normal[0].sd_mm), 2);
  const double wide = std::pow(static_cast<double>(profile.normal[PAD_NORMAL_TERMS - 1].sd_mm), 2);
  const double force_N = start.force_N / GAUSSIAN_FORCE;
  const double low = -SPREAD_LEAST * narrow, high = SPREAD_MOST * wide;

  std::array<double, UNKNOWNS> u{};
  ceres::Problem problem;
  for (const TangentialSample &sample : samples) {
    const double sd_Pa = together(base_Pa, sample.gain_sd * std::abs(sample.pressure_Pa));
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Reading, 1, UNKNOWNS>(new Reading{profile, sample, 1.0 / sd_Pa}), nullptr,
                             u.data());
  }
  const double long_sd = ELONGATION_SD_mm2 * force_N;
  for (const Prior &prior : {Prior{T, static_cast<double>(profile.spread_mm2), static_cast<double>(profile.spread_sd_mm2)},
                             Prior{E1, 0.0, long_sd}, Prior{E2, 0.0, long_sd}}) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Prior, 1, UNKNOWNS>(new Prior(prior)), nullptr, u.data());
  }
  problem.SetParameterLowerBound(u.data(), T, low);
  problem.SetParameterUpperBound(u.data(), T, high);

  ceres::Solver::Options options;
  options.max_num_iterations = 300;
  options.function_tolerance = 1e-15;
  options.gradient_tolerance = 1e-15;
  options.parameter_tolerance = 1e-13;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  TangentialFit best{};
  best.cost = HUGE_VAL;
  std::array<double, UNKNOWNS> best_u{};
  const double own = start.sigma_mm * start.sigma_mm - GAUSSIAN_VARIANCE * wide;
  for (const double spread : {std::clamp(own, low, high), static_cast<double>(profile.spread_mm2)}) {
    for (const double qx : {-0.4, 0.0, 0.4}) {
      for (const double qy : {-0.4, 0.0, 0.4}) {
        u = {force_N, start.x_mm - 3.0 * qx, start.y_mm - 3.0 * qy, spread, 0.0, 0.0, qx * force_N, qy * force_N};
        ceres::Solver::Summary summary;
        ceres::Solve(options, &problem, &summary);
        if (summary.IsSolutionUsable() && summary.final_cost < best.cost) {
          best.cost = summary.final_cost;
          best_u = u;
        }
      }
    }
  }
  u = best_u;
  ceres::CRSMatrix rows;
  problem.Evaluate(ceres::Problem::EvaluateOptions(), nullptr, nullptr, nullptr, &rows);
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(rows.num_rows, UNKNOWNS);
  for (int row = 0; row < rows.num_rows; row++) {
    for (int k = rows.rows[static_cast<std::size_t>(row)]; k < rows.rows[static_cast<std::size_t>(row) + 1]; k++) {
      jacobian(row, rows.cols[static_cast<std::size_t>(k)]) = rows.values[static_cast<std::size_t>(k)];
    }
  }
  const Eigen::MatrixXd covariance = (jacobian.transpose() * jacobian).ldlt().solve(Eigen::MatrixXd::Identity(UNKNOWNS, UNKNOWNS));
  best.force_N = u[F];
  best.x_mm = u[X];
  best.y_mm = u[Y];
  best.spread_mm2 = u[T];
  best.qx_N = u[QX];
  best.qy_N = u[QY];
  best.q_sd_N = std::sqrt(0.5 * (covariance(QX, QX) + covariance(QY, QY)));
  best.at_bound = u[T] <= low + 1e-6 || u[T] >= high - 1e-6;
  return best;
}

} // namespace fingertip::reference
