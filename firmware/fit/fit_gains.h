/* How far the gains of a pad's sensors are apart, learnt from touches: of a pad that was never calibrated it is not
 * known, and what four fitted parameters leave of their errors is in the residual of each touch. So
 *   gain_sd^2 = sum(R / M) / sum(0.58 (sigma / pitch)^3),
 * R and M the squares of the touch's residual, less those of the model's error, and of the fitted Gaussian. The denominator is the share of
 * independent relative errors that the fit leaves, within 25 % for rectangles of 3 x 3 to 5 x 5 sensors and widths of 0.55 to 1 pitch.
 * Gains on a tilt or a bowl leave nothing in the residual, so it is never below 0.08 (NUMERICS.md has what it is worth).
 *
 * A touch counts once, when it rests. What was assumed counts as much as FIT_GAINS_TOUCHES of them. */
#pragma once

#include "fit/fit.h"

#define FIT_GAINS_TOUCHES 4
/* At most this number of touches is remembered, so that another pad is learnt. */
#define FIT_GAINS_TOUCHES_MOST 64

struct fit_gains {
  float residual, share; /* the two sums */
  float p0_Pa;           /* at the last look, of this touch */
  bool counted;          /* this touch is in the sums */
};

/* gain_sd: what is assumed. */
void fit_gains_begin(struct fit_gains *gains, float gain_sd);

/* At each frame without a contact. */
void fit_gains_lift(struct fit_gains *gains);

/* A fit and its readings, some milliseconds after the one before. Whether the sums have changed: once a touch, when p0
 * is within 2 % of that before. A fit does not count that is at a limit, FLAT, without a sensor of the array, narrow,
 * wide, or whose noise would decide. Costs some 6000 cycles on a Cortex-M0+. */
bool fit_gains_learn(struct fit_gains *gains, const struct fit_array *array, const int32_t *pressure_Pa_q10,
                     const struct fit_settings *settings, const struct fit_result *result);

/* 0.08 to 0.5. */
float fit_gains_sd(const struct fit_gains *gains);
