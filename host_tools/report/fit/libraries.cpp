#include "report/fit/compared.hpp"

#include <Eigen/Dense>
#include <ceres/ceres.h>
#include <ceres/tiny_solver.h>
#include <cmath>

namespace fingertip::fitting {
namespace {

constexpr int SENSORS = 15;
constexpr int MAX_ITERATIONS = 50;

// residual[k] = model - reading; row k of the Jacobian goes to jacobian[k * row + j * column].
void evaluate(const Samples &samples, const double *theta, double *residual, double *jacobian, int row, int column) {
  const double inverse_variance = 1.0 / (theta[3] * theta[3]);
  for (int k = 0; k < SENSORS; k++) {
    const auto s = static_cast<std::size_t>(k);
    const double dx = samples.x[s] - theta[1];
    const double dy = samples.y[s] - theta[2];
    const double r2 = dx * dx + dy * dy;
    const double e = std::exp(-0.5 * r2 * inverse_variance);
    if (residual) {
      residual[k] = theta[0] * e - samples.p[s];
    }
    if (jacobian) {
      const double slope = theta[0] * e * inverse_variance;
      double *at = jacobian + k * row;
      at[0] = e;
      at[column] = slope * dx;
      at[2 * column] = slope * dy;
      at[3 * column] = slope * r2 / theta[3];
    }
  }
}

using Minimise = void (*)(const Samples &samples, double theta[4]);

template <Minimise MINIMISE>
KernelResult with(const fit_array &array, const std::int32_t *pressure_Pa_q10, sensor_map usable, const KernelSettings &settings) {
  const Samples samples = normalise(array, pressure_Pa_q10, usable);
  if (samples.count != SENSORS) {
    return {};
  }
  const Gaussian guess = first_guess(samples, settings.noise_Pa);
  double theta[4] = {guess.p0, guess.x, guess.y, guess.sigma};
  MINIMISE(samples, theta);
  return in_units(array, samples, {theta[0], theta[1], theta[2], theta[3]});
}

class CeresResiduals final : public ceres::SizedCostFunction<SENSORS, 4> {
public:
  explicit CeresResiduals(const Samples *samples) : samples_(samples) {}
  bool Evaluate(double const *const *parameters, double *residuals, double **jacobians) const override {
    evaluate(*samples_, parameters[0], residuals, jacobians ? jacobians[0] : nullptr, 4, 1);
    return true;
  }

private:
  const Samples *samples_;
};

void ceres_reused(const Samples &samples, double theta[4]) {
  static Samples current;
  static double at[4];
  static ceres::Problem problem;
  if (problem.NumResidualBlocks() == 0) {
    problem.AddResidualBlock(new CeresResiduals(&current), nullptr, at);
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = MAX_ITERATIONS;
  options.logging_type = ceres::SILENT;
  current = samples;
  std::copy(theta, theta + 4, at);
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  std::copy(at, at + 4, theta);
}

struct TinyResiduals {
  using Scalar = double;
  enum { NUM_RESIDUALS = SENSORS, NUM_PARAMETERS = 4 };
  const Samples *samples;
  bool operator()(const double *theta, double *residuals, double *jacobian) const {
    evaluate(*samples, theta, residuals, jacobian, 1, SENSORS);
    return true;
  }
};

void tiny_solver(const Samples &samples, double theta[4]) {
  ceres::TinySolver<TinyResiduals> solver;
  Eigen::Vector4d x(theta[0], theta[1], theta[2], theta[3]);
  solver.Solve(TinyResiduals{&samples}, &x);
  std::copy(x.data(), x.data() + 4, theta);
}

} // namespace

Solve library_named(const std::string &name) {
  return name == "ceres_reused" ? with<ceres_reused> : name == "tiny_solver" ? with<tiny_solver> : nullptr;
}

} // namespace fingertip::fitting
