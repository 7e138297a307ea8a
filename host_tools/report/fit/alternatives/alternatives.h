/* The fits that one writes down first, to compare the firmware's with: least squares of p0 exp(-((x - xc)^2 + (y -
 * yc)^2) / (2 sigma^2)) with expf or exp for every sensor, the amplitude as a fourth parameter and a 4 x 4 solve, each
 * in float and in double. The same source runs on the host for its errors and on the chip for its cycles.
 *
 *   naive  Gauss-Newton, full steps, no bounds
 *   lm     Levenberg-Marquardt: a step that raises the cost is taken back and damped tenfold, one
 *          that lowers it is kept. Ends early when a step changes no parameter by more than a
 *          rounding error or so.
 *
 * iterations: steps tried. Results are all zero with fewer than four usable sensors or no positive
 * reading, and may be anything, not a number included, where the iteration diverged. */
#ifndef ALTERNATIVES_ALTERNATIVES_H
#define ALTERNATIVES_ALTERNATIVES_H

#include "fit/fit.h"

struct alternative_fit {
  double x_mm, y_mm, p0_Pa, sigma_mm;
};
#define ALTERNATIVE(name)                                                                                                                  \
  struct alternative_fit name(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable, int iterations)
ALTERNATIVE(alternative_naive_float);
ALTERNATIVE(alternative_naive_double);
ALTERNATIVE(alternative_lm_float);
ALTERNATIVE(alternative_lm_double);

#endif
