#include "report/reference/reference.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <ceres/ceres.h>
#include <cmath>
#include <limits>

namespace fingertip::reference {
namespace {

// In pitches and units of the largest reading, as the firmware works; parameter order p0, x, y, s.
using Vector4 = Eigen::Vector4d;
using Matrix4 = Eigen::Matrix4d;

// Ends of different starts that lie closer than this have found the same place.
constexpr double SAME_END = 1e-4;
// An end whose cost is above this multiple of the best is a trap of its own, not the same valley.
constexpr double HOPELESS_COST = 4.0;
// Locations less certain than this are not observable whatever the last digit of the optimum.
constexpr double HOPELESS_SD_mm = 2.0;

struct Sample {
  double x, y, p;
};

struct Box {
  Vector4 low, high;

  bool touches(const Vector4 &theta) const {
    const Vector4 margin = 1e-9 * (high - low);
    return ((theta - low).array() < margin.array()).any() || ((high - theta).array() < margin.array()).any();
  }
};

// The model of amplitude 1 at a sample, and the derivatives of the logarithm of the model.
struct Model {
  double e, x, y, s;

  Model(const Sample &sample, const double *theta) {
    const double iv = 1.0 / (theta[3] * theta[3]);
    const double dx = sample.x - theta[1], dy = sample.y - theta[2], r2 = dx * dx + dy * dy;
    e = std::exp(-0.5 * r2 * iv);
    x = dx * iv;
    y = dy * iv;
    s = r2 * iv / theta[3];
  }
};

class Residuals final : public ceres::CostFunction {
public:
  explicit Residuals(const std::vector<Sample> &samples) : samples_(samples) {
    set_num_residuals(static_cast<int>(samples.size()));
    mutable_parameter_block_sizes()->push_back(4);
  }

  bool Evaluate(double const *const *parameters, double *residuals, double **jacobians) const override {
    for (std::size_t k = 0; k < samples_.size(); k++) {
      const Model model(samples_[k], parameters[0]);
      const double m = parameters[0][0] * model.e;
      residuals[k] = m - samples_[k].p;
      if (jacobians && jacobians[0]) {
        Eigen::Map<Vector4>(jacobians[0] + 4 * k) << model.e, m * model.x, m * model.y, m * model.s;
      }
    }
    return true;
  }

private:
  const std::vector<Sample> &samples_;
};

struct Quadratic {
  double cost;
  Vector4 gradient;
  Matrix4 gauss_newton; // J^T J
  Matrix4 hessian;      // with the residuals' second derivatives
};

Quadratic expand(const std::vector<Sample> &samples, const Vector4 &theta) {
  Quadratic q{0.0, Vector4::Zero(), Matrix4::Zero(), Matrix4::Zero()};
  const double iv = 1.0 / (theta[3] * theta[3]);
  const double is = 1.0 / theta[3];
  for (const Sample &sample : samples) {
    const auto [e, gx, gy, gs] = Model(sample, theta.data());
    const double m = theta[0] * e;
    const double r = m - sample.p;
    const Vector4 row(e, m * gx, m * gy, m * gs);
    q.cost += 0.5 * r * r;
    q.gradient += r * row;
    q.gauss_newton += row * row.transpose();
    Matrix4 second;
    second << 0.0, e * gx, e * gy, e * gs,                                 //
        e * gx, m * (gx * gx - iv), m * gx * gy, m * gx * (gs - 2.0 * is), //
        e * gy, m * gx * gy, m * (gy * gy - iv), m * gy * (gs - 2.0 * is), //
        e * gs, m * gx * (gs - 2.0 * is), m * gy * (gs - 2.0 * is), m * gs * (gs - 3.0 * is);
    q.hessian += r * second;
  }
  q.hessian += q.gauss_newton;
  return q;
}

double cost_at(const std::vector<Sample> &samples, const Vector4 &theta) {
  double cost = 0.0;
  for (const Sample &sample : samples) {
    const double r = theta[0] * Model(sample, theta.data()).e - sample.p;
    cost += 0.5 * r * r;
  }
  return cost;
}

// Takes parameters that rest on the box and are pushed outwards out of the system.
void hold_at_box(const Box &box, const Vector4 &theta, const Vector4 &gradient, Matrix4 *matrix, Vector4 *right) {
  for (int i = 0; i < 4; i++) {
    if ((theta[i] <= box.low[i] && gradient[i] > 0.0) || (theta[i] >= box.high[i] && gradient[i] < 0.0)) {
      matrix->row(i).setZero();
      matrix->col(i).setZero();
      (*matrix)(i, i) = 1.0;
      (*right)[i] = 0.0;
    }
  }
}

Vector4 into_box(const Box &box, const Vector4 &theta) { return theta.cwiseMax(box.low).cwiseMin(box.high); }

Vector4 levenberg_marquardt(const std::vector<Sample> &samples, const Box &box, Vector4 theta) {
  double lambda = 1e-4;
  Quadratic q = expand(samples, theta);
  for (int i = 0; i < 60 && lambda < 1e12; i++) {
    Matrix4 matrix = q.gauss_newton;
    matrix.diagonal() *= 1.0 + lambda;
    matrix.diagonal().array() += 1e-30;
    Vector4 step = -q.gradient;
    hold_at_box(box, theta, q.gradient, &matrix, &step);
    step = matrix.ldlt().solve(step).eval();
    const Vector4 next = into_box(box, theta + step);
    if (!next.allFinite()) {
      lambda *= 10.0;
      continue;
    }
    const double moved = (next - theta).cwiseAbs().maxCoeff();
    if (cost_at(samples, next) < q.cost) {
      theta = next;
      q = expand(samples, theta);
      lambda = std::max(lambda * 0.1, 1e-15);
    } else {
      lambda *= 10.0;
    }
    if (moved < 1e-10) {
      break;
    }
  }
  return theta;
}

// Newton steps for as long as they shrink. The gradient is known to rounding while the cost is
// flat to its square root, so the step decides, not the cost.
Vector4 polish(const std::vector<Sample> &samples, const Box &box, Vector4 theta) {
  const double allowed = cost_at(samples, theta) * (1.0 + 1e-9) + 1e-26;
  double last = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 30; i++) {
    const Quadratic q = expand(samples, theta);
    Matrix4 matrix = q.hessian;
    Vector4 step = -q.gradient;
    hold_at_box(box, theta, q.gradient, &matrix, &step);
    const Vector4 scale = matrix.diagonal().cwiseAbs().cwiseSqrt().cwiseInverse();
    const Eigen::LDLT<Matrix4> factors(scale.asDiagonal() * matrix * scale.asDiagonal());
    if (factors.info() != Eigen::Success || !factors.isPositive()) {
      break;
    }
    step = scale.asDiagonal() * factors.solve(scale.asDiagonal() * step).eval();
    const Vector4 next = into_box(box, theta + step);
    const double moved = (next - theta).cwiseAbs().maxCoeff();
    if (!(moved < last) || !(cost_at(samples, next) <= allowed)) {
      break;
    }
    theta = next;
    last = moved;
    if (moved < 1e-15) {
      break;
    }
  }
  return theta;
}

Vector4 by_ceres(const std::vector<Sample> &samples, const Box &box, Vector4 theta) {
  Residuals residuals(samples);
  ceres::Problem::Options ownership;
  ownership.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(ownership);
  problem.AddResidualBlock(&residuals, nullptr, theta.data());
  for (int i = 0; i < 4; i++) {
    problem.SetParameterLowerBound(theta.data(), i, box.low[i]);
    problem.SetParameterUpperBound(theta.data(), i, box.high[i]);
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = 300;
  options.function_tolerance = 1e-14;
  options.gradient_tolerance = 1e-14;
  options.parameter_tolerance = 1e-9;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return theta;
}

struct Shape {
  double radial; // sd of the location per sd of a reading, pitches and units of the largest
  double condition_number;
};

Shape shape_at(const std::vector<Sample> &samples, const Vector4 &theta) {
  const Matrix4 information = expand(samples, theta).gauss_newton;
  const Vector4 scale = information.diagonal().cwiseSqrt().cwiseInverse();
  const Matrix4 scaled = scale.asDiagonal() * information * scale.asDiagonal();
  const double infinity = std::numeric_limits<double>::infinity();
  if (!scaled.allFinite()) {
    return {infinity, infinity};
  }
  const Eigen::SelfAdjointEigenSolver<Matrix4> eigen(scaled);
  const Matrix4 covariance = scale.asDiagonal() * scaled.inverse().eval() * scale.asDiagonal();
  const double radial = std::sqrt(covariance(1, 1) + covariance(2, 2));
  return {std::isfinite(radial) ? radial : infinity,
          eigen.eigenvalues()(0) > 0.0 ? eigen.eigenvalues()(3) / eigen.eigenvalues()(0) : infinity};
}

Box box_of(const Array &array) {
  const auto [x_low, x_high] = std::minmax_element(array.x_mm.begin(), array.x_mm.end());
  const auto [y_low, y_high] = std::minmax_element(array.y_mm.begin(), array.y_mm.end());
  return {{0.05, *x_low / array.pitch_mm - 1.5, *y_low / array.pitch_mm - 1.5, 0.158},
          {1e6, *x_high / array.pitch_mm + 1.5, *y_high / array.pitch_mm + 1.5, 5.0}};
}

} // namespace

Fit fit(const Array &array, const double *pressure_Pa, std::uint64_t usable, double noise_Pa, const Parameters *start, bool all_starts) {
  std::vector<std::size_t> order;
  for (std::size_t k = 0; k < array.x_mm.size(); k++) {
    if (usable >> k & 1u) {
      order.push_back(k);
    }
  }
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return pressure_Pa[a] > pressure_Pa[b]; });
  const double largest = pressure_Pa[order.front()];
  std::vector<Sample> samples;
  for (std::size_t k : order) {
    samples.push_back({array.x_mm[k] / array.pitch_mm, array.y_mm[k] / array.pitch_mm, pressure_Pa[k] / largest});
  }

  const Box box = box_of(array);
  const Vector4 middle(1.0, samples[0].x, samples[0].y, 0.65);
  std::vector<Vector4> guesses{middle};
  if (start) {
    guesses.emplace_back(start->p0_Pa / largest, start->x_mm / array.pitch_mm, start->y_mm / array.pitch_mm,
                         start->sigma_mm / array.pitch_mm);
  }
  for (std::size_t i = 0; i < std::min<std::size_t>(4, samples.size()); i++) {
    for (double sigma : {0.35, 0.65, 1.5}) {
      if (i > 0 || sigma != 0.65) {
        guesses.emplace_back(1.0, samples[i].x, samples[i].y, sigma);
      }
    }
  }

  Vector4 best = into_box(box, middle);
  double best_cost = std::numeric_limits<double>::infinity();
  const auto offer = [&](const Vector4 &theta) {
    const double cost = theta.allFinite() ? cost_at(samples, theta) : best_cost;
    if (cost < best_cost) {
      best_cost = cost;
      best = theta;
    }
    return cost;
  };
  std::vector<Vector4> ends;
  for (const Vector4 &guess : guesses) {
    const Vector4 end = levenberg_marquardt(samples, box, into_box(box, guess));
    offer(end);
    if (std::none_of(ends.begin(), ends.end(), [&](const Vector4 &other) { return (other - end).cwiseAbs().maxCoeff() < SAME_END; })) {
      ends.push_back(end);
    }
  }
  // From here on the costs are those that Ceres reached.
  best_cost = std::numeric_limits<double>::infinity();
  offer(by_ceres(samples, box, best));
  const double independent = offer(by_ceres(samples, box, into_box(box, middle)));
  Shape shape = shape_at(samples, best);
  if (all_starts) {
    for (const Vector4 &guess : guesses) {
      offer(by_ceres(samples, box, into_box(box, guess)));
    }
  } else if (shape.radial * array.pitch_mm * noise_Pa / largest < HOPELESS_SD_mm &&
             (independent > best_cost * (1.0 + 1e-6) + 1e-18 || shape.condition_number > 1e5)) {
    for (const Vector4 &end : ends) {
      if (cost_at(samples, end) < HOPELESS_COST * best_cost + 1e-18) {
        offer(by_ceres(samples, box, end));
      }
    }
  }
  best = polish(samples, box, best);
  shape = shape_at(samples, best);

  const double p0_Pa = best[0] * largest, sigma_mm = best[3] * array.pitch_mm;
  const double sd_mm = noise_Pa / largest * array.pitch_mm * shape.radial;
  const bool at_bound = box.touches(best);
  return {p0_Pa,
          best[1] * array.pitch_mm,
          best[2] * array.pitch_mm,
          sigma_mm,
          cost_at(samples, best) * largest * largest,
          2.0 * M_PI * p0_Pa * sigma_mm * sigma_mm * 1e-6,
          sd_mm,
          shape.condition_number,
          at_bound,
          sd_mm < 0.5 && shape.condition_number < 1e12 && !at_bound};
}

} // namespace fingertip::reference
