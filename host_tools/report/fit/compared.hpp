// The fits that the firmware's kernels are compared with, behind one call.
#pragma once

extern "C" {
#include "fit/fit.h"
}

#include <cstdint>

namespace fingertip::fitting {

// Where the iteration starts.
enum class Guess {
  log_linear, // paraboloid through the logarithms of the large readings
  maximum,    // the strongest sensor, sigma 0.65 pitch
  centroid,   // centre of the positive readings, sigma 0.65 pitch
  firmware,   // what fit_gaussian starts from; double_kernel only
};

struct KernelSettings {
  int iterations;
  double noise_Pa;
  double prior_sigma_mm = 0.0, prior_width_mm = 0.0; // as fit_settings; width 0 for none
  Guess guess = Guess::log_linear;
};

// As fit_result, with the location in double so that a double kernel is not rounded.
struct KernelResult {
  double x_mm, y_mm, p0_Pa, sigma_mm, force_N;
  std::uint32_t used;  // bitmap of the sensors that entered
  std::uint32_t flags; // of enum contact_flag
};

// A fit of every usable sensor. The settings' prior is for double_kernel alone.
using Solve = KernelResult (*)(const fit_array &array, const std::int32_t *pressure_Pa_q10, std::uint32_t usable,
                               const KernelSettings &settings);

} // namespace fingertip::fitting
