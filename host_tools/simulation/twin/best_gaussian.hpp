// The Gaussian closest to the pressure on the base, in the least squares over the square of three
// thicknesses to every side: what a fit finds where sensors are everywhere.
#pragma once

#include "simulation/twin/contact_table.hpp"

#include <vector>

namespace fingertip::twin {

class BestGaussian {
public:
  BestGaussian(const ContactTable &table, double layer_mm);
  struct Fit {
    double p0_Pa, sigma_mm;
  };
  // From ContactTable::FORCE_MIN_N to FORCE_MAX_N; beyond, the width is that at the end.
  Fit at(double force_N) const;

private:
  std::vector<double> p0_per_N_, sigma_mm_; // [force], in equal steps of its logarithm
};

} // namespace fingertip::twin
