/* Levenberg-Marquardt on the unknowns of a model, the local ones eliminated. */
#pragma once

#include "tool/calibration/model.hpp"

namespace fingertip::calibrating {

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
  void add(std::size_t i, const Reading &r, double square, double slope);
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
double learn_spreads(Model &model, const Optimiser &optimiser, const Assumptions &given,
                     const Eigen::MatrixXd &covariance);

} // namespace fingertip::calibrating
