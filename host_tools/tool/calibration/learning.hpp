/* What a session shows of its own spreads. */
#pragma once

#include "tool/calibration/optimiser.hpp"

namespace fingertip::calibrating {

/* Gives the model the spreads that the session shows, by expectation and maximisation, each held to
 * what was assumed. covariance: the optimiser's, at its present point. Returns the largest relative
 * change. */
double learn_spreads(Model &model, const Optimiser &optimiser, const Assumptions &given,
                     const Eigen::MatrixXd &covariance);

} // namespace fingertip::calibrating
