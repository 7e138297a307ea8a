/* Spread of the gains of a pad that was never calibrated, learnt from touches. What four fitted parameters leave of the gains' errors is in
 * the residual of each touch:
 *   gain_sd^2 = sum(R / M) / sum(0.58 (sigma / pitch)^3),
 * R and M the squares of the touch's residual, less those of the model's error, and of the fitted Gaussian. The denominator is the share of
 * independent relative errors that the fit leaves, within 25 % for rectangles of 3 x 3 to 5 x 5 sensors and widths of 0.55 to 1 pitch.
 * Gains on a tilt or a bowl leave nothing in the residual, so it is never below 0.08 (NUMERICS.md has what it is worth).
 *
 * A touch counts once, when it rests. What was assumed counts as much as FIT_GAINS_TOUCHES of them. */
#pragma once

#include "fit/fit.h"

#define FIT_GAINS_TOUCHES 4
/* Older touches than this number fade, so that another pad is learnt. */
#define FIT_GAINS_TOUCHES_MAX 64

struct fit_gains {
  float residual, share; /* the two sums */
  float p0_Pa;           /* of this touch, at the last update */
  bool counted;          /* this touch is in the sums */
};

/* gain_sd: what is assumed. */
void fit_gains_begin(struct fit_gains *gains, float gain_sd);

/* Call it at each frame without a contact. */
void fit_gains_end_touch(struct fit_gains *gains);

/* Takes a fit and its readings, some milliseconds after those before. It changes the sums once a touch, when p0 is within 2 % of that
 * before, and returns true then. It ignores a fit at a limit, FLAT, with a sensor missing, narrow, wide, or dominated by noise. Cost: some
 * 6000 Cortex-M0+ cycles. */
bool fit_gains_learn(struct fit_gains *gains, const struct fit_array *array, const int32_t *pressure_Pa_q10,
                     const struct fit_settings *settings, const struct fit_result *result);

/* Relative standard deviation of the gains, 0.08 to 0.5. */
float fit_gains_sd(const struct fit_gains *gains);
