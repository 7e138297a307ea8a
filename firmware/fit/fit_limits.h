/* When a result deserves a warning; both kernels judge by the same limits. */
#ifndef FIT_FIT_LIMITS_H
#define FIT_FIT_LIMITS_H

#include "common/contact_flags.h"
#include "fit/fit.h"

#include <stdbool.h>
#include <stdint.h>

#define FIT_SETTLED_mm 0.02f     /* a larger last step has not settled */
#define FIT_MODEL_RESIDUAL 0.15f /* of the root of the sum of squared readings */
#define FIT_ROUGH_RESIDUAL 0.02f
#define FIT_NARROW_SIGMA 0.4f   /* pitches */
#define FIT_MISFIT 3            /* standard deviation of the residuals, in those of the noise */
#define FIT_FLAT_SIGMA 4.9f     /* pitches */
#define FIT_LOW_SIGNAL_SIGMA 20 /* noise standard deviations in the largest reading */
#define FIT_HUGE 1e9f           /* stands for: nothing is known */

/* A sensor is an outlier if its studentised residual, in standard deviations that the others'
 * suggest, exceeds FIT_OUTLIER and leaving it out brings the residuals below the share
 * FIT_OUTLIER_GAIN. It is looked for where the fit has settled with residuals that are rough and
 * no noise. */
#define FIT_OUTLIER 15
#define FIT_OUTLIER_GAIN 0.5f

/* Largest predicted standard deviation of the location that passes without a warning, mm in Q16.
 *
 * misfit: the residuals exceed the noise by FIT_MISFIT, so that they are the model's error. Of a
 * narrow pressure that is the shape of a stiff layer, even about its centre: it moves the location
 * less than the same residuals at random would. Of a rough one, with residuals above
 * FIT_ROUGH_RESIDUAL of the readings, it has no symmetry to rely on: unequal sensors, or two
 * contacts. The limits are chosen on the sets and stiff cases of the fit report: in none of them
 * are more than 0.5 % of the presses off by more than 1 mm without a warning. */
static inline int32_t fit_sd_limit_mm_q16(bool misfit, bool narrow, bool rough) {
  const int32_t usual = 13107 /* 0.2 */, of_narrow = 32768 /* 0.5 */, of_rough = 7864 /* 0.12 */;
  return !misfit ? usual : narrow ? of_narrow : rough ? of_rough : usual;
}

#define FIT_PRIOR_WIDTH_MIN_mm 0.001f
#define FIT_PRIOR_MAX_mm 10000.0f

/* No comparison with a NaN holds. */
static inline bool fit_has_prior(const struct fit_settings *settings) {
  return settings->prior_width_mm >= FIT_PRIOR_WIDTH_MIN_mm &&
         settings->prior_width_mm <= FIT_PRIOR_MAX_mm && settings->prior_sigma_mm >= 0.0f &&
         settings->prior_sigma_mm <= FIT_PRIOR_MAX_mm;
}

/* Whether the fit without an outlier is the better one; rough: its residuals still are. An outlier
 * above the others takes the place of a narrow press and makes others outliers: that is uncertain.
 */
static inline bool fit_outlier_gone(const struct fit_result *with, struct fit_result *without,
                                    bool rough, float pitch_mm) {
  if (!(without->flags & CONTACT_FLAG_FIT_VALID) ||
      !(without->residual_rms_Pa < FIT_OUTLIER_GAIN * with->residual_rms_Pa)) {
    return false;
  }
  if (rough || without->sigma_mm < FIT_NARROW_SIGMA * pitch_mm) {
    without->flags |= CONTACT_FLAG_UNCERTAIN;
  }
  return true;
}

#endif
