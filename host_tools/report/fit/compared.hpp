// The fits that the firmware's kernels are compared with, behind one call.
#pragma once

extern "C" {
#include "fit/fit.h"
}

#include <array>
#include <string>

namespace fingertip::fitting {

struct KernelSettings {
  int iterations;
  double noise_Pa;
  bool firmware_guess; // double_kernel alone: starts where the firmware's fit does
};

// As fit_result, in double so that a double kernel is not rounded. flags: FIT_VALID at most, for none of them judges itself.
struct KernelResult {
  double x_mm, y_mm, p0_Pa, sigma_mm;
  std::uint32_t flags;
};

// A fit of every usable sensor.
using Solve = KernelResult (*)(const fit_array &array, const std::int32_t *pressure_Pa_q10, sensor_map usable,
                               const KernelSettings &settings);

// The firmware's general kernel in double precision: the same guess, step limits and box.
KernelResult double_kernel(const fit_array &array, const std::int32_t *pressure_Pa_q10, sensor_map usable, const KernelSettings &settings);

// Solvers that a host program might use instead, by name, or nullptr. Not for several threads at once: some keep their
// workspace. They get the same scaled readings, start from the general kernel's first guess, with the analytic
// Jacobian, take a full array of 15 sensors only, and stop by their own rules:
//   ceres_reused   one problem object for every fit, dense QR, default tolerances
//   tiny_solver    ceres::TinySolver, sizes fixed, default tolerances
Solve library_named(const std::string &name);

// The readings that enter, in pitches and units of the largest.
struct Samples {
  std::size_t count = 0;
  std::array<double, FT_MAX_SENSORS> x, y, p;
  double unit_Pa = 0.0; // of p
};

// In pitches and units of the largest reading.
struct Gaussian {
  double p0, x, y, sigma;
};

Samples normalise(const fit_array &array, const std::int32_t *pressure_Pa_q10, sensor_map usable);
// With the best amplitude for its shape. Needs four samples, one of them positive.
Gaussian first_guess(const Samples &samples, double noise_Pa);
KernelResult in_units(const fit_array &array, const Samples &samples, const Gaussian &theta);

} // namespace fingertip::fitting
