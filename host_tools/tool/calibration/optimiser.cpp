#include "tool/calibration/optimiser.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace fingertip::calibrating {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double COST_SETTLED = 1e-10; /* relative */

/* This number of extra values holds a spread to the assumed one. With 2 or 1 of them 13 or 37 % of the sessions
 * whose zeros move pass as good, with 4 none (truth.py --parts calibration --seed 20000 --pads 30). */
constexpr double SEEN_BEFORE = 4.0;
constexpr double CAPPED = 4.0; /* sds: one odd placement is weak evidence on the others */

static double largest_Pa(const Placement &placement) {
  double largest_Pa = 0.0;
  for (std::size_t k = 0; k < placement.reading_Pa.size(); k++) {
    largest_Pa = placement.usable >> k & 1u ? std::max(largest_Pa, placement.reading_Pa[k]) : largest_Pa;
  }
  return largest_Pa;
}

/* A reading's part of the normal matrix: of the global unknowns, of these and the placement's own, and of its own. */
static void accumulate(const Reading &r, double weight, MatrixXd &global, MatrixXd &cross, LocalSquare &local) {
  for (const auto &[a, by_a] : r.terms) {
    for (const auto &[b, by_b] : r.terms) {
      global(a, b) += weight * by_a * by_b;
    }
    cross.row(a) += weight * by_a * r.by_local.transpose();
  }
  local += weight * r.by_local * r.by_local.transpose();
}

double huber(double square) { return square <= HUBER * HUBER ? square : 2.0 * HUBER * std::sqrt(square) - HUBER * HUBER; }
double huber_weight(double square) { return square <= HUBER * HUBER ? 1.0 : HUBER / std::sqrt(square); }

Model::Model(const Array &array, const std::vector<Placement> &placements)
    : layout{static_cast<int>(array.sensors())}, array_(array), placements_(placements) {
  std::vector<double> peaks;
  for (const Placement &placement : placements) {
    peaks.push_back(largest_Pa(placement));
  }
  peak_Pa_ = std::max(median(peaks), 1.0);
  const std::size_t strong = 9 * peaks.size() / 10;
  std::nth_element(peaks.begin(), peaks.begin() + std::ptrdiff_t(strong), peaks.end());
  near_Pa_ = std::max(peaks[strong], 1.0);
}

void Model::assume(const Spread &spread, double excess) {
  assumed_.spread = spread;
  excess_ = excess;
}

Unknowns Model::first_guess() const {
  Unknowns first;
  first.global = VectorXd::Zero(layout.size());
  std::vector<double> peaks, widths;
  for (const Placement &placement : placements_) {
    const double largest = largest_Pa(placement);
    Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    double sum = 0.0, at_x = 0.0, at_y = 0.0;
    for (int k = 0; k < layout.sensors; k++) {
      const double p = placement.reading_Pa[std::size_t(k)] / std::max(largest, 1e-9);
      if (!(placement.usable >> k & 1u) || p < 0.02) {
        continue;
      }
      const double x = array_.x_mm[std::size_t(k)] / array_.pitch_mm;
      const double y = array_.y_mm[std::size_t(k)] / array_.pitch_mm;
      const Eigen::Vector4d row(1.0, x, y, x * x + y * y);
      normal += p * p * row * row.transpose();
      right += p * p * std::log(p) * row;
      sum += p * p;
      at_x += p * p * x;
      at_y += p * p * y;
    }
    /* A ridge towards a width of half a pitch, where few readings are large. */
    constexpr double RIDGE = 0.003, WIDTH = 0.5;
    normal(3, 3) += RIDGE;
    right[3] += RIDGE * -0.5 / (WIDTH * WIDTH);
    normal += 1e-9 * Eigen::Matrix4d::Identity();
    const Eigen::Vector4d paraboloid = normal.ldlt().solve(right);
    const double bend = std::min(paraboloid[3], -0.5 / 9.0);
    double x = -0.5 * paraboloid[1] / bend, y = -0.5 * paraboloid[2] / bend;
    if (sum > 0.0 && std::hypot(x - at_x / sum, y - at_y / sum) > 1.0) {
      x = at_x / sum;
      y = at_y / sum;
    }
    Local local = Local::Zero();
    local[0] = x * array_.pitch_mm;
    local[1] = y * array_.pitch_mm;
    first.locals.push_back(local);
    peaks.push_back(largest * std::exp(paraboloid[0] - bend * (x * x + y * y)));
    widths.push_back(array_.pitch_mm * std::sqrt(-0.5 / bend));
  }
  first.global[layout.log_peak()] = std::log(std::clamp(median(peaks), 0.5 * peak_Pa_, 3.0 * peak_Pa_));
  first.global[layout.log_width()] = std::log(median(widths));
  first.global[layout.mixing()] = assumed_.mixing;
  first.global[layout.dip_width()] = std::log(DIP_WIDTHS);
  return first;
}

Reading Model::reading(const VectorXd &g, const Local &l, int k, double earlier_Pa) const {
  const double u = array_.x_mm[std::size_t(k)] + g[layout.dx(k)] - l[0];
  const double v = array_.y_mm[std::size_t(k)] + g[layout.dy(k)] - l[1];
  const double q1 = l[4] + g[layout.ellipse(0)], q2 = l[5] + g[layout.ellipse(1)];
  const double square = std::max(u * u + v * v - 2.0 * q1 * (u * u - v * v) - 4.0 * q2 * u * v, 0.0);
  const double width = std::exp(g[layout.log_width()] + g[layout.own_width(k)] + l[3]);
  const double m = g[layout.mixing()];
  const double per = 0.5 / (width * width), narrow_per = per / (NARROW * NARROW);
  const double wide = std::exp(-per * square), narrow = std::exp(-narrow_per * square);
  const double full = std::exp(g[k] + g[layout.log_peak()] + l[2] - 2.0 * l[3]);
  const double dip_per = per * std::exp(-2.0 * g[layout.dip_width()]);
  const double h = g[layout.dip()];
  const double dip = std::exp(-dip_per * square);
  double pulled = 0.0, pulled_per = 0.0;
  for (const auto &[strength, ratio] : PULL) {
    const double term = full * strength * std::exp(-per / (ratio * ratio) * square);
    pulled += term / width;
    pulled_per += term / width * per / (ratio * ratio);
  }
  const double t1 = g[layout.pull(0)], t2 = g[layout.pull(1)], along = t1 * u + t2 * v;
  const double value = full * ((1.0 - m) * wide + m * narrow - h * dip) + along * pulled;
  const double by_square = -full * ((1.0 - m) * wide * per + m * narrow * narrow_per - h * dip * dip_per) - along * pulled_per;
  const double by_log_width = -2.0 * square * by_square - along * pulled;
  const double by_u = by_square * (2.0 * u - 4.0 * q1 * u - 4.0 * q2 * v) + t1 * pulled;
  const double by_v = by_square * (2.0 * v + 4.0 * q1 * v - 4.0 * q2 * u) + t2 * pulled;
  Reading r;
  r.model = value + g[layout.offset(k)] - g[layout.memory(k)] * earlier_Pa;
  const double by_q1 = -2.0 * by_square * (u * u - v * v), by_q2 = -4.0 * by_square * u * v;
  std::size_t terms = 0;
  const auto add = [&](int at, double by) { r.terms[terms++] = {at, by}; };
  add(k, value);
  add(layout.log_peak(), value);
  add(layout.log_width(), by_log_width);
  add(layout.mixing(), full * (narrow - wide));
  add(layout.dx(k), by_u);
  add(layout.dy(k), by_v);
  add(layout.offset(k), 1.0);
  add(layout.memory(k), -earlier_Pa);
  add(layout.ellipse(0), by_q1);
  add(layout.ellipse(1), by_q2);
  add(layout.dip(), -full * dip);
  add(layout.dip_width(), -2.0 * square * full * h * dip * dip_per);
  add(layout.own_width(k), by_log_width);
  add(layout.pull(0), u * pulled);
  add(layout.pull(1), v * pulled);
  r.by_local << -by_u, -by_v, value, by_log_width - 2.0 * value, by_q1, by_q2;
  return r;
}

double Model::residual(const Unknowns &unknowns, std::size_t i, int k) const {
  return placements_[i].reading_Pa[std::size_t(k)] - reading(unknowns.global, unknowns.locals[i], k, earlier_Pa(i, k)).model;
}

double Model::expected_sd(const Placement &placement, double reading_Pa) const {
  return std::sqrt(placement.noise_Pa * placement.noise_Pa +
                   excess_ * excess_ *
                       (assumed_.model_share * peak_Pa_ * assumed_.model_share * peak_Pa_ +
                        assumed_.reading_share * reading_Pa * assumed_.reading_share * reading_Pa));
}

std::pair<double, double> Model::prior(int at) const {
  const struct {
    int end;
    double mean, sd;
  } priors[] = {{layout.log_peak(), 0.0, assumed_.gain},
                {layout.log_width(), std::log(near_Pa_), assumed_.peak},
                {layout.mixing(), 0.0, 0.0},
                {layout.ellipse(0), assumed_.mixing, assumed_.mixing_sd},
                {layout.dip(), 0.0, assumed_.ellipse_of_all},
                {layout.dip_width(), 0.0, assumed_.dip},
                {layout.pull(0), std::log(DIP_WIDTHS), assumed_.dip_log_sd},
                {layout.dx(0), 0.0, assumed_.pull},
                {layout.offset(0), 0.0, assumed_.spread.position_mm},
                {layout.memory(0), 0.0, assumed_.offset_share * peak_Pa_},
                {layout.own_width(0), 0.0, assumed_.memory},
                {layout.size(), 0.0, assumed_.spread.own_width}};
  const auto &of = *std::find_if(std::begin(priors), std::end(priors), [at](const auto &each) { return at < each.end; });
  return {of.mean, of.sd};
}

Local Model::local_sd() const {
  Local sd;
  sd << 0.0, 0.0, assumed_.spread.force, assumed_.spread.width, assumed_.spread.ellipse, assumed_.spread.ellipse;
  return sd;
}

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
    const Reading r = model_.reading(at.global, local, k);
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
    for (int k = 0; k < model_.layout.sensors; k++) {
      if (!(placements_[i].usable >> k & 1u)) {
        continue;
      }
      const Reading r = model_.reading(at.global, at.locals[i], k, model_.earlier_Pa(i, k));
      const double per = 1.0 / model_.expected_sd(placements_[i], k);
      const double left = (placements_[i].reading_Pa[std::size_t(k)] - r.model) * per;
      const double weight = huber_weight(left * left) * per, slope = weight * left;
      for (const auto &[unknown, by] : r.terms) {
        gradient_[unknown] += slope * by;
      }
      accumulate(r, weight * per, normal_, cross_[i], local_normal_[i]);
      local_gradient_[i] += slope * r.by_local;
    }
    for (int j = 2; j < LOCAL; j++) {
      const double left = -at.locals[i][j] / sd[j];
      const double weight = huber_weight(left * left);
      local_normal_[i](j, j) += weight / (sd[j] * sd[j]);
      local_gradient_[i][j] += weight * left / sd[j];
    }
  }
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

double learn_spreads(Model &model, const Optimiser &optimiser, const MatrixXd &covariance) {
  constexpr Assumptions given;
  const Layout &layout = model.layout;
  const auto &[global, locals] = optimiser.at;
  const std::vector<Placement> &placements = model.placements();
  const int n = layout.sensors;
  double position = 0.0, own_width = 0.0, known = 3.0;
  for (int at = 0; at < layout.size(); at++) {
    const auto [mean, sd] = model.prior(at);
    if (sd > 0.0) {
      known += std::max(1.0 - covariance(at, at) / (sd * sd), 0.0);
    }
    if (at >= layout.dx(0) && at < layout.offset(0)) {
      position += global[at] * global[at] + covariance(at, at);
    } else if (at >= layout.own_width(0)) {
      own_width += global[at] * global[at] + covariance(at, at);
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
  learn(learnt.position_mm, given.spread.position_mm, position, 2.0 * n);
  learn(learnt.own_width, given.spread.own_width, own_width, double(n));
  learn(learnt.force, given.spread.force, squares[2], count);
  learn(learnt.width, given.spread.width, squares[3], count);
  learn(learnt.ellipse, given.spread.ellipse, squares[4] + squares[5], 2.0 * count);
  learn(excess, 1.0, misfit * excess * excess, std::max(readings - known, 1.0));
  model.assume(learnt, excess);
  return change;
}

} // namespace fingertip::calibrating
