#include "report/fit/libraries.hpp"

#include "common/contact_flags.h"
#include "report/fit/double_kernel.hpp"

#include <Eigen/Dense>
#include <ceres/ceres.h>
#include <ceres/tiny_solver.h>
#include <cmath>
#include <cminpack.h>
#include <gsl/gsl_multifit_nlinear.h>
#include <limits>
#include <map>
#include <memory>

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
KernelResult with(const fit_array &array, const std::int32_t *pressure_Pa_q10, std::uint32_t usable,
                  const KernelSettings &settings) {
  const Samples samples = normalise(array, pressure_Pa_q10, usable);
  KernelResult result{};
  if (samples.count != SENSORS) {
    return result;
  }
  const Gaussian guess = first_guess(samples, settings.noise_Pa);
  double theta[4] = {guess.p0, guess.x, guess.y, guess.sigma};
  MINIMISE(samples, theta);
  const double pitch_mm = static_cast<double>(array.pitch_mm);
  result.x_mm = theta[1] * pitch_mm;
  result.y_mm = theta[2] * pitch_mm;
  result.p0_Pa = theta[0] * samples.unit_Pa;
  result.sigma_mm = theta[3] * pitch_mm;
  result.force_N = 2.0 * M_PI * result.p0_Pa * result.sigma_mm * result.sigma_mm * 1e-6;
  result.used = usable;
  result.flags = CONTACT_FLAG_FIT_VALID;
  return result;
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

ceres::Solver::Options ceres_options() {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = MAX_ITERATIONS;
  options.logging_type = ceres::SILENT;
  return options;
}

void ceres_new(const Samples &samples, double theta[4]) {
  ceres::Problem problem;
  problem.AddResidualBlock(new CeresResiduals(&samples), nullptr, theta);
  ceres::Solver::Summary summary;
  ceres::Solve(ceres_options(), &problem, &summary);
}

class ReusedCeres {
public:
  explicit ReusedCeres(const ceres::Solver::Options &options) : options_(options) {
    problem_.AddResidualBlock(new CeresResiduals(&samples_), nullptr, theta_);
  }
  void solve(const Samples &samples, double theta[4]) {
    samples_ = samples;
    std::copy(theta, theta + 4, theta_);
    ceres::Solver::Summary summary;
    ceres::Solve(options_, &problem_, &summary);
    std::copy(theta_, theta_ + 4, theta);
  }

private:
  ceres::Solver::Options options_;
  Samples samples_;
  double theta_[4] = {};
  ceres::Problem problem_;
};

void ceres_reused(const Samples &samples, double theta[4]) {
  static ReusedCeres solver(ceres_options());
  solver.solve(samples, theta);
}

void ceres_tight(const Samples &samples, double theta[4]) {
  static ReusedCeres solver([] {
    ceres::Solver::Options options = ceres_options();
    options.function_tolerance = 1e-14;
    options.gradient_tolerance = 1e-14;
    options.parameter_tolerance = 1e-10;
    return options;
  }());
  solver.solve(samples, theta);
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

using Tiny = ceres::TinySolver<TinyResiduals>;

void solve_tiny(Tiny *solver, const Samples &samples, double theta[4]) {
  Eigen::Vector4d x(theta[0], theta[1], theta[2], theta[3]);
  solver->Solve(TinyResiduals{&samples}, &x);
  std::copy(x.data(), x.data() + 4, theta);
}

void tiny_solver(const Samples &samples, double theta[4]) {
  Tiny solver;
  solve_tiny(&solver, samples, theta);
}

void tiny_tight(const Samples &samples, double theta[4]) {
  Tiny solver;
  solver.options.function_tolerance = 1e-20;
  solver.options.gradient_tolerance = 1e-14;
  solver.options.parameter_tolerance = 1e-10;
  solver.options.cost_threshold = 0.0;
  solve_tiny(&solver, samples, theta);
}

int cminpack_function(void *context, int, int, const double *theta, double *residuals, double *jacobian, int stride,
                      int what) {
  const auto &samples = *static_cast<const Samples *>(context);
  if (what == 1) {
    evaluate(samples, theta, residuals, nullptr, 0, 0);
  } else {
    evaluate(samples, theta, nullptr, jacobian, 1, stride);
  }
  return 0;
}

void cminpack(const Samples &samples, double theta[4]) {
  double residuals[SENSORS], jacobian[SENSORS * 4], work[5 * 4 + SENSORS];
  int pivots[4];
  Samples context = samples;
  const double tolerance = std::sqrt(std::numeric_limits<double>::epsilon());
  lmder1(cminpack_function, &context, SENSORS, 4, theta, residuals, jacobian, SENSORS, tolerance, pivots, work,
         5 * 4 + SENSORS);
}

int gsl_residuals(const gsl_vector *theta, void *context, gsl_vector *residuals) {
  evaluate(*static_cast<const Samples *>(context), theta->data, residuals->data, nullptr, 0, 0);
  return GSL_SUCCESS;
}

int gsl_jacobian(const gsl_vector *theta, void *context, gsl_matrix *jacobian) {
  evaluate(*static_cast<const Samples *>(context), theta->data, nullptr, jacobian->data,
           static_cast<int>(jacobian->tda), 1);
  return GSL_SUCCESS;
}

void gsl(const Samples &samples, double theta[4]) {
  struct Free {
    void operator()(gsl_multifit_nlinear_workspace *w) const { gsl_multifit_nlinear_free(w); }
  };
  static const gsl_multifit_nlinear_parameters parameters = gsl_multifit_nlinear_default_parameters();
  static const std::unique_ptr<gsl_multifit_nlinear_workspace, Free> workspace(
      gsl_multifit_nlinear_alloc(gsl_multifit_nlinear_trust, &parameters, SENSORS, 4));
  Samples context = samples;
  gsl_multifit_nlinear_fdf system{};
  system.f = gsl_residuals;
  system.df = gsl_jacobian;
  system.n = SENSORS;
  system.p = 4;
  system.params = &context;
  const gsl_vector_const_view start = gsl_vector_const_view_array(theta, 4);
  gsl_multifit_nlinear_init(&start.vector, &system, workspace.get());
  int info = 0;
  gsl_multifit_nlinear_driver(MAX_ITERATIONS, 1e-8, 1e-8, 0.0, nullptr, nullptr, &info, workspace.get());
  const gsl_vector *x = gsl_multifit_nlinear_position(workspace.get());
  for (std::size_t i = 0; i < 4; i++) {
    theta[i] = gsl_vector_get(x, i);
  }
}

} // namespace

Solve library_named(const std::string &name) {
  static const std::map<std::string, Solve> libraries{
      {"tiny_solver", with<tiny_solver>}, {"tiny_tight", with<tiny_tight>},
      {"cminpack", with<cminpack>},       {"gsl", with<gsl>},
      {"ceres_new", with<ceres_new>},     {"ceres_reused", with<ceres_reused>},
      {"ceres_tight", with<ceres_tight>},
  };
  const auto found = libraries.find(name);
  return found == libraries.end() ? nullptr : found->second;
}

} // namespace fingertip::fitting
