// Cramer-Rao bounds: what no unbiased estimate from fifteen readings can do better than, for the
// firmware's model of a touch.
//
// The model is that of common/pad_profile.h with the elongations of fit_tangential.c: eight
// unknowns (normal force, place, own spread, two elongations, tangential force), of which the touch
// has the profile's spread, no elongation and the true rest. The inverse of the information of
// independent normal errors bounds their covariance.
#pragma once

#include "shear/static/pulled.hpp"

#include <Eigen/Dense>

namespace fingertip::shear {

// What is known of the touch beforehand.
enum class Told {
  nothing,
  priors, // the firmware's: spread, and elongations near none
  round,  // spread as above, and that it is round
};

// Standard deviation of each reading's error: of noise, of a gain known to so much, and of a model
// that is off by this share of the peak.
struct Errors {
  double noise_Pa = 0.0;
  const Readings *gain_sd = nullptr;
  double model_share = 0.0;
};

struct Bound {
  Eigen::Matrix2d ratio;     // of Q / F
  Eigen::Matrix2d place_mm2; // of x, y
};

Bound bound_of(const fit_array &array, const pad_profile &profile, const twin::Touch &touch, const Errors &errors,
               Told told);

} // namespace fingertip::shear
