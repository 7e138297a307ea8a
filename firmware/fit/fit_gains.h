/* How far the gains of a pad's sensors are apart, learnt from touches.
 *
 * Gains of a pad that was never calibrated are apart by some 10 to 22 %, and how far is not known.
 * Each touch shows a part of it: what four fitted parameters leave of the gains' errors is in the
 * residual. So
 *   gain_sd^2 = sum(R / M) / sum(0.58 (sigma / pitch)^3),
 * R and M the squares of the touch's residual, less those of the model's error, and of the fitted
 * Gaussian. The denominator is the share of independent relative errors that the fit leaves, the
 * mean over all places: within 25 % for rectangles of 3 x 3 to 5 x 5 sensors and widths of 0.55 to
 * 1 pitch. Narrower contacts leave too little.
 *
 * Gains that lie on a tilt or a bowl over the pad move and widen the fit and leave nothing in the
 * residual. So it is never below 0.08, however well the readings fit.
 *
 * A touch counts once, when it rests. What was assumed counts as much as FIT_GAINS_TOUCHES of them.
 * NUMERICS.md has what it is worth. */
#ifndef FIT_FIT_GAINS_H
#define FIT_FIT_GAINS_H

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

/* A fit and its readings, some milliseconds after the one before. Whether the sums have changed:
 * once a touch, when p0 is within 2 % of that before. A fit does not count that is at a limit,
 * FLAT, without a sensor of the array, narrow, wide, or whose noise would decide. Costs some 6000
 * cycles on a Cortex-M0+. */
bool fit_gains_learn(struct fit_gains *gains, const struct fit_array *array, const int32_t *pressure_Pa_q10,
                     const struct fit_settings *settings, const struct fit_result *result);

/* 0.08 to 0.5. */
float fit_gains_sd(const struct fit_gains *gains);

#endif
