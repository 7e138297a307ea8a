/* The kernels behind fit_gaussian. Each is one row:
 *
 *   ROW(name, suits, fits)
 *
 * fit_gaussian takes the first row whose condition `suits` holds, and calls `fits`. `suits` sees
 * array, settings, usable and `all`, the bitmap of all sensors of the array; `fits` sees array,
 * pressure_Pa_q10, usable, settings and result, as fit_gaussian has them. The report on the fit
 * measures every row by its name (host_tools/report/fit, on this computer and on the chip). */
#ifndef FT_FIT_KERNELS_H
#define FT_FIT_KERNELS_H

#include "fit/fit.h"
#include "fit/fit_limits.h"

/* For the rectangle of the build: fit_gaussian_grid takes one of these alone. Their files have names
 * that begin with fit_grid, which is how the build finds the options they want. `fits` is true if
 * it has settled with residuals that look like an outlier, for fit_gaussian_grid to leave that out. */
#define FIT_GRID_KERNELS(ROW)                                                                                          \
  ROW(grid, usable == all && !fit_steps_want_dip(array, settings), fit_grid(array, pressure_Pa_q10, settings, result)) \
  ROW(masked, true, fit_grid_masked(array, pressure_Pa_q10, usable, settings, result))

/* For any other layout; each leaves an outlier out by itself. */
#define FIT_OTHER_KERNELS(ROW) ROW(general, true, fit_general(array, pressure_Pa_q10, usable, settings, result))

#endif
