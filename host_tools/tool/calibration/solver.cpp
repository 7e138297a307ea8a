#include "tool/calibration/solver.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace fingertip::calibrating {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/* Of rubber letting go; see remember. */
constexpr double SLOW_s = 10.0, FAST_s = 1.0, FAST_SHARE = 20.0;

constexpr int LOCAL = 6;  /* x, y, e, w, q1, q2 */
constexpr int COMMON = 5; /* log A, log s, m, q1, q2 of all */
using Local = Eigen::Matrix<double, LOCAL, 1>;
using LocalSquare = Eigen::Matrix<double, LOCAL, LOCAL>;

constexpr int ITERATIONS_MAX = 60;
constexpr double COST_SETTLED = 1e-10; /* relative */
/* A placement whose residuals are beyond these many times what is expected, and as many times the
 * median placement's, was no such placement: another object, a hand, a weight that tipped. */
constexpr double DROP_MISFIT = 3.0;
constexpr int DROP_ROUNDS = 4;
/* Of learning the spreads. */
constexpr int LEARN_ROUNDS = 12;
constexpr double LEARNT = 0.02; /* relative change */
/* With fewer the gains of good sessions are better known, by 15 % with 1, and sooner thought so;
 * but then 13 (with 2) and 37 % (with 1) of the sessions whose zeros move pass as good, with 4 none
 * (truth_calibration --seed 20000 --pads 30). Where sensors sit where they should and rubber does
 * not relax, the spreads cannot be seen to be nothing, so the sds are twice too large. */
constexpr double SEEN_BEFORE = 4.0;
constexpr double CAPPED = 4.0; /* sds: one odd placement says little of the others */

/* Where a global unknown lies in the vector: log gains, common, dx, dy, o, d, r. */
struct Layout {
  int sensors;
  int log_peak() const { return sensors; }
  int log_width() const { return sensors + 1; }
  int mixing() const { return sensors + 2; }
  int dx(int k) const { return sensors + COMMON + k; }
  int dy(int k) const { return 2 * sensors + COMMON + k; }
  int offset(int k) const { return 3 * sensors + COMMON + k; }
  int drift(int k) const { return 4 * sensors + COMMON + k; }
  int memory(int k) const { return 5 * sensors + COMMON + k; }
  int ellipse(int which) const { return sensors + 3 + which; }
  int size() const { return 6 * sensors + COMMON; }
};
constexpr int TOUCHED = 11; /* global unknowns that a reading depends on */

struct Reading {
  double model;
  int at[TOUCHED];
  double by[TOUCHED]; /* derivative by the global unknown `at` */
  Local by_local;
};

double huber(double square) { /* of the residual; twice the cost */
  return square <= HUBER * HUBER ? square : 2.0 * HUBER * std::sqrt(square) - HUBER * HUBER;
}
double huber_weight(double square) {
  return square <= HUBER * HUBER ? 1.0 : HUBER / std::sqrt(square);
}

class Problem {
public:
  Problem(const Array &array, const std::vector<Placement> &placements,
          const Assumptions &assumptions)
      : layout{static_cast<int>(array.sensors())}, array_(array), placements_(placements),
        assumed_(assumptions), given_(assumptions) {
    double first_s = std::numeric_limits<double>::infinity(), last_s = -first_s;
    std::vector<double> peaks;
    for (const Placement &placement : placements) {
      first_s = std::min(first_s, placement.t_s);
      last_s = std::max(last_s, placement.t_s);
      double peak = 0.0;
      for (int k = 0; k < layout.sensors; k++) {
        if (placement.usable >> k & 1u) {
          peak = std::max(peak, placement.reading_Pa[std::size_t(k)]);
        }
      }
      peaks.push_back(peak);
    }
    std::nth_element(peaks.begin(), peaks.begin() + std::ptrdiff_t(peaks.size() / 2), peaks.end());
    peak_Pa_ = std::max(peaks[peaks.size() / 2], 1.0);
    middle_s_ = 0.5 * (first_s + last_s);
    half_s_ = std::max(0.5 * (last_s - first_s), 1e-9);
    kept.assign(placements.size(), true);
    start();
  }

  /* Levenberg-Marquardt until the cost settles, or for so many steps. */
  void descend(int steps = ITERATIONS_MAX) {
    double damping = steps > 1 ? 1e-3 : 1e-6;
    double now = cost(global, locals);
    for (int iteration = 0; iteration < steps; iteration++) {
      assemble();
      bool lower = false;
      double before = now;
      while (!lower && damping < 1e12) {
        VectorXd global_trial = global;
        std::vector<Local> local_trial = locals;
        step(damping, global_trial, local_trial);
        const double trial = cost(global_trial, local_trial);
        if (trial <= now) {
          lower = true;
          global = global_trial;
          locals = local_trial;
          now = trial;
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

  /* As solve() left it. */
  void resume(const Solution &solution) {
    const double log_mean = [&] {
      double sum = 0.0;
      for (double gain : solution.gain) {
        sum += std::log(gain);
      }
      return sum / layout.sensors;
    }();
    for (int k = 0; k < layout.sensors; k++) {
      const auto at = std::size_t(k);
      global[k] = std::log(solution.gain[at]) - log_mean;
      global[layout.dx(k)] = solution.dx_mm[at];
      global[layout.dy(k)] = solution.dy_mm[at];
      global[layout.offset(k)] = solution.offset_Pa[at];
      global[layout.drift(k)] = 0.5 * solution.drift_Pa[at];
      global[layout.memory(k)] = solution.memory[at];
    }
    global[layout.log_peak()] = std::log(solution.peak_Pa) + log_mean;
    global[layout.log_width()] = std::log(solution.width_mm);
    global[layout.mixing()] = solution.mixing;
    global[layout.ellipse(0)] = solution.ellipse_of_all[0];
    global[layout.ellipse(1)] = solution.ellipse_of_all[1];
    for (std::size_t i = 0; i < placements_.size(); i++) {
      const Fitted &fitted = solution.placements[i];
      kept[i] = fitted.kept;
      locals[i] << fitted.x_mm, fitted.y_mm, fitted.force, fitted.width, fitted.ellipse[0],
          fitted.ellipse[1];
    }
    assumed_.position_mm = solution.spread.position_mm;
    assumed_.force = solution.spread.force;
    assumed_.width = solution.spread.width;
    assumed_.ellipse = solution.spread.ellipse;
    assumed_.memory = solution.spread.memory;
    excess_ = solution.excess;
  }

  /* On the global unknowns at the present point, priors included. */
  MatrixXd information() {
    assemble();
    return reduced(0.0, nullptr);
  }

  /* Likewise, of one placement more. */
  MatrixXd information_at(double x_mm, double y_mm) const {
    Local local = Local::Zero();
    local[0] = x_mm;
    local[1] = y_mm;
    const Placement quiet{};
    const auto n = static_cast<Eigen::Index>(layout.size());
    MatrixXd own = MatrixXd::Zero(n, n), cross = MatrixXd::Zero(n, LOCAL);
    LocalSquare square = LocalSquare::Zero();
    const Local sd = local_sd();
    for (int j = 2; j < LOCAL; j++) {
      square(j, j) += 1.0 / (sd[j] * sd[j]);
    }
    for (int k = 0; k < layout.sensors; k++) {
      const Reading r = reading(global, local, k, 1.0, 0.0);
      const double expected = expected_sd(quiet, r.model);
      const double weight = 1.0 / (expected * expected);
      for (int a = 0; a < TOUCHED; a++) {
        for (int b = 0; b < TOUCHED; b++) {
          own(r.at[a], r.at[b]) += weight * r.by[a] * r.by[b];
        }
        cross.row(r.at[a]) += weight * r.by[a] * r.by_local.transpose();
      }
      square += weight * r.by_local * r.by_local.transpose();
    }
    return own - cross * square.inverse() * cross.transpose();
  }

  /* Of the global unknowns at the solution. */
  MatrixXd covariance() {
    const auto n = static_cast<Eigen::Index>(layout.size());
    return information().ldlt().solve(MatrixXd::Identity(n, n));
  }

  /* The spreads that the session shows, by expectation and maximisation, each held to what was
   * assumed as if by SEEN_BEFORE more values of it. Returns the largest relative change. */
  double learn_spreads(const MatrixXd &covariance) {
    const int n = layout.sensors;
    double position = 0.0, memory = 0.0, known = 3.0;
    for (int at = 0; at < layout.size(); at++) {
      const auto [mean, sd] = prior(at);
      if (sd > 0.0) {
        known += std::max(1.0 - covariance(at, at) / (sd * sd), 0.0);
      }
      if (at >= layout.dx(0) && at < layout.offset(0)) {
        position += global[at] * global[at] + covariance(at, at);
      } else if (at >= layout.memory(0)) {
        memory += global[at] * global[at] + covariance(at, at);
      }
    }
    Local squares = Local::Zero();
    const Local sd = local_sd();
    double count = 0.0, readings = 0.0, misfit = 0.0;
    for (std::size_t i = 0; i < placements_.size(); i++) {
      if (!kept[i]) {
        continue;
      }
      const LocalSquare inverse = damped(i, 0.0).inverse();
      const MatrixXd through = inverse * cross_[i].transpose();
      const LocalSquare own = inverse + through * covariance * through.transpose();
      known += 2.0;
      count += 1.0;
      for (int j = 2; j < LOCAL; j++) {
        squares[j] +=
            std::min(locals[i][j] * locals[i][j], CAPPED * CAPPED * sd[j] * sd[j]) + own(j, j);
        known += std::max(1.0 - own(j, j) / (sd[j] * sd[j]), 0.0);
      }
      const double t = tau(placements_[i]);
      for (int k = 0; k < n; k++) {
        if (placements_[i].usable >> k & 1u) {
          const double left = (placements_[i].reading_Pa[std::size_t(k)] -
                               reading(global, locals[i], k, t, earlier(i, k)).model) /
                              expected_sd(placements_[i], k);
          misfit += huber(left * left);
          readings += 1.0;
        }
      }
    }
    double change = 0.0;
    const auto learn = [&](double &spread, double given, double sum, double values) {
      const double now = std::sqrt((sum + SEEN_BEFORE * given * given) / (values + SEEN_BEFORE));
      change = std::max(change, std::abs(now / spread - 1.0));
      spread = now;
    };
    learn(assumed_.position_mm, given_.position_mm, position, 2.0 * n);
    learn(assumed_.memory, given_.memory, memory, double(n));
    learn(assumed_.force, given_.force, squares[2], count);
    learn(assumed_.width, given_.width, squares[3], count);
    learn(assumed_.ellipse, given_.ellipse, squares[4] + squares[5], 2.0 * count);
    learn(excess_, 1.0, misfit * excess_ * excess_, std::max(readings - known, 1.0));
    return change;
  }
  double excess() const { return excess_; }
  Spread spread() const {
    return {assumed_.position_mm, assumed_.force, assumed_.width, assumed_.ellipse,
            assumed_.memory};
  }

  Reading reading(const VectorXd &g, const Local &l, int k, double tau, double earlier_Pa) const {
    const double u = array_.x_mm[std::size_t(k)] + g[layout.dx(k)] - l[0];
    const double v = array_.y_mm[std::size_t(k)] + g[layout.dy(k)] - l[1];
    const double q1 = l[4] + g[layout.ellipse(0)], q2 = l[5] + g[layout.ellipse(1)];
    const double square =
        std::max(u * u + v * v - 2.0 * q1 * (u * u - v * v) - 4.0 * q2 * u * v, 0.0);
    const double width = std::exp(g[layout.log_width()] + l[3]), m = g[layout.mixing()];
    const double per = 0.5 / (width * width), narrow_per = per / (NARROW * NARROW);
    const double wide = std::exp(-per * square), narrow = std::exp(-narrow_per * square);
    const double strength = std::exp(g[k] + g[layout.log_peak()] + l[2] - 2.0 * l[3]);
    const double value = strength * ((1.0 - m) * wide + m * narrow);
    const double by_square = -strength * ((1.0 - m) * wide * per + m * narrow * narrow_per);
    const double by_log_width = -2.0 * square * by_square;
    const double by_u = by_square * (2.0 * u - 4.0 * q1 * u - 4.0 * q2 * v);
    const double by_v = by_square * (2.0 * v + 4.0 * q1 * v - 4.0 * q2 * u);
    Reading r;
    r.model =
        value + g[layout.offset(k)] + g[layout.drift(k)] * tau - g[layout.memory(k)] * earlier_Pa;
    const double by_q1 = -2.0 * by_square * (u * u - v * v), by_q2 = -4.0 * by_square * u * v;
    const int at[TOUCHED] = {k,
                             layout.log_peak(),
                             layout.log_width(),
                             layout.mixing(),
                             layout.dx(k),
                             layout.dy(k),
                             layout.offset(k),
                             layout.drift(k),
                             layout.memory(k),
                             layout.ellipse(0),
                             layout.ellipse(1)};
    const double by[TOUCHED] = {value,       value, by_log_width, strength * (narrow - wide),
                                by_u,        by_v,  1.0,          tau,
                                -earlier_Pa, by_q1, by_q2};
    std::copy(at, at + TOUCHED, r.at);
    std::copy(by, by + TOUCHED, r.by);
    r.by_local << -by_u, -by_v, value, by_log_width - 2.0 * value, by_q1, by_q2;
    return r;
  }

  double earlier(std::size_t i, int k) const {
    const double now_Pa = std::max(placements_[i].reading_Pa[std::size_t(k)], 0.0);
    return placements_[i].earlier_Pa[std::size_t(k)] * now_Pa /
           (now_Pa + REMEMBERS_FROM * peak_Pa_);
  }
  double tau(const Placement &placement) const { return (placement.t_s - middle_s_) / half_s_; }
  double expected_sd(const Placement &placement, double reading_Pa) const {
    return std::sqrt(
        placement.noise_Pa * placement.noise_Pa +
        excess_ * excess_ *
            (assumed_.model_share * peak_Pa_ * assumed_.model_share * peak_Pa_ +
             assumed_.reading_share * reading_Pa * assumed_.reading_share * reading_Pa));
  }
  double expected_sd(const Placement &placement, int k) const {
    return expected_sd(placement, placement.reading_Pa[std::size_t(k)]);
  }
  double peak_Pa() const { return peak_Pa_; }
  double cost() const { return cost_; }

  /* sd and mean of the prior of a global unknown; none: sd 0 */
  std::pair<double, double> prior(int at) const {
    const int n = layout.sensors;
    if (at < n) {
      return {0.0, assumed_.gain};
    }
    if (at == layout.mixing()) {
      return {assumed_.mixing, assumed_.mixing_sd};
    }
    if (at < layout.dx(0)) {
      return {0.0, at < layout.ellipse(0) ? 0.0 : assumed_.ellipse_of_all};
    }
    if (at < layout.offset(0)) {
      return {0.0, assumed_.position_mm};
    }
    return {0.0, at < layout.memory(0) ? assumed_.offset_share * peak_Pa_ : assumed_.memory};
  }
  Local local_sd() const {
    Local sd;
    sd << 0.0, 0.0, assumed_.force, assumed_.width, assumed_.ellipse, assumed_.ellipse;
    return sd;
  }

  Layout layout;
  VectorXd global;
  std::vector<Local> locals;
  std::vector<bool> kept;

private:
  /* Each placement where the readings' logarithms have their peak, in pitches. */
  void start() {
    global = VectorXd::Zero(layout.size());
    std::vector<double> peaks, widths;
    for (const Placement &placement : placements_) {
      double largest = 0.0;
      for (int k = 0; k < layout.sensors; k++) {
        if (placement.usable >> k & 1u) {
          largest = std::max(largest, placement.reading_Pa[std::size_t(k)]);
        }
      }
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
      locals.push_back(local);
      peaks.push_back(largest * std::exp(paraboloid[0] - bend * (x * x + y * y)));
      widths.push_back(array_.pitch_mm * std::sqrt(-0.5 / bend));
    }
    const auto median = [](std::vector<double> values) {
      std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(values.size() / 2),
                       values.end());
      return values[values.size() / 2];
    };
    global[layout.log_peak()] = std::log(std::clamp(median(peaks), 0.5 * peak_Pa_, 3.0 * peak_Pa_));
    global[layout.log_width()] = std::log(median(widths));
    global[layout.mixing()] = assumed_.mixing;
  }

  double cost(const VectorXd &g, const std::vector<Local> &l) const {
    double sum = 0.0;
    for (int i = 0; i < layout.size(); i++) {
      const auto [mean, sd] = prior(i);
      if (sd > 0.0) {
        sum += (g[i] - mean) * (g[i] - mean) / (sd * sd);
      }
    }
    const Local sd = local_sd();
    for (std::size_t i = 0; i < placements_.size(); i++) {
      const double t = tau(placements_[i]);
      for (int k = 0; kept[i] && k < layout.sensors; k++) {
        if (placements_[i].usable >> k & 1u) {
          const double r = (placements_[i].reading_Pa[std::size_t(k)] -
                            reading(g, l[i], k, t, earlier(i, k)).model) /
                           expected_sd(placements_[i], k);
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

  /* Normal matrix and gradient at the present point. */
  void assemble() {
    const int n = layout.size();
    normal_ = MatrixXd::Zero(n, n);
    gradient_ = VectorXd::Zero(n);
    local_normal_.assign(placements_.size(), LocalSquare::Identity());
    local_gradient_.assign(placements_.size(), Local::Zero());
    cross_.assign(placements_.size(), MatrixXd::Zero(n, LOCAL));
    for (int i = 0; i < n; i++) {
      const auto [mean, sd] = prior(i);
      if (sd > 0.0) {
        normal_(i, i) += 1.0 / (sd * sd);
        gradient_[i] += (mean - global[i]) / (sd * sd);
      }
    }
    const Local sd = local_sd();
    for (std::size_t i = 0; i < placements_.size(); i++) {
      if (!kept[i]) {
        continue;
      }
      local_normal_[i].setZero();
      const double t = tau(placements_[i]);
      for (int k = 0; k < layout.sensors; k++) {
        if (!(placements_[i].usable >> k & 1u)) {
          continue;
        }
        const Reading r = reading(global, locals[i], k, t, earlier(i, k));
        const double per = 1.0 / expected_sd(placements_[i], k);
        const double left = (placements_[i].reading_Pa[std::size_t(k)] - r.model) * per;
        const double weight = huber_weight(left * left) * per;
        add(i, r, weight * per, weight * left);
      }
      for (int j = 2; j < LOCAL; j++) {
        const double left = -locals[i][j] / sd[j];
        const double weight = huber_weight(left * left);
        local_normal_[i](j, j) += weight / (sd[j] * sd[j]);
        local_gradient_[i][j] += weight * left / sd[j];
      }
    }
  }

  void add(std::size_t i, const Reading &r, double square, double slope) {
    for (int a = 0; a < TOUCHED; a++) {
      gradient_[r.at[a]] += slope * r.by[a];
      for (int b = 0; b < TOUCHED; b++) {
        normal_(r.at[a], r.at[b]) += square * r.by[a] * r.by[b];
      }
      cross_[i].row(r.at[a]) += square * r.by[a] * r.by_local.transpose();
    }
    local_normal_[i] += square * r.by_local * r.by_local.transpose();
    local_gradient_[i] += slope * r.by_local;
  }

  LocalSquare damped(std::size_t i, double damping) const {
    LocalSquare square = local_normal_[i];
    square.diagonal() *= 1.0 + damping;
    square.diagonal().array() += 1e-12;
    return square;
  }

  MatrixXd reduced(double damping, VectorXd *right) const {
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

  void step(double damping, VectorXd &g, std::vector<Local> &l) const {
    VectorXd right;
    const MatrixXd matrix = reduced(damping, &right);
    const VectorXd by = matrix.ldlt().solve(right);
    g += by;
    g[layout.mixing()] = std::clamp(g[layout.mixing()], -0.3, 0.9);
    for (std::size_t i = 0; i < placements_.size(); i++) {
      if (kept[i]) {
        l[i] += damped(i, damping).inverse() * (local_gradient_[i] - cross_[i].transpose() * by);
      }
    }
  }

  const Array &array_;
  const std::vector<Placement> &placements_; /* with earlier_Pa */
  Assumptions assumed_;                      /* prior spreads as they are estimated */
  const Assumptions given_;
  double excess_ = 1.0; /* of the model's own error over what is assumed */
  double peak_Pa_ = 0.0, middle_s_ = 0.0, half_s_ = 0.0, cost_ = 0.0;

  MatrixXd normal_;
  VectorXd gradient_;
  std::vector<LocalSquare> local_normal_;
  std::vector<Local> local_gradient_;
  std::vector<MatrixXd> cross_; /* [placement] global by local */
};

/* Orthonormal columns that span the gauge. */
MatrixXd gauge(const Array &array) {
  const auto n = static_cast<Eigen::Index>(array.sensors());
  MatrixXd columns(n, 4);
  for (Eigen::Index k = 0; k < n; k++) {
    const double x = array.x_mm[std::size_t(k)] / array.pitch_mm;
    const double y = array.y_mm[std::size_t(k)] / array.pitch_mm;
    columns.row(k) << 1.0, x, y, x * x + y * y;
  }
  Eigen::ColPivHouseholderQR<MatrixXd> qr(columns);
  return MatrixXd(qr.householderQ()).leftCols(qr.rank());
}

/* Of the log gains less their mean, given that of all global unknowns. */
MatrixXd gain_covariance(const MatrixXd &covariance, Eigen::Index n) {
  const MatrixXd centre = MatrixXd::Identity(n, n) - MatrixXd::Constant(n, n, 1.0 / double(n));
  return centre * covariance.topLeftCorner(n, n) * centre;
}

} // namespace

std::vector<double> outside_gauge(const Array &array, const std::vector<double> &gain) {
  VectorXd logs(static_cast<Eigen::Index>(gain.size()));
  for (std::size_t k = 0; k < gain.size(); k++) {
    logs[Eigen::Index(k)] = std::log(gain[k]);
  }
  const MatrixXd basis = gauge(array);
  logs -= basis * (basis.transpose() * logs);
  return {logs.data(), logs.data() + logs.size()};
}

double Solution::worst_shape_sd() const {
  return shape_sd.empty() ? std::numeric_limits<double>::infinity()
                          : *std::max_element(shape_sd.begin(), shape_sd.end());
}

void remember(std::vector<Placement> &placements) {
  for (std::size_t i = 0; i < placements.size(); i++) {
    if (!placements[i].earlier_Pa.empty()) {
      continue;
    }
    placements[i].earlier_Pa.assign(placements[i].reading_Pa.size(), 0.0);
    for (std::size_t j = 0; j < i; j++) {
      const double age_s = placements[i].t_s - placements[j].t_s;
      const double left = std::exp(-age_s / SLOW_s) + FAST_SHARE * std::exp(-age_s / FAST_s);
      for (std::size_t k = 0; k < placements[i].reading_Pa.size(); k++) {
        placements[i].earlier_Pa[k] +=
            placements[j].usable >> k & 1u ? left * placements[j].reading_Pa[k] : 0.0;
      }
    }
  }
}

namespace {

Solution solve_any(const Array &array, const std::vector<Placement> &given,
                   const Assumptions &assumptions, bool keep_all, const Solution *from) {
  for (const Placement &placement : given) {
    if (placement.reading_Pa.size() != array.sensors()) {
      throw std::invalid_argument("a placement has as many readings as the array has sensors");
    }
  }
  std::vector<Placement> placements = given;
  remember(placements);
  Solution solution;
  solution.placements.resize(placements.size());
  if (placements.size() < PLACEMENTS_MIN) {
    return solution;
  }
  Problem problem(array, placements, assumptions);
  const Layout &layout = problem.layout;
  const auto n = static_cast<Eigen::Index>(layout.sensors);
  double peak_Pa = 0.0, squares = 0.0, readings = 0.0;
  std::vector<double> misfits;
  const auto look = [&] {
    peak_Pa = std::exp(problem.global[layout.log_peak()]);
    squares = readings = 0.0;
    misfits.clear();
    const Local sd = problem.local_sd();
    for (std::size_t i = 0; i < placements.size(); i++) {
      const Local &local = problem.locals[i];
      double left_squares = 0.0, misfit = 0.0, count = 0.0;
      for (int k = 0; k < layout.sensors; k++) {
        if (placements[i].usable >> k & 1u) {
          const double left = placements[i].reading_Pa[std::size_t(k)] -
                              problem
                                  .reading(problem.global, local, k, problem.tau(placements[i]),
                                           problem.earlier(i, k))
                                  .model;
          const double expected = problem.expected_sd(placements[i], k);
          left_squares += left * left;
          misfit += left * left / (expected * expected);
          count += 1.0;
        }
      }
      for (int j = 2; j < LOCAL; j++) {
        misfit += local[j] * local[j] / (sd[j] * sd[j]);
      }
      solution.placements[i] = {problem.kept[i],
                                local[0],
                                local[1],
                                local[2],
                                local[3],
                                {local[4], local[5]},
                                std::sqrt(left_squares / std::max(count, 1.0)) / peak_Pa,
                                std::sqrt(misfit / std::max(count, 1.0))};
      if (problem.kept[i]) {
        squares += left_squares;
        readings += count;
        misfits.push_back(solution.placements[i].misfit);
      }
    }
  };
  if (from) {
    problem.resume(*from);
  }
  problem.descend();
  look();
  for (int round = 0; !keep_all && !from && round < DROP_ROUNDS && misfits.size() > PLACEMENTS_MIN;
       round++) {
    const auto middle = misfits.begin() + std::ptrdiff_t(misfits.size() / 2);
    std::nth_element(misfits.begin(), middle, misfits.end());
    const double limit = DROP_MISFIT * std::max(*middle, 1.0);
    bool dropped = false;
    for (std::size_t i = 0; i < placements.size(); i++) {
      if (problem.kept[i] && solution.placements[i].misfit > limit) {
        problem.kept[i] = false;
        dropped = true;
      }
    }
    if (!dropped) {
      break;
    }
    problem.descend();
    look();
  }
  MatrixXd covariance = problem.covariance();
  for (int round = 0; !from && round < LEARN_ROUNDS && problem.learn_spreads(covariance) > LEARNT;
       round++) {
    problem.descend(1);
    covariance = problem.covariance();
  }
  problem.descend();
  covariance = problem.covariance();
  look();
  solution.kept = std::size_t(std::count(problem.kept.begin(), problem.kept.end(), true));
  const double unknowns = 2.0 * double(solution.kept) + double(n) + COMMON;
  solution.excess = problem.excess();
  solution.spread = problem.spread();
  solution.residual_share = std::sqrt(squares / std::max(readings - unknowns, 1.0)) / peak_Pa;
  solution.cost = problem.cost();
  const MatrixXd of_gains = gain_covariance(covariance, n);
  const MatrixXd basis = gauge(array);
  const MatrixXd within = basis * basis.transpose();
  const MatrixXd outside = MatrixXd::Identity(n, n) - within;
  const MatrixXd of_shape = outside * of_gains * outside;
  solution.gauge_sd = std::sqrt(std::max((within * of_gains * within).trace(), 0.0) / double(n));
  double mean = 0.0;
  for (Eigen::Index k = 0; k < n; k++) {
    mean += std::exp(problem.global[k]) / double(n);
  }
  for (int k = 0; k < layout.sensors; k++) {
    solution.gain.push_back(std::exp(problem.global[k]) / mean);
    solution.gain_sd.push_back(std::sqrt(std::max(of_gains(k, k), 0.0)));
    solution.shape_sd.push_back(std::sqrt(std::max(of_shape(k, k), 0.0)));
    solution.offset_Pa.push_back(problem.global[layout.offset(k)]);
    solution.drift_Pa.push_back(2.0 * problem.global[layout.drift(k)]);
    solution.offset_sd_Pa.push_back(std::sqrt(covariance(layout.offset(k), layout.offset(k))));
    solution.drift_sd_Pa.push_back(2.0 * std::sqrt(covariance(layout.drift(k), layout.drift(k))));
    solution.dx_mm.push_back(problem.global[layout.dx(k)]);
    solution.dy_mm.push_back(problem.global[layout.dy(k)]);
    solution.memory.push_back(problem.global[layout.memory(k)]);
  }
  solution.peak_Pa = peak_Pa * mean;
  solution.width_mm = std::exp(problem.global[layout.log_width()]);
  solution.mixing = problem.global[layout.mixing()];
  solution.ellipse_of_all[0] = problem.global[layout.ellipse(0)];
  solution.ellipse_of_all[1] = problem.global[layout.ellipse(1)];
  solution.solved = std::isfinite(solution.cost) && of_gains.allFinite();
  return solution;
}

} // namespace

Solution solve(const Array &array, const std::vector<Placement> &placements,
               const Assumptions &assumptions, bool keep_all) {
  return solve_any(array, placements, assumptions, keep_all, nullptr);
}

Solution solve_from(const Array &array, const std::vector<Placement> &placements,
                    const Solution &from, const Assumptions &assumptions) {
  return solve_any(array, placements, assumptions, true, &from);
}

Wanted next_place(const Array &array, const std::vector<Placement> &given, const Solution &solution,
                  const Assumptions &assumptions) {
  std::vector<Placement> placements = given;
  remember(placements);
  std::vector<double> x_mm, y_mm;
  const double step = 0.5 * array.pitch_mm;
  const auto [left, right] = std::minmax_element(array.x_mm.begin(), array.x_mm.end());
  const auto [bottom, top] = std::minmax_element(array.y_mm.begin(), array.y_mm.end());
  for (double x = *left; x <= *right + 1e-6; x += step) {
    for (double y = *bottom; y <= *top + 1e-6; y += step) {
      x_mm.push_back(x);
      y_mm.push_back(y);
    }
  }
  std::size_t best = 0;
  if (!solution.solved) {
    /* The place farthest from those that there are; the first in the middle of the pad. */
    double farthest = -1.0;
    for (std::size_t c = 0; c < x_mm.size(); c++) {
      double nearest = placements.empty() ? -std::hypot(x_mm[c], y_mm[c]) + 1e3 : 1e3;
      for (const Placement &placement : placements) {
        const auto strongest = static_cast<std::size_t>(
            std::max_element(placement.reading_Pa.begin(), placement.reading_Pa.end()) -
            placement.reading_Pa.begin());
        nearest = std::min(
            nearest, std::hypot(x_mm[c] - array.x_mm[strongest], y_mm[c] - array.y_mm[strongest]));
      }
      if (nearest > farthest) {
        farthest = nearest;
        best = c;
      }
    }
    return {x_mm[best], y_mm[best], std::numeric_limits<double>::infinity()};
  }
  Problem problem(array, placements, assumptions);
  problem.resume(solution);
  const MatrixXd information = problem.information();
  const MatrixXd basis = gauge(array);
  const auto n = static_cast<Eigen::Index>(array.sensors());
  const MatrixXd outside = MatrixXd::Identity(n, n) - basis * basis.transpose();
  double lowest = std::numeric_limits<double>::infinity();
  for (std::size_t c = 0; c < x_mm.size(); c++) {
    const MatrixXd with = information + problem.information_at(x_mm[c], y_mm[c]);
    const MatrixXd covariance =
        with.ldlt().solve(MatrixXd::Identity(with.rows(), with.rows()).leftCols(n));
    const MatrixXd of_shape = outside * gain_covariance(covariance, n) * outside;
    const double worst = std::sqrt(of_shape.diagonal().maxCoeff());
    if (worst < lowest) {
      lowest = worst;
      best = c;
    }
  }
  return {x_mm[best], y_mm[best], lowest};
}

} // namespace fingertip::calibrating
