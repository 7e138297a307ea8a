/* What errors a result is said to have, and when it deserves a warning: alike in all kernels. */
#ifndef FIT_FIT_LIMITS_H
#define FIT_FIT_LIMITS_H

#include "common/bytes.h"
#include "common/contact_flags.h"
#include "fit/fit.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#define FIT_SETTLED_mm 0.3f      /* a larger last step leaves outliers undecided */
#define FIT_MODEL_RESIDUAL 0.15f /* of the root of the sum of squared readings */
#define FIT_ROUGH_RESIDUAL 0.02f
#define FIT_MISFIT 3            /* residuals in sd that noise, gains and model give */
#define FIT_NARROW_SIGMA 0.4f   /* pitches: an outlier may look like it */
#define FIT_FLAT_SIGMA 4.9f     /* pitches */
#define FIT_LOW_SIGNAL_SIGMA 20 /* noise standard deviations in the largest reading */
#define FIT_HUGE 1e9f           /* stands for: nothing is known */

/* A sensor is an outlier if its studentised residual, in standard deviations that the others'
 * suggest, exceeds FIT_OUTLIER and leaving it out brings the residuals below the share
 * FIT_OUTLIER_GAIN. It is looked for where the fit has settled with residuals that are rough and
 * no noise. */
#define FIT_OUTLIER 15
#define FIT_OUTLIER_GAIN 0.5f

/* The errors of a reading that the standard deviations are made of, each independent of the others:
 *   the noise;
 *   its gain's: gain_sd times the model there;
 *   the model's: model_sd times the largest reading, alike for every sensor, and besides
 *   FIT_SHAPE_PER_MODEL model_sd (FIT_SHAPE_SIGMA / sigma)^2 amplitude e (r / sigma)^4,
 *   one amplitude for all sensors: a layer's pressure has heavier tails than a Gaussian, and the
 * more so the thinner it is. Alone, the former says 0.5 mm where a press on a node of a thin pad is
 * good to 0.05 mm, and the latter nothing where all sensors are as far from the contact; what the
 * residuals are above these; from FIT_MISFIT_BEGIN times their variance more than that, up to
 * FIT_MISFIT_MOST times, as they must come from few readings or another model. Of the force the
 * shape's part counts by FIT_FORCE_SHAPE: the rest of it is the same for every touch of a pad,
 * which the force scale is there for. The last step counts as an error of the location; where the
 * fit stopped at a limit, FIT_BOUND_SD stands for all: what is linear about such a point says
 * nothing. Values from truth_fit --seed 1; NUMERICS.md has what they cover on others. */
#define FIT_MISFIT_BEGIN 8
#define FIT_MISFIT_MOST 8
#define FIT_SHAPE_PER_MODEL 1.1f
#define FIT_SHAPE_SIGMA 0.644f /* pitches: 12 mm of rubber on a pitch of 9 mm */
#define FIT_FORCE_SHAPE 0.4f
#define FIT_BOUND_SD 1.2f /* pitches: such presses of a thin pad are off by up to 2.4 */

/* A contact is elongated if log(longer width / shorter) exceeds FIT_STRETCH_LEAST, which the cubes
 * and spheres of a layer stay below, and FIT_STRETCH_SURE standard deviations of what noise and
 * gains make of it, in quadrature. The widths are told up to a standard deviation of
 * FIT_STRETCH_SD_MAX and a ratio of exp(FIT_STRETCH_MAX); below FIT_SHAPE_LEAST pitches of sigma it
 * is the layer's own profile that looks elongated between the sensors. If elongated, the location's
 * standard deviation contains by how much separate widths would move it; beyond a stretch of
 * FIT_STRETCH_LINEAR, where that is many times the error, its share that falls with the square of
 * the stretch. */
#define FIT_STRETCH_LEAST 0.1f
#define FIT_STRETCH_SURE 2.5f
#define FIT_STRETCH_SD_MAX 0.25f
#define FIT_STRETCH_LINEAR 0.7f
#define FIT_STRETCH_MAX 1.25f
#define FIT_SHAPE_LEAST 0.55f

/* Of positive floats the bits have the same order, and those of others are none of theirs. */
static inline float fit_location_sd_limit_mm(const struct fit_settings *settings) {
  uint32_t bits = bytes_from_f32(settings->location_sd_limit_mm);
  bool positive = bits - 1u < bytes_from_f32(FIT_HUGE) - 1u;
  return positive ? settings->location_sd_limit_mm : FIT_LOCATION_SD_LIMIT_mm;
}

#define FIT_PRIOR_WIDTH_MIN_mm 0.001f
#define FIT_PRIOR_MAX_mm 10000.0f

/* By the bits, likewise: NaN and -0 are above the limits. */
static inline bool fit_has_prior(const struct fit_settings *settings) {
  uint32_t least = bytes_from_f32(FIT_PRIOR_WIDTH_MIN_mm), most = bytes_from_f32(FIT_PRIOR_MAX_mm);
  return bytes_from_f32(settings->prior_width_mm) - least <= most - least &&
         bytes_from_f32(settings->prior_sigma_mm) <= most;
}

/* Whether the fit without an outlier is the better one; rough: its residuals still are. An outlier
 * above the others takes the place of a narrow press and makes others outliers: then either fit may
 * be the right one. */
static inline bool fit_outlier_gone(const struct fit_settings *settings,
                                    const struct fit_result *with, struct fit_result *without,
                                    bool rough, float pitch_mm) {
  if (!(without->flags & CONTACT_FLAG_FIT_VALID) ||
      !(without->residual_rms_Pa < FIT_OUTLIER_GAIN * with->residual_rms_Pa)) {
    return false;
  }
  if (rough || without->sigma_mm < FIT_NARROW_SIGMA * pitch_mm) {
    float dx = with->x_mm - without->x_mm, dy = with->y_mm - without->y_mm;
    float sd = without->location_sd_mm;
    sd = sqrtf(sd * sd + dx * dx + dy * dy);
    without->location_sd_mm = sd < FIT_HUGE ? sd : FIT_HUGE;
    if (sd > fit_location_sd_limit_mm(settings)) {
      without->flags |= CONTACT_FLAG_UNCERTAIN;
    }
  }
  return true;
}

#endif
