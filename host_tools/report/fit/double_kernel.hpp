// The firmware's general kernel in double precision: the same guess, step limits and box. It does
// not judge itself: no flag but FIT_VALID.
#pragma once

#include "report/fit/compared.hpp"

#include <array>

namespace fingertip::fitting {

// The readings that enter, in pitches and units of the largest.
struct Samples {
  std::size_t count = 0;
  std::array<double, FT_MAX_SENSORS> x, y, p;
  double unit_Pa = 0.0;     // of p
  double sum_squares = 0.0; // of p
};

// In pitches and units of the largest reading.
struct Gaussian {
  double p0, x, y, sigma;
};

Samples normalise(const fit_array &array, const std::int32_t *pressure_Pa_q10, std::uint32_t usable);

// Any guess but the firmware's, with the best amplitude for its shape. Needs four samples, one of
// them positive.
Gaussian first_guess(const Samples &samples, double noise_Pa, Guess guess = Guess::log_linear);

KernelResult double_kernel(const fit_array &array, const std::int32_t *pressure_Pa_q10, std::uint32_t usable,
                           const KernelSettings &settings);

} // namespace fingertip::fitting
