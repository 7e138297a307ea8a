// The tangential estimate's reference: its model, weights and priors (firmware/fit/NUMERICS.md, "Tangential force") in double precision and
// millimetres, minimised by Ceres with derivatives of its own from many starts; the lowest cost counts.
#pragma once

#include "common/pad_profile.h"

#include <vector>

namespace fingertip::reference {

struct TangentialSample {
  double x_mm, y_mm, pressure_Pa, gain_sd;
};

struct TangentialStart {
  double x_mm, y_mm, sigma_mm, force_N; // of the Gaussian fit
};

struct TangentialFit {
  double x_mm, y_mm, force_N, qx_N, qy_N;
  double spread_mm2;
  double cost;   // half of chi^2
  double q_sd_N; // of either component, root mean square, for errors of the weights' size
  bool at_bound;
};

TangentialFit fit_tangential_estimate(const pad_profile &profile, const std::vector<TangentialSample> &samples, double noise_Pa,
                                      const TangentialStart &start);

} // namespace fingertip::reference
