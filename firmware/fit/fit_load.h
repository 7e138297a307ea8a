/* What a tangential load that nobody estimates does to the location.
 *
 * A load that pulls along the rubber moves the Gaussian by some 0.38 pitch for each unit of
 * Q / F, though nothing has moved. It leaves a trace in the residual: its pressure is broader than
 * the difference of two places of a contact. Here is how large that trace is, beyond what noise,
 * gains and model leave by chance. That much of a shift is part of the location's error. A press
 * without a load has no such trace, so it is not doubted for what it might carry.
 *
 * One least squares in fixed point, of the residual of a fit that is done: for every kernel, any
 * layout, any sensors missing. At most 20 000 cycles for fifteen sensors on a Cortex-M0+ (test
 * emulated.fit_cycles). NUMERICS.md has its derivation and its price. */
#ifndef FIT_FIT_LOAD_H
#define FIT_FIT_LOAD_H

#include "fit/fit.h"

/* Of the same readings as the fit. With fewer sensors the residual shows nothing; with more than 24
 * it is not looked at, unless the build is for a larger rectangle. */
#define FIT_LOAD_SENSORS 8

/* Adds to location_sd_mm, and sets UNCERTAIN if that exceeds the limit. Leaves a result alone that
 * is no fit, stopped at a limit, or is FLAT. */
void fit_doubt_load(const struct fit_array *array, const int32_t *pressure_Pa_q10,
                    const struct fit_settings *settings, struct fit_result *result);

#endif
