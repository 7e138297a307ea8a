#include "reference/reference.hpp"

#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace fingertip::reference {
namespace {

// In pitches and units of the largest reading, as the firmware works; parameter order p0, x, y, s.
using Vector4 = std::array<double, 4>;

struct Sample {
  double x, y, p;
};

class Residuals final : public ceres::CostFunction {
public:
  explicit Residuals(const std::vector<Sample> &samples) : samples_(samples) {
    set_num_residuals(static_cast<int>(samples.size()));
    mutable_parameter_block_sizes()->push_back(4);
  }

  bool Evaluate(double const *const *parameters, double *residuals,
                double **jacobians) const override {
    const double *theta = parameters[0];
    const double inverse_variance = 1.0 / (theta[3] * theta[3]);
    for (std::size_t k = 0; k < samples_.size(); k++) {
      const double dx = samples_[k].x - theta[1];
      const double dy = samples_[k].y - theta[2];
      const double r2 = dx * dx + dy * dy;
      const double e = std::exp(-0.5 * r2 * inverse_variance);
      residuals[k] = theta[0] * e - samples_[k].p;
      if (jacobians && jacobians[0]) {
        double *row = jacobians[0] + 4 * k;
        row[0] = e;
        row[1] = theta[0] * e * dx * inverse_variance;
        row[2] = theta[0] * e * dy * inverse_variance;
        row[3] = theta[0] * e * r2 * inverse_variance / theta[3];
      }
    }
    return true;
  }

private:
  const std::vector<Sample> &samples_;
};

struct Box {
  Vector4 low, high;
};

Box box_of(const Array &array) {
  const auto [x_low, x_high] = std::minmax_element(array.x_mm.begin(), array.x_mm.end());
  const auto [y_low, y_high] = std::minmax_element(array.y_mm.begin(), array.y_mm.end());
  return {{0.05, *x_low / array.pitch_mm - 1.5, *y_low / array.pitch_mm - 1.5, 0.158},
          {1e6, *x_high / array.pitch_mm + 1.5, *y_high / array.pitch_mm + 1.5, 5.0}};
}

} // namespace

bool observable(const Fit &fit) {
  return fit.location_sd_mm < 0.5 && fit.condition_number < 1e12;
}

Fit fit(const Array &array, const std::vector<double> &pressure_Pa, std::uint32_t usable,
        double noise_Pa, const std::vector<Parameters> &starts) {
  std::vector<std::size_t> order;
  for (std::size_t k = 0; k < array.x_mm.size(); k++) {
    if (usable >> k & 1u) {
      order.push_back(k);
    }
  }
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return pressure_Pa[a] > pressure_Pa[b]; });
  const double largest = pressure_Pa[order.front()];
  std::vector<Sample> samples;
  for (std::size_t k : order) {
    samples.push_back(
        {array.x_mm[k] / array.pitch_mm, array.y_mm[k] / array.pitch_mm, pressure_Pa[k] / largest});
  }

  const Box box = box_of(array);
  std::vector<Vector4> guesses;
  for (const Parameters &start : starts) {
    guesses.push_back({start.p0_Pa / largest, start.x_mm / array.pitch_mm,
                       start.y_mm / array.pitch_mm, start.sigma_mm / array.pitch_mm});
  }
  for (std::size_t i = 0; i < std::min<std::size_t>(4, samples.size()); i++) {
    for (double sigma : {0.35, 0.65, 1.5}) {
      guesses.push_back({1.0, samples[i].x, samples[i].y, sigma});
    }
  }

  Vector4 best{};
  double best_cost = std::numeric_limits<double>::infinity();
  for (Vector4 theta : guesses) {
    for (std::size_t i = 0; i < 4; i++) {
      theta[i] = std::clamp(theta[i], box.low[i], box.high[i]);
    }
    ceres::Problem problem;
    problem.AddResidualBlock(new Residuals(samples), nullptr, theta.data());
    for (int i = 0; i < 4; i++) {
      const auto index = static_cast<std::size_t>(i);
      problem.SetParameterLowerBound(theta.data(), i, box.low[index]);
      problem.SetParameterUpperBound(theta.data(), i, box.high[index]);
    }
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_QR;
    options.max_num_iterations = 300;
    options.function_tolerance = 1e-20;
    options.gradient_tolerance = 1e-18;
    options.parameter_tolerance = 1e-14;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    if (summary.IsSolutionUsable() && summary.final_cost < best_cost) {
      best_cost = summary.final_cost;
      best = theta;
    }
  }

  Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor> jacobian(samples.size(), 4);
  std::vector<double> residuals(samples.size());
  const double *theta = best.data();
  double *jacobian_data = jacobian.data();
  Residuals(samples).Evaluate(&theta, residuals.data(), &jacobian_data);
  const Eigen::Matrix4d information = jacobian.transpose() * jacobian;
  const Eigen::Vector4d scale = information.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::Matrix4d scaled = scale.asDiagonal() * information * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> eigen(scaled);
  const Eigen::Matrix4d covariance =
      scale.asDiagonal() * scaled.inverse().eval() * scale.asDiagonal();

  Fit result{};
  result.theta = {best[0] * largest, best[1] * array.pitch_mm, best[2] * array.pitch_mm,
                  best[3] * array.pitch_mm};
  result.cost = best_cost * largest * largest;
  result.force_N =
      2.0 * M_PI * result.theta.p0_Pa * result.theta.sigma_mm * result.theta.sigma_mm * 1e-6;
  const double radial = std::sqrt(covariance(1, 1) + covariance(2, 2));
  result.location_sd_mm = noise_Pa / largest * array.pitch_mm *
                          (std::isfinite(radial) ? radial : std::numeric_limits<double>::infinity());
  result.condition_number = eigen.eigenvalues()(0) > 0.0
                                ? eigen.eigenvalues()(3) / eigen.eigenvalues()(0)
                                : std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < 4; i++) {
    const double margin = 1e-9 * (box.high[i] - box.low[i]);
    result.at_bound |= best[i] < box.low[i] + margin || best[i] > box.high[i] - margin;
  }
  return result;
}

} // namespace fingertip::reference
