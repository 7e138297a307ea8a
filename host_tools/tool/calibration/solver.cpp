#include "tool/calibration/solver.hpp"

#include "libfingertip/error.hpp"
#include "tool/calibration/optimiser.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

namespace fingertip::calibrating {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/* A placement whose residuals are beyond these many times what is expected, and as many times the
 * median placement's, was no such placement: another object, a hand, a weight that tipped. */
constexpr double DROP_MISFIT = 3.0;
constexpr int DROP_ROUNDS = 4;
/* Iterations of learning the spreads. */
constexpr int LEARN_ROUNDS = 12;
constexpr double LEARNT = 0.02; /* relative change */

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

/* A sum of Gaussians about the contact; a term of infinite width is an offset. */
struct GaussianMixture {
  std::vector<std::pair<double, double>> terms; /* height, width */
};

/* The mean product over the sensors: seen from contacts on the array they lie about as a Gaussian of the width reach does. */
double overlap(const GaussianMixture &a, const GaussianMixture &b, double reach) {
  double sum = 0.0;
  for (const auto &[height, width] : a.terms) {
    for (const auto &[other_height, other_width] : b.terms) {
      sum += height * other_height / (1.0 / (width * width) + 1.0 / (other_width * other_width) + 1.0 / (reach * reach));
    }
  }
  return sum;
}

/* What is found, as the firmware has it: the Gaussian nearest to the response, and a dip. A dip is
 * what the response has less than a layer's own profile: that, the offset that all sensors share
 * and a wide dip look alike, so the response is taken as they make it together. */
struct EquivalentGaussian {
  double width = 1.0; /* of the Gaussian, over that of the wide part, as all widths here */
  double dip = 0.0;   /* of its amplitude */
};
EquivalentGaussian equivalent_gaussian(const GaussianMixture &response, double dip_width, double reach) {
  const GaussianMixture dip{{{1.0, dip_width}}};
  const double of_dip = overlap(dip, dip, reach), with_dip = overlap(response, dip, reach);
  double most = 0.0, depth = 0.0;
  constexpr double STEP = 0.002, WIDEST = 1.3;
  for (double width = NARROW; width <= WIDEST; width += STEP) {
    const GaussianMixture layer{{{1.0 - LAYER_MIXING, width}, {LAYER_MIXING, NARROW * width}}};
    const double own = overlap(layer, layer, reach), cross = overlap(layer, dip, reach);
    const double with = overlap(response, layer, reach);
    const double determinant = own * of_dip - cross * cross;
    const double peak = (of_dip * with - cross * with_dip) / determinant;
    const double less = (cross * with - own * with_dip) / determinant;
    const double explained = peak * with - less * with_dip;
    if (explained > most) {
      most = explained;
      depth = std::max(less, 0.0);
    }
  }
  GaussianMixture core = response;
  core.terms.emplace_back(depth, dip_width);
  EquivalentGaussian best;
  most = 0.0;
  for (double width = NARROW; width <= WIDEST; width += STEP) {
    const GaussianMixture gaussian{{{1.0, width}}};
    const double own = overlap(gaussian, gaussian, reach), with = overlap(core, gaussian, reach);
    if (with * with > most * own) {
      most = with * with / own;
      best = {width, depth * own / with};
    }
  }
  return best;
}

/* Rms distance of a sensor from a contact along an axis, if contacts lie as the sensors do. */
double reach_mm(const Array &array) {
  double squares = 0.0;
  for (const std::vector<double> *axis : {&array.x_mm, &array.y_mm}) {
    const double mean = std::accumulate(axis->begin(), axis->end(), 0.0) / double(axis->size());
    for (const double place_mm : *axis) {
      squares += (place_mm - mean) * (place_mm - mean) / double(axis->size());
    }
  }
  return std::sqrt(squares); /* half of it by axis, twice for both */
}

/* The covariance of the log gains less their mean, given that of all global unknowns. */
MatrixXd gain_covariance(const MatrixXd &covariance, Eigen::Index n) {
  const MatrixXd centre = MatrixXd::Identity(n, n) - MatrixXd::Constant(n, n, 1.0 / double(n));
  return centre * covariance.topLeftCorner(n, n) * centre;
}

/* Restores the state that solve() left. */
void resume(const Solution &solution, Model &model, Optimiser &optimiser) {
  const Layout &layout = model.layout;
  auto &[global, locals] = optimiser.at;
  const auto add_log = [](double sum, double gain) { return sum + std::log(gain); };
  const double log_mean = std::accumulate(solution.gain.begin(), solution.gain.end(), 0.0, add_log) / layout.sensors;
  for (int k = 0; k < layout.sensors; k++) {
    const auto at = std::size_t(k);
    global[k] = std::log(solution.gain[at]) - log_mean;
    global[layout.dx(k)] = solution.dx_mm[at];
    global[layout.dy(k)] = solution.dy_mm[at];
    global[layout.offset(k)] = solution.offset_Pa[at];
    global[layout.memory(k)] = solution.memory[at];
    global[layout.own_width(k)] = solution.own_width[at];
  }
  global[layout.log_peak()] = std::log(solution.peak_Pa) + log_mean;
  global[layout.log_width()] = std::log(solution.width_mm);
  global[layout.mixing()] = solution.mixing;
  global[layout.ellipse(0)] = solution.ellipse_of_all[0];
  global[layout.ellipse(1)] = solution.ellipse_of_all[1];
  global[layout.dip()] = solution.dip;
  global[layout.pull(0)] = solution.pull[0];
  global[layout.pull(1)] = solution.pull[1];
  global[layout.dip_width()] = std::log(solution.dip_widths);
  for (std::size_t i = 0; i < model.placements().size(); i++) {
    const Fitted &fitted = solution.placements[i];
    optimiser.kept[i] = fitted.kept;
    locals[i] << fitted.x_mm, fitted.y_mm, fitted.force, fitted.width, fitted.ellipse[0], fitted.ellipse[1];
  }
  model.assume(solution.spread, solution.excess);
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
  return shape_sd.empty() ? std::numeric_limits<double>::infinity() : *std::max_element(shape_sd.begin(), shape_sd.end());
}

void set_earlier(std::vector<Placement> &placements) {
  const double fading = std::exp(-RESTED_BEFORE_s / RELEASED_s);
  std::vector<double> most_Pa;
  double at_s = placements.empty() ? 0.0 : placements[0].t_s;
  for (Placement &placement : placements) {
    const double until_rest = std::exp(std::min(at_s + RESTED_BEFORE_s - placement.t_s, 0.0) / RELEASED_s);
    most_Pa.resize(placement.reading_Pa.size(), 0.0);
    placement.earlier_Pa = most_Pa;
    for (std::size_t k = 0; k < most_Pa.size(); k++) {
      const double reading_Pa = std::max(placement.reading_Pa[k], 0.0);
      placement.earlier_Pa[k] *= until_rest;
      most_Pa[k] = std::max(fading * placement.earlier_Pa[k], reading_Pa);
      placement.earlier_Pa[k] -= most_Pa[k] - reading_Pa;
    }
    at_s = placement.t_s;
  }
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

namespace {

Solution solve_any(const Array &array, const std::vector<Placement> &placements, bool keep_all, const Solution *from) {
  for (const Placement &placement : placements) {
    if (placement.reading_Pa.size() != array.sensors()) {
      throw std::invalid_argument("a placement has as many readings as the array has sensors");
    }
  }
  Solution solution;
  solution.placements.resize(placements.size());
  if (placements.size() < PLACEMENTS_MIN) {
    return solution;
  }
  Model model(array, placements);
  Optimiser optimiser(model);
  const VectorXd &global = optimiser.at.global;
  const std::vector<Local> &locals = optimiser.at.locals;
  const Layout &layout = model.layout;
  const auto n = static_cast<Eigen::Index>(layout.sensors);
  double peak_Pa = 0.0, squares = 0.0, readings = 0.0;
  std::vector<double> misfits, of_sensor, counts;
  const auto look = [&] {
    peak_Pa = std::exp(global[layout.log_peak()]);
    squares = readings = 0.0;
    misfits.clear();
    of_sensor.assign(array.sensors(), 0.0);
    counts = of_sensor;
    const Local sd = model.local_sd();
    for (std::size_t i = 0; i < placements.size(); i++) {
      const Local &local = locals[i];
      double left_squares = 0.0, misfit = 0.0, count = 0.0;
      for (int k = 0; k < layout.sensors; k++) {
        if (placements[i].usable >> k & 1u) {
          const double left = model.residual(optimiser.at, i, k);
          const double expected = model.expected_sd(placements[i], k);
          left_squares += left * left;
          of_sensor[std::size_t(k)] += optimiser.kept[i] ? left * left : 0.0;
          counts[std::size_t(k)] += optimiser.kept[i];
          misfit += left * left / (expected * expected);
          count += 1.0;
        }
      }
      for (int j = 2; j < LOCAL; j++) {
        misfit += local[j] * local[j] / (sd[j] * sd[j]);
      }
      const double all = std::max(count, 1.0), rms_share = std::sqrt(left_squares / all) / peak_Pa;
      solution.placements[i] = {optimiser.kept[i],      local[0], local[1], local[2], local[3], {local[4], local[5]}, rms_share,
                                std::sqrt(misfit / all)};
      if (optimiser.kept[i]) {
        squares += left_squares;
        readings += count;
        misfits.push_back(solution.placements[i].misfit);
      }
    }
  };
  if (from) {
    resume(*from, model, optimiser);
  }
  optimiser.descend();
  look();
  for (int round = 0; !keep_all && !from && round < DROP_ROUNDS && misfits.size() > PLACEMENTS_MIN; round++) {
    const double limit = DROP_MISFIT * std::max(median(misfits), 1.0);
    bool dropped = false;
    for (std::size_t i = 0; i < placements.size(); i++) {
      if (optimiser.kept[i] && solution.placements[i].misfit > limit) {
        optimiser.kept[i] = false;
        dropped = true;
      }
    }
    if (!dropped) {
      break;
    }
    optimiser.descend();
    look();
  }
  MatrixXd covariance = optimiser.covariance();
  for (int round = 0; !from && round < LEARN_ROUNDS && learn_spreads(model, optimiser, covariance) > LEARNT; round++) {
    optimiser.descend(1);
    covariance = optimiser.covariance();
  }
  optimiser.descend();
  covariance = optimiser.covariance();
  look();
  solution.kept = std::size_t(std::count(optimiser.kept.begin(), optimiser.kept.end(), true));
  const double unknowns = 2.0 * double(solution.kept) + double(n) + COMMON;
  solution.excess = model.excess();
  solution.spread = model.spread();
  solution.residual_share = std::sqrt(squares / std::max(readings - unknowns, 1.0)) / peak_Pa;
  solution.cost = optimiser.cost();
  const MatrixXd of_gains = gain_covariance(covariance, n);
  const MatrixXd basis = gauge(array);
  const MatrixXd within = basis * basis.transpose();
  const MatrixXd outside = MatrixXd::Identity(n, n) - within;
  const MatrixXd of_shape = outside * of_gains * outside;
  solution.gauge_sd = std::sqrt(std::max((within * of_gains * within).trace(), 0.0) / double(n));
  double mean = 0.0;
  for (Eigen::Index k = 0; k < n; k++) {
    mean += std::exp(global[k]) / double(n);
  }
  for (int k = 0; k < layout.sensors; k++) {
    solution.gain.push_back(std::exp(global[k]) / mean);
    solution.gain_sd.push_back(std::sqrt(std::max(of_gains(k, k), 0.0)));
    const int width = layout.own_width(k);
    const double reading = of_gains(k, k) + 2.0 * OWN_WIDTH_SQUARE * covariance(k, width) +
                           OWN_WIDTH_SQUARE * OWN_WIDTH_SQUARE * covariance(width, width) +
                           OWN_WIDTH_SQUARE * 0.5 * (covariance(layout.dx(k), layout.dx(k)) + covariance(layout.dy(k), layout.dy(k))) *
                               std::exp(-2.0 * global[layout.log_width()]);
    solution.reading_sd.push_back(std::sqrt(std::max(reading, of_gains(k, k))));
    solution.shape_sd.push_back(std::sqrt(std::max(of_shape(k, k), 0.0)));
    solution.offset_Pa.push_back(global[layout.offset(k)]);
    solution.offset_sd_Pa.push_back(std::sqrt(covariance(layout.offset(k), layout.offset(k))));
    solution.dx_mm.push_back(global[layout.dx(k)]);
    solution.dy_mm.push_back(global[layout.dy(k)]);
    solution.memory.push_back(global[layout.memory(k)]);
    solution.misfit_share.push_back(std::sqrt(of_sensor[std::size_t(k)] / std::max(counts[std::size_t(k)], 1.0)) / peak_Pa);
    solution.own_width.push_back(global[layout.own_width(k)]);
  }
  solution.peak_Pa = peak_Pa * mean;
  solution.width_mm = std::exp(global[layout.log_width()]);
  solution.mixing = global[layout.mixing()];
  for (int which : {0, 1}) {
    solution.pull[which] = global[layout.pull(which)];
    const int at = layout.ellipse(which);
    solution.ellipse_of_all[which] = global[at];
    solution.ellipse_of_all_sd[which] = std::sqrt(std::max(covariance(at, at), 0.0));
  }
  solution.dip = global[layout.dip()];
  solution.dip_sd = std::sqrt(std::max(covariance(layout.dip(), layout.dip()), 0.0));
  solution.dip_widths = std::exp(global[layout.dip_width()]);
  const double offset = global.segment(layout.offset(0), layout.sensors).mean() / peak_Pa;
  const auto near = [&](double mixing) {
    return equivalent_gaussian(
        {{{1.0 - mixing, 1.0}, {mixing, NARROW}, {-solution.dip, solution.dip_widths}, {offset, std::numeric_limits<double>::infinity()}}},
        solution.dip_widths, reach_mm(array) / solution.width_mm);
  };
  const auto [width, dip_share] = near(solution.mixing);
  solution.sigma_mm = solution.width_mm * width;
  solution.dip_share = dip_share;
  solution.dip_sd_mm = solution.dip_widths * solution.width_mm;
  /* Derivatives by the width and the mixing, which counteract each other. */
  constexpr double STEP = 0.05;
  const double by_mixing = (near(solution.mixing + STEP).width - near(solution.mixing - STEP).width) / (2.0 * STEP * width);
  const int at_width = layout.log_width(), at_mixing = layout.mixing();
  const double variance = covariance(at_width, at_width) + 2.0 * by_mixing * covariance(at_width, at_mixing) +
                          by_mixing * by_mixing * covariance(at_mixing, at_mixing);
  solution.sigma_sd_mm = solution.sigma_mm * std::sqrt(std::max(variance, 0.0));
  solution.solved = std::isfinite(solution.cost) && of_gains.allFinite();
  return solution;
}

} // namespace

void check_places(const Array &array) {
  constexpr double PITCH_MOST_mm = 1000.0, PITCHES_MOST = 128.0; /* of a sensor from the pad's middle: places between them are tried */
  for (std::size_t k = 0; k < array.sensors(); k++) {
    const bool has_pitch = array.pitch_mm > 0.0 && array.pitch_mm <= PITCH_MOST_mm;
    if (!has_pitch || !(std::hypot(array.x_mm[k], array.y_mm[k]) <= PITCHES_MOST * array.pitch_mm)) {
      throw Error("the sensors' places, x_mm, y_mm and pitch_mm, are none of a pad; describe it again, and build its firmware of that");
    }
  }
}

Solution solve(const Array &array, const std::vector<Placement> &placements, bool keep_all) {
  return solve_any(array, placements, keep_all, nullptr);
}

Solution solve_from(const Array &array, const std::vector<Placement> &placements, const Solution &from) {
  return solve_any(array, placements, true, &from);
}

Wanted next_place(const Array &array, const std::vector<Placement> &placements, const Solution &solution) {
  std::vector<double> x_mm, y_mm;
  const double step = 0.5 * array.pitch_mm;
  const auto [left, right] = std::minmax_element(array.x_mm.begin(), array.x_mm.end());
  const auto [bottom, top] = std::minmax_element(array.y_mm.begin(), array.y_mm.end());
  const double inset = INSET_PITCHES * array.pitch_mm;
  const double in_x = std::min(inset, 0.25 * (*right - *left));
  const double in_y = std::min(inset, 0.25 * (*top - *bottom));
  for (double x = *left + in_x; x <= *right - in_x + 1e-6; x += step) {
    for (double y = *bottom + in_y; y <= *top - in_y + 1e-6; y += step) {
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
        const auto strongest = static_cast<std::size_t>(std::max_element(placement.reading_Pa.begin(), placement.reading_Pa.end()) -
                                                        placement.reading_Pa.begin());
        nearest = std::min(nearest, std::hypot(x_mm[c] - array.x_mm[strongest], y_mm[c] - array.y_mm[strongest]));
      }
      if (nearest > farthest) {
        farthest = nearest;
        best = c;
      }
    }
    return {x_mm[best], y_mm[best], std::numeric_limits<double>::infinity()};
  }
  Model model(array, placements);
  Optimiser optimiser(model);
  resume(solution, model, optimiser);
  const MatrixXd information = optimiser.information();
  const MatrixXd basis = gauge(array);
  const auto n = static_cast<Eigen::Index>(array.sensors());
  const MatrixXd outside = MatrixXd::Identity(n, n) - basis * basis.transpose();
  double lowest = std::numeric_limits<double>::infinity();
  for (std::size_t c = 0; c < x_mm.size(); c++) {
    const MatrixXd with = information + optimiser.information_at(x_mm[c], y_mm[c]);
    const MatrixXd covariance = with.ldlt().solve(MatrixXd::Identity(with.rows(), with.rows()).leftCols(n));
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
