// The fits that are compared, behind one call.
#pragma once

extern "C" {
#include "fit/fit.h"
}

#include <cstdint>
#include <vector>

namespace fingertip::fitting {

// Where the iteration starts. The firmware's kernels have a guess of their own.
enum class Guess {
  log_linear, // paraboloid through the logarithms of the large readings
  maximum,    // the strongest sensor, sigma 0.65 pitch
  centroid,   // centre of the positive readings, sigma 0.65 pitch
  firmware,   // what fit_gaussian starts from
};
const char *name_of(Guess guess);

struct KernelSettings {
  int iterations;
  double noise_Pa;
  int n_largest = 0;                                 // largest readings to use; 0 for all
  double prior_sigma_mm = 0.0, prior_width_mm = 0.0; // as fit_settings; width 0 for none
  Guess guess = Guess::log_linear;
};

// As fit_result, with the location in double so that a double kernel is not rounded.
struct KernelResult {
  double x_mm, y_mm, p0_Pa, sigma_mm, force_N;
  std::uint32_t used;  // bitmap of the sensors that entered
  std::uint32_t flags; // of enum contact_flag
};

// What a kernel can do beside fitting every sensor.
enum Capability : unsigned {
  ANY_SUBSET = 1, // fits without every sensor
  N_LARGEST = 2,
  PRIOR = 4,
  GUESSES = 8, // starts from any guess but the firmware's
  FIRMWARE_GUESS = 16,
  ENDS_EARLY = 32, // when it has settled
};

struct Kernel {
  const char *name;
  unsigned capabilities;
  KernelResult (*fit)(const fit_array &array, const std::int32_t *pressure_Pa_q10, std::uint32_t usable,
                      const KernelSettings &settings);
};

// fit      fit_gaussian, as the firmware calls it: it picks the kernel and masks outliers
// grid     the firmware's kernel for a full rectangle, fixed point
// masked   the one for such a rectangle with sensors missing, fixed point
// general  its kernel for any layout, float32
// double   the general kernel's iteration in double precision, same guess and limits: what is left
//          between it and the reference is the optimiser's doing, the rest is rounding
// separable
//          the grid kernel's iteration in double precision, for the host: separable.hpp
// naive_float, naive_double, lm_float, lm_double
//          what one would write instead: alternatives/alternatives.h
const std::vector<Kernel> &all_kernels();

// The firmware's array. Throws std::runtime_error if its geometry is refused.
fit_array firmware_fit_array();

} // namespace fingertip::fitting
