// The fits that are compared, behind one call.
#pragma once

#include "reference/reference.hpp"

extern "C" {
#include "fit/fit.h"
}

#include <cstdint>
#include <vector>

namespace fingertip::reference {

struct KernelSettings {
  int iterations;
  double noise_Pa;
  int n_largest = 0; // largest readings to use; 0 for all
  double prior_sigma_mm = 0.0, prior_width_mm = 0.0; // as fit_settings; width 0 for none
};

// As fit_result, with the location in double so that a double kernel is not rounded.
struct KernelResult {
  double x_mm, y_mm, p0_Pa, sigma_mm, force_N;
  std::uint32_t flags; // of enum contact_flag
};

struct Kernel {
  const char *name;
  bool any_subset; // whether it fits without every sensor
  KernelResult (*fit)(const fit_array &array, const std::int32_t *pressure_Pa_q10,
                      std::uint32_t usable, const KernelSettings &settings);
};

// grid     the firmware's kernel for a full rectangle, fixed point
// general  its kernel for any layout, float32
// double   the general kernel's iteration in double precision, same guess, limits and flags: what
//          is left between it and the reference is the optimiser's doing, the rest is rounding
const std::vector<Kernel> &all_kernels();

// The firmware's array. Throws std::runtime_error if its geometry is refused.
fit_array firmware_fit_array();

} // namespace fingertip::reference
