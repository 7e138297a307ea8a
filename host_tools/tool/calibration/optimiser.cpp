#include "tool/calibration/optimiser.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace fingertip::calibrating {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double COST_SETTLED = 1e-10; /* relative */

/* This number of extra values holds a spread to the assumed one. With 2 or 1 of them 13 or 37 % of the sessions
 * whose zeros move pass as good, with 4 none (truth.py --parts calibration --seed 20000 --pads 30). */
constexpr double SEEN_BEFORE = 4.0;
constexpr double CAPPED = 4.0; /* sds: one odd placement is weak evidence on the others */

/* A reading's part of the normal matrix: of the global unknowns, of these and the placement's own, and of its own. */
void accumulate(const Reading &r, double weight, MatrixXd &global, MatrixXd &cross, LocalSquare &local) {
  for (const auto &[a, by_a] : r.terms) {
    for (const auto &[b, by_b] : r.terms) {
      global(a, b) += weight * by_a * by_b;
    }
    cross.row(a) += weight * by_a * r.by_local.transpose();
  }
  local += weight * r.by_local * r.by_local.transpose();
}

} // namespace

Optimiser::Optimiser(const Model &model)
    : at(model.first_guess()), kept(model.placements().size(), true), model_(model), placements_(model.placements()) {}

void Optimiser::descend(int steps) {
  double damping = steps > 1 ? 1e-3 : 1e-6;
  double now = cost(at);
  for (int iteration = 0; iteration < steps; iteration++) {
    assemble();
    bool lower = false;
    double before = now;
    while (!lower && damping < 1e12) {
      Unknowns trial = at;
      step(damping, trial);
      const double then = cost(trial);
      if (then <= now) {
        lower = true;
        at = std::move(trial);
        now = then;
        damping = std::max(damping * 0.1, 1e-12);
      } else {
        damping *= 10.0;
      }
    }
    if (!lower || before - now <= COST_SETTLED * before) {
      break;
    }
  }
  cost_ = now;
}

MatrixXd Optimiser::information() {
  assemble();
  return reduced(0.0, nullptr);
}

MatrixXd Optimiser::information_at(double x_mm, double y_mm) const {
  Local local = Local::Zero();
  local[0] = x_mm;
  local[1] = y_mm;
  const Placement quiet{};
  const auto n = static_cast<Eigen::Index>(model_.layout.size());
  MatrixXd own = MatrixXd::Zero(n, n), cross = MatrixXd::Zero(n, LOCAL);
  LocalSquare square = LocalSquare::Zero();
  const Local sd = model_.local_sd();
  for (int j = 2; j < LOCAL; j++) {
    square(j, j) += 1.0 / (sd[j] * sd[j]);
  }
  for (int k = 0; k < model_.layout.sensors; k++) {
    const Reading r = model_.reading(at.global, local, k, 1.0, 0.0);
    const double expected = model_.expected_sd(quiet, r.model);
    accumulate(r, 1.0 / (expected * expected), own, cross, square);
  }
  return own - cross * square.inverse() * cross.transpose();
}

MatrixXd Optimiser::covariance() {
  const auto n = static_cast<Eigen::Index>(model_.layout.size());
  return information().ldlt().solve(MatrixXd::Identity(n, n));
}

LocalSquare Optimiser::local_covariance(std::size_t i, const MatrixXd &covariance) const {
  const LocalSquare inverse = damped(i, 0.0).inverse();
  const MatrixXd through = inverse * cross_[i].transpose();
  return inverse + through * covariance * through.transpose();
}

double Optimiser::cost(const Unknowns &unknowns) const {
  const auto &[g, l] = unknowns;
  double sum = 0.0;
  for (int i = 0; i < model_.layout.size(); i++) {
    const auto [mean, sd] = model_.prior(i);
    if (sd > 0.0) {
      sum += (g[i] - mean) * (g[i] - mean) / (sd * sd);
    }
  }
  const Local sd = model_.local_sd();
  for (std::size_t i = 0; i < placements_.size(); i++) {
    for (int k = 0; kept[i] && k < model_.layout.sensors; k++) {
      if (placements_[i].usable >> k & 1u) {
        const double r = model_.residual(unknowns, i, k) / model_.expected_sd(placements_[i], k);
        sum += huber(r * r);
      }
    }
    for (int j = 2; kept[i] && j < LOCAL; j++) {
      const double r = l[i][j] / sd[j];
      sum += huber(r * r);
    }
  }
  return std::isfinite(sum) ? 0.5 * sum : std::numeric_limits<double>::infinity();
}

void Optimiser::assemble() {
  const int n = model_.layout.size();
  normal_ = MatrixXd::Zero(n, n);
  gradient_ = VectorXd::Zero(n);
  local_normal_.assign(placements_.size(), LocalSquare::Identity());
  local_gradient_.assign(placements_.size(), Local::Zero());
  cross_.assign(placements_.size(), MatrixXd::Zero(n, LOCAL));
  for (int i = 0; i < n; i++) {
    const auto [mean, sd] = model_.prior(i);
    if (sd > 0.0) {
      normal_(i, i) += 1.0 / (sd * sd);
      gradient_[i] += (mean - at.global[i]) / (sd * sd);
    }
  }
  const Local sd = model_.local_sd();
  for (std::size_t i = 0; i < placements_.size(); i++) {
    if (!kept[i]) {
      continue;
    }
    local_normal_[i].setZero();
    const double t = model_.tau(placements_[i]);
    for (int k = 0; k < model_.layout.sensors; k++) {
      if (!(placements_[i].usable >> k & 1u)) {
        continue;
      }
      const Reading r = model_.reading(at.global, at.locals[i], k, t, placements_[i].earlier_Pa[std::size_t(k)]);
      const double per = 1.0 / model_.expected_sd(placements_[i], k);
      const double left = (placements_[i].reading_Pa[std::size_t(k)] - r.model) * per;
      const double weight = huber_weight(left * left) * per;
      add(i, r, weight * per, weight * left);
    }
    for (int j = 2; j < LOCAL; j++) {
      const double left = -at.locals[i][j] / sd[j];
      const double weight = huber_weight(left * left);
      local_normal_[i](j, j) += weight / (sd[j] * sd[j]);
      local_gradient_[i][j] += weight * left / sd[j];
    }
  }
}

void Optimiser::add(std::size_t i, const Reading &r, double square, double slope) {
  for (const auto &[unknown, by] : r.terms) {
    gradient_[unknown] += slope * by;
  }
  accumulate(r, square, normal_, cross_[i], local_normal_[i]);
  local_gradient_[i] += slope * r.by_local;
}

LocalSquare Optimiser::damped(std::size_t i, double damping) const {
  LocalSquare square = local_normal_[i];
  square.diagonal() *= 1.0 + damping;
  square.diagonal().array() += 1e-12;
  return square;
}

MatrixXd Optimiser::reduced(double damping, VectorXd *right) const {
  MatrixXd matrix = normal_;
  matrix.diagonal() *= 1.0 + damping;
  if (right) {
    *right = gradient_;
  }
  /* Half of it: the matrix is symmetric. */
  for (std::size_t i = 0; i < placements_.size(); i++) {
    if (kept[i]) {
      const LocalSquare inverse = damped(i, damping).inverse();
      const MatrixXd root = cross_[i] * inverse.llt().matrixL();
      matrix.selfadjointView<Eigen::Lower>().rankUpdate(root, -1.0);
      if (right) {
        *right -= cross_[i] * (inverse * local_gradient_[i]);
      }
    }
  }
  matrix.triangularView<Eigen::StrictlyUpper>() = matrix.transpose();
  return matrix;
}

void Optimiser::step(double damping, Unknowns &unknowns) const {
  auto &[g, l] = unknowns;
  VectorXd right;
  const MatrixXd matrix = reduced(damping, &right);
  const VectorXd by = matrix.ldlt().solve(right);
  g += by;
  g[model_.layout.mixing()] = std::clamp(g[model_.layout.mixing()], -0.3, 0.9);
  for (std::size_t i = 0; i < placements_.size(); i++) {
    if (kept[i]) {
      l[i] += damped(i, damping).inverse() * (local_gradient_[i] - cross_[i].transpose() * by);
    }
  }
}

double learn_spreads(Model &model, const Optimiser &optimiser, const Assumptions &given,
                     const Eigen::MatrixXd &covariance) {
  const Layout &layout = model.layout;
  const auto &[global, locals] = optimiser.at;
  const std::vector<Placement> &placements = model.placements();
  const int n = layout.sensors;
  double position = 0.0, memory = 0.0, own_width = 0.0, known = 3.0;
  for (int at = 0; at < layout.size(); at++) {
    const auto [mean, sd] = model.prior(at);
    if (sd > 0.0) {
      known += std::max(1.0 - covariance(at, at) / (sd * sd), 0.0);
    }
    if (at >= layout.dx(0) && at < layout.offset(0)) {
      position += global[at] * global[at] + covariance(at, at);
    } else if (at >= layout.own_width(0)) {
      own_width += global[at] * global[at] + covariance(at, at);
    } else if (at >= layout.memory(0)) {
      memory += global[at] * global[at] + covariance(at, at);
    }
  }
  Local squares = Local::Zero();
  const Local sd = model.local_sd();
  double count = 0.0, readings = 0.0, misfit = 0.0;
  for (std::size_t i = 0; i < placements.size(); i++) {
    if (!optimiser.kept[i]) {
      continue;
    }
    const LocalSquare own = optimiser.local_covariance(i, covariance);
    known += 2.0;
    count += 1.0;
    for (int j = 2; j < LOCAL; j++) {
      squares[j] += std::min(locals[i][j] * locals[i][j], CAPPED * CAPPED * sd[j] * sd[j]) + own(j, j);
      known += std::max(1.0 - own(j, j) / (sd[j] * sd[j]), 0.0);
    }
    for (int k = 0; k < n; k++) {
      if (placements[i].usable >> k & 1u) {
        const double left = model.residual(optimiser.at, i, k) / model.expected_sd(placements[i], k);
        misfit += huber(left * left);
        readings += 1.0;
      }
    }
  }
  double change = 0.0;
  Spread learnt = model.spread();
  double excess = model.excess();
  const auto learn = [&](double &spread, double assumed, double sum, double values) {
    const double now = std::sqrt((sum + SEEN_BEFORE * assumed * assumed) / (values + SEEN_BEFORE));
    change = std::max(change, std::abs(now / spread - 1.0));
    spread = now;
  };
  learn(learnt.position_mm, given.position_mm, position, 2.0 * n);
  learn(learnt.memory, given.memory, memory, double(n));
  learn(learnt.own_width, given.own_width, own_width, double(n));
  learn(learnt.force, given.force, squares[2], count);
  learn(learnt.width, given.width, squares[3], count);
  learn(learnt.ellipse, given.ellipse, squares[4] + squares[5], 2.0 * count);
  learn(excess, 1.0, misfit * excess * excess, std::max(readings - known, 1.0));
  model.assume(learnt, excess);
  return change;
}

} // namespace fingertip::calibrating
