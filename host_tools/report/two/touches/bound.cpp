#include "two/touches/bound.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace fingertip::two {
namespace {

constexpr double FORCE_LEAST_N = 0.05;

template <int N> using Slopes = Eigen::Matrix<double, truth::SENSORS, N>;

double x_mm(const fit_array &array, std::size_t k) {
  return double(array.pitch_mm) * double(array.x[k]);
}
double y_mm(const fit_array &array, std::size_t k) {
  return double(array.pitch_mm) * double(array.y[k]);
}

void add_ball(const Rubber &rubber, double x, double y, double force_N, Column &Pa) {
  for (std::size_t k = 0; k < truth::SENSORS; k++) {
    Pa[Eigen::Index(k)] += rubber.object.pressure.base_pressure_Pa(
        std::max(force_N, FORCE_LEAST_N), x_mm(rubber.array, k) - x, y_mm(rubber.array, k) - y, rubber.dip_share);
  }
}

template <int N> Slopes<N> slopes_of(const Rubber &rubber, const Unknowns<N> &at) {
  constexpr double STEP = 1e-3; // mm and N
  Slopes<N> slopes;
  for (int i = 0; i < N; i++) {
    const Unknowns<N> step = STEP * Unknowns<N>::Unit(i);
    slopes.col(i) =
        (rubber.readings_Pa(Unknowns<N>(at + step)) - rubber.readings_Pa(Unknowns<N>(at - step))) / (2.0 * STEP);
  }
  return slopes;
}

void keep_within(Unknowns<PAIR> &) {}

void keep_within(Unknowns<LINE> &line) {
  const auto shorten = [&](int first, double most) {
    const double size = line.segment<2>(first).norm();
    line.segment<2>(first) *= size > most ? most / size : 1.0;
  };
  shorten(3, 0.5 * LINE_LONGEST_mm);
  shorten(5, LINE_LOAD_MOST * std::max(line[2], FORCE_LEAST_N));
}

double normal_below(double z) {
  return 0.5 * std::erfc(-z / std::sqrt(2.0));
}

double normal_quantile(double share) {
  double low = -8.0, high = 8.0;
  for (int i = 0; i < 50; i++) {
    const double middle = 0.5 * (low + high);
    (normal_below(middle) < share ? low : high) = middle;
  }
  return low;
}

// Share of estimates with this covariance that are right.
double share_right(const Unknowns<PAIR> &truth, const Eigen::Matrix<double, PAIR, PAIR> &covariance, const Right &right,
                   Random &random) {
  constexpr int DRAWS = 400;
  const Eigen::Matrix<double, PAIR, PAIR> root = covariance.llt().matrixL();
  int found = 0;
  for (int n = 0; n < DRAWS; n++) {
    Unknowns<PAIR> z;
    for (double &value : z) {
      value = random.normal();
    }
    found += is_right(right, truth, truth + root * z);
  }
  return double(found) / DRAWS;
}

} // namespace

Column Rubber::readings_Pa(const Unknowns<PAIR> &pair) const {
  Column Pa = Column::Zero();
  add_ball(*this, pair[0], pair[1], pair[2], Pa);
  add_ball(*this, pair[3], pair[4], pair[5], Pa);
  return Pa;
}

Column Rubber::readings_Pa(const Unknowns<LINE> &line) const {
  // Nodes and weights of Gauss's quadrature.
  constexpr double AT[] = {-0.906180, -0.538469, 0.0, 0.538469, 0.906180};
  constexpr double SHARE[] = {0.118463, 0.239314, 0.284444, 0.239314, 0.118463};
  Column Pa = Column::Zero();
  for (int i = 0; i < 5; i++) {
    add_ball(*this, line[0] + AT[i] * line[3], line[1] + AT[i] * line[4], SHARE[i] * line[2], Pa);
  }
  for (std::size_t k = 0; k < truth::SENSORS; k++) {
    const double dx = x_mm(array, k) - line[0], dy = y_mm(array, k) - line[1];
    for (const auto &term : profile.tangential) {
      const double v = std::pow(double(term.sd_mm), 2);
      Pa[Eigen::Index(k)] += 1e6 * (line[5] * dx + line[6] * dy) * double(term.moment_mm) / (2.0 * M_PI * v * v) *
                             std::exp(-0.5 * (dx * dx + dy * dy) / v);
    }
  }
  return Pa;
}

Column per_sd(const Column &readings_Pa, const ReadingErrors &errors) {
  const double of_model = errors.model_share * readings_Pa.maxCoeff();
  Column weights;
  for (Eigen::Index k = 0; k < weights.size(); k++) {
    weights[k] = 1.0 / std::hypot(errors.noise_Pa, errors.gain_sd[std::size_t(k)] * readings_Pa[k], of_model);
  }
  return weights;
}

bool is_right(const Right &right, const Unknowns<PAIR> &truth, const Unknowns<PAIR> &found) {
  const Unknowns<PAIR> off = found - truth;
  return off.head<2>().norm() <= right.near_mm && off.segment<2>(3).norm() <= right.near_mm &&
         std::abs(off[2] + off[5]) <= right.force_share * (truth[2] + truth[5]);
}

template <int N>
Fitted<N> fitted(const Rubber &rubber, const Column &readings_Pa, const Column &per_sd, const Unknowns<N> &start) {
  const auto off = [&](const Unknowns<N> &u) {
    return Column(per_sd.cwiseProduct(readings_Pa - rubber.readings_Pa(u)));
  };
  Fitted<N> best{start, off(start).squaredNorm()};
  constexpr double SETTLED = 1e-4; // of a sum of squares, of which 1 is a standard deviation
  double damping = 1e-3;
  for (int step = 0; step < 25; step++) {
    const Slopes<N> J = per_sd.asDiagonal() * slopes_of<N>(rubber, best.at);
    Eigen::Matrix<double, N, N> normal = J.transpose() * J;
    normal.diagonal() *= 1.0 + damping;
    Unknowns<N> next = best.at + normal.ldlt().solve(J.transpose() * off(best.at));
    keep_within(next);
    const double left = off(next).squaredNorm();
    damping *= left < best.left ? 0.3 : 5.0;
    const double less = best.left - left;
    if (less > 0.0) {
      best = {next, left};
    }
    if (less >= 0.0 && less < SETTLED) {
      break;
    }
  }
  return best;
}
template Fitted<PAIR> fitted(const Rubber &, const Column &, const Column &, const Unknowns<PAIR> &);
template Fitted<LINE> fitted(const Rubber &, const Column &, const Column &, const Unknowns<LINE> &);

Unknowns<LINE> line_like(const Unknowns<PAIR> &pair) {
  const double force_N = pair[2] + pair[5], share = pair[2] / force_N;
  const Eigen::Vector2d apart = pair.segment<2>(3) - pair.head<2>();
  const Eigen::Vector2d middle = pair.head<2>() + (1.0 - share) * apart;
  const Eigen::Vector2d half = std::sqrt(3.0 * share * (1.0 - share)) * apart;
  Unknowns<LINE> line;
  line << middle, force_N, half, 0.0, 0.0;
  keep_within(line);
  return line;
}

PairBound bound_of(const Rubber &rubber, const Unknowns<PAIR> &pair, const ReadingErrors &errors, const Right &right,
                   Random &random) {
  const Column readings = rubber.readings_Pa(pair), weights = per_sd(readings, errors);
  const Slopes<PAIR> J = weights.asDiagonal() * slopes_of<PAIR>(rubber, pair);
  const Eigen::Matrix<double, PAIR, PAIR> covariance =
      (J.transpose() * J).ldlt().solve(Eigen::Matrix<double, PAIR, PAIR>::Identity());
  const Unknowns<LINE> line = fitted<LINE>(rubber, readings, weights, line_like(pair)).at;
  const double distance = weights.cwiseProduct(readings - rubber.readings_Pa(line)).norm();
  return {share_right(pair, covariance, right, random), normal_below(distance - normal_quantile(1.0 - right.false_two)),
          line};
}

} // namespace fingertip::two
