/* The model of solver.hpp: what a sensor reads in a placement, by the unknowns, with what is known
 * of them before and of the readings' errors. And Levenberg-Marquardt on its unknowns.
 *
 * Global unknowns are of all placements, local ones of each, which the optimiser eliminates. */
#pragma once

#include "tool/calibration/solver.hpp"

#include <Eigen/Dense>
#include <array>
#include <utility>
#include <vector>

namespace fingertip::calibrating {

constexpr int LOCAL = 6;  /* x, y, e, w, q1, q2 */
constexpr int COMMON = 9; /* log A, log s, m, q1, q2 of all, h, log B / s, t1, t2 */
using Local = Eigen::Matrix<double, LOCAL, 1>;
using LocalSquare = Eigen::Matrix<double, LOCAL, LOCAL>;

/* Where a global unknown lies in the vector: log gains, common, dx, dy, o, r, b. */
struct Layout {
  int sensors;
  int log_peak() const { return sensors; }
  int log_width() const { return sensors + 1; }
  int mixing() const { return sensors + 2; }
  int dx(int k) const { return sensors + COMMON + k; }
  int dy(int k) const { return 2 * sensors + COMMON + k; }
  int offset(int k) const { return 3 * sensors + COMMON + k; }
  int memory(int k) const { return 4 * sensors + COMMON + k; }
  int own_width(int k) const { return 5 * sensors + COMMON + k; }
  int ellipse(int which) const { return sensors + 3 + which; }
  int dip() const { return sensors + 5; }
  int dip_width() const { return sensors + 6; }
  int pull(int which) const { return sensors + 7 + which; }
  int size() const { return 6 * sensors + COMMON; }
};
constexpr int TOUCHED = 15; /* global unknowns that a reading depends on */

struct Unknowns {
  Eigen::VectorXd global;
  std::vector<Local> locals; /* [placement] */
};

struct Reading {
  double model;
  struct Term {
    int at;
    double by; /* derivative by the global unknown `at` */
  };
  std::array<Term, TOUCHED> terms;
  Local by_local;
};

double huber(double square); /* of the residual; twice the cost */
double huber_weight(double square);

class Model {
public:
  /* Placements and array outlive the model. */
  Model(const Array &array, const std::vector<Placement> &placements);

  /* Each placement where the readings' logarithms have their peak, in pitches. */
  Unknowns first_guess() const;
  Reading reading(const Eigen::VectorXd &g, const Local &l, int k, double earlier_Pa = 0.0) const;
  /* A reading less that of the model, Pa. */
  double residual(const Unknowns &unknowns, std::size_t i, int k) const;
  double expected_sd(const Placement &placement, double reading_Pa) const;
  double expected_sd(const Placement &placement, int k) const { return expected_sd(placement, placement.reading_Pa[std::size_t(k)]); }
  double earlier_Pa(std::size_t i, int k) const {
    const std::vector<double> &earlier_Pa = placements_[i].earlier_Pa;
    return earlier_Pa.empty() ? 0.0 : earlier_Pa[std::size_t(k)];
  }
  /* sd and mean of the prior of a global unknown; none: sd 0 */
  std::pair<double, double> prior(int at) const;
  Local local_sd() const;

  const std::vector<Placement> &placements() const { return placements_; }
  double excess() const { return excess_; }
  Spread spread() const { return assumed_.spread; }
  /* From now on, instead of what was assumed. */
  void assume(const Spread &spread, double excess);

  const Layout layout;

private:
  const Array &array_;
  const std::vector<Placement> &placements_;
  Assumptions assumed_; /* prior spreads as they are estimated */
  double excess_ = 1.0; /* of the model's own error over what is assumed */
  double peak_Pa_ = 0.0, near_Pa_ = 0.0;
};

class Optimiser {
public:
  /* The model outlives it, and may assume other spreads between two calls. */
  explicit Optimiser(const Model &model);

  static constexpr int ITERATIONS_MAX = 60;
  /* Until the cost settles, for at most this number of steps. */
  void descend(int steps = ITERATIONS_MAX);
  double cost() const { return cost_; }

  /* On the global unknowns at the present point, priors included. */
  Eigen::MatrixXd information();
  /* The same of one more placement. */
  Eigen::MatrixXd information_at(double x_mm, double y_mm) const;
  /* The covariance of the global unknowns at the solution. */
  Eigen::MatrixXd covariance();
  /* The covariance of a placement's own unknowns, given that of the global ones by covariance(). */
  LocalSquare local_covariance(std::size_t i, const Eigen::MatrixXd &covariance) const;

  Unknowns at;
  std::vector<bool> kept; /* [placement] */

private:
  double cost(const Unknowns &unknowns) const;
  /* Normal matrix and gradient at the present point. */
  void assemble();
  LocalSquare damped(std::size_t i, double damping) const;
  Eigen::MatrixXd reduced(double damping, Eigen::VectorXd *right) const;
  void step(double damping, Unknowns &unknowns) const;

  const Model &model_;
  const std::vector<Placement> &placements_;
  double cost_ = 0.0;
  Eigen::MatrixXd normal_;
  Eigen::VectorXd gradient_;
  std::vector<LocalSquare> local_normal_;
  std::vector<Local> local_gradient_;
  std::vector<Eigen::MatrixXd> cross_; /* [placement] global by local */
};

/* Gives the model the spreads that the session shows, by expectation and maximisation, each held to what was
 * assumed. covariance: the optimiser's, at its present point. Returns the largest relative change. */
double learn_spreads(Model &model, const Optimiser &optimiser, const Eigen::MatrixXd &covariance);

} // namespace fingertip::calibrating
