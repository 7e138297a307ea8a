/* The fits that one writes down first, to compare the firmware's with: least squares of
 * p0 exp(-((x - xc)^2 + (y - yc)^2) / (2 sigma^2)) with expf or exp for every sensor, the amplitude
 * as a fourth parameter and a 4 x 4 solve, each in float and in double. The same source runs on the
 * host for its errors and on the chip for its cycles.
 *
 *   naive  Gauss-Newton, full steps, no bounds
 *   lm     Levenberg-Marquardt: a step that raises the cost is taken back and damped tenfold, one
 *          that lowers it is kept. Ends early when a step changes no parameter by more than a
 *          rounding error or so.
 *
 * iterations: steps tried. Results are all zero with fewer than four usable sensors or no positive
 * reading, and may be anything, not a number included, where the iteration diverged.
 */
#ifndef ALTERNATIVES_ALTERNATIVES_H
#define ALTERNATIVES_ALTERNATIVES_H

#include "fit/fit.h"

#include <stdint.h>

enum alternative_guess {
  ALTERNATIVE_GUESS_LOG_LINEAR, /* paraboloid through the logarithms of the large readings */
  ALTERNATIVE_GUESS_MAXIMUM,    /* the strongest sensor, sigma 0.65 pitch */
  ALTERNATIVE_GUESS_CENTROID,   /* centre of the positive readings, sigma 0.65 pitch */
};

struct alternative_settings {
  int iterations;
  enum alternative_guess guess;
};

#define ALTERNATIVES_OF(real)                                                                                          \
  struct alternative_fit_##real {                                                                                      \
    real x_mm, y_mm, p0_Pa, sigma_mm, force_N;                                                                         \
  };                                                                                                                   \
  struct alternative_fit_##real alternative_naive_##real(const struct fit_array *array,                                \
                                                         const int32_t *pressure_Pa_q10, uint32_t usable,              \
                                                         const struct alternative_settings *settings);                 \
  struct alternative_fit_##real alternative_lm_##real(const struct fit_array *array, const int32_t *pressure_Pa_q10,   \
                                                      uint32_t usable, const struct alternative_settings *settings);

ALTERNATIVES_OF(float)
ALTERNATIVES_OF(double)

#endif
