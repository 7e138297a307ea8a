// The grid kernel's iteration in double precision, for machines with a fast FPU: an array that is a
// full rectangle, every sensor usable.
//
// On a rectangle the Gaussian separates into gx(i) gy(j). With the polynomials 1, p1, p2 and
// 1, q1, q2 that are orthogonal under gx^2 and gy^2, the Gauss-Newton basis 1, x, y, x^2 + y^2
// becomes 1, p1, q1, p2 + q2: orthogonal, so that there is no matrix to solve. Three exponentials
// give all eight g, and the amplitude is always the best for the shape. Steps are limited as in the
// general kernel. It stops when it has settled: settings.iterations is the most it takes.
#pragma once

#include "report/fit/compared.hpp"

namespace fingertip::fitting {

// No flag but FIT_VALID, and none without a positive reading or a rectangle of the build's size.
KernelResult separable(const fit_array &array, const std::int32_t *pressure_Pa_q10, std::uint32_t usable,
                       const KernelSettings &settings);

} // namespace fingertip::fitting
