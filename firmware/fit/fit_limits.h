/* The errors that a result reports, and when it deserves a warning. They are alike in all kernels. */
#pragma once

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
#define FIT_HUGE 1e9f           /* means: nothing is known */

/* The sensors' deviations are removed from the readings before this number of the last iterations, when the contact is known,
 * and the dip not later. It is of first order, so it changes no reading by more than this share of the model. */
#define FIT_DEVIATION_ITERATIONS 2
#define FIT_DEVIATION_SHARE_MAX 0.5f

/* A sensor is an outlier if its studentised residual, in standard deviations of the others',
 * exceeds FIT_OUTLIER, and leaving it out brings the residuals below the share FIT_OUTLIER_GAIN.
 * The fit searches for one only after it has settled with residuals that are rough and no noise. */
#define FIT_OUTLIER 15
#define FIT_OUTLIER_GAIN 0.5f

/* The errors of a reading in the standard deviations, independent of each other (NUMERICS.md, "Errors"):
 *   the noise;
 *   its gain's: gain_sd times the model there;
 *   the hysteresis of its rubber: hysteresis_sd;
 *   the model's: model_sd times the largest reading, alike for every sensor;
 *   its shape's: one amplitude for all sensors,
 *   FIT_SHAPE_PER_MODEL model_sd (FIT_SHAPE_SIGMA / sigma)^2 amplitude e (r / sigma)^4, for the force
 *   FIT_FORCE_SHAPE of it, where the dip is known FIT_SHAPE_KNOWN of it;
 *   residuals above these: from FIT_MISFIT_BEGIN times the expected variance on they count more, up
 *   to FIT_MISFIT_MAX times.
 * Where the fit stopped at a limit, FIT_BOUND_SD replaces all. Values: truth.py --parts fit --seed 1. */
#define FIT_MISFIT_BEGIN 8
#define FIT_MISFIT_MAX 8
#define FIT_SHAPE_PER_MODEL 1.1f
#define FIT_SHAPE_SIGMA 0.644f /* pitches: 12 mm of rubber on a pitch of 9 mm */
#define FIT_FORCE_SHAPE 0.4f
#define FIT_SHAPE_KNOWN 0.3f
#define FIT_BOUND_SD 1.2f /* pitches: such presses of a thin pad are off by up to 2.4 */

/* A contact is elongated if log(longer width / shorter) exceeds FIT_ELONGATION_MIN, below which the cubes and spheres of a layer stay, and
 * FIT_ELONGATION_SDS standard deviations of the part from noise and gains, added in quadrature; where the dip is known, also a tail that is
 * off by FIT_TAIL_ERROR of the peak, as wide as the dip. Widths are reported up to a standard deviation of FIT_ELONGATION_SD_MAX and a
 * ratio of exp(FIT_ELONGATION_MAX), and from a sigma of FIT_WIDTHS_SIGMA_MIN pitches, below which the layer's own profile appears
 * elongated. If it is elongated, the location's standard deviation contains the shift by separate widths, beyond a stretch of
 * FIT_ELONGATION_LINEAR only the share of it that falls with the square of the stretch. */
#define FIT_ELONGATION_MIN 0.1f
#define FIT_TAIL_ERROR 0.015f
#define FIT_ELONGATION_SDS 2.5f
#define FIT_ELONGATION_SD_MAX 0.25f
#define FIT_ELONGATION_LINEAR 0.7f
#define FIT_ELONGATION_MAX 1.25f
#define FIT_WIDTHS_SIGMA_MIN 0.55f

/* The bits of positive floats have the same order. Other floats have other bits. */
static inline float fit_location_sd_limit_mm(const struct fit_settings *settings) {
  uint32_t bits = bytes_from_f32(settings->location_sd_limit_mm);
  bool positive = bits - 1u < bytes_from_f32(FIT_HUGE) - 1u;
  return positive ? settings->location_sd_limit_mm : FIT_LOCATION_SD_LIMIT_mm;
}

/* The dip never takes more than this share of the largest reading, and its sd is at least FIT_DIP_SD_MIN and at most
 * FIT_DIP_SD_MAX pitches. */
#define FIT_DIP_DEPTH_MAX 0.25f
/* What the dip may be off by at each sensor, of itself. It counts where the derivatives have the
 * dip. Chosen on the recording that chooses of host_tools/report/real. */
#define FIT_DIP_ERROR 0.1f
#define FIT_DIP_ERROR_Q16 ((int32_t)(FIT_DIP_ERROR * 65536.0f))
/* Where the derivatives have the dip, a sensor of an outer row has that of a contact there less this share, which falls by 3/4 per pitch
 * inwards. On recordings that only show: 0.2 to 0.8. */
#define FIT_DIP_END 0.5f
#define FIT_DIP_SD_MIN 0.5f
#define FIT_DIP_SD_MAX 5.0f

#define FIT_PRIOR_WIDTH_MIN_mm 0.001f
#define FIT_PRIOR_MAX_mm 10000.0f

/* Compares bits as well: NaN and -0 are above the limits. */
static inline bool fit_has_prior(const struct fit_settings *settings) {
  uint32_t least = bytes_from_f32(FIT_PRIOR_WIDTH_MIN_mm), most = bytes_from_f32(FIT_PRIOR_MAX_mm);
  return bytes_from_f32(settings->prior_width_mm) - least <= most - least && bytes_from_f32(settings->prior_sigma_mm) <= most;
}

static inline bool fit_has_dip(const struct fit_settings *settings) {
  uint32_t least = bytes_from_f32(FIT_PRIOR_WIDTH_MIN_mm), most = bytes_from_f32(FIT_PRIOR_MAX_mm);
  return bytes_from_f32(settings->dip_sd_mm) - least <= most - least &&
         bytes_from_f32(settings->dip_share) - 1u < bytes_from_f32(FIT_DIP_SHARE_MAX);
}

/* With no more than FIT_DEVIATION_ITERATIONS nothing is corrected: the contact is not known before the last of them. */
static inline bool fit_has_deviations(const struct fit_settings *settings) {
  return settings->deviations && settings->iterations > FIT_DEVIATION_ITERATIONS;
}

/* Where sensors are far apart for the width, those beside the contact feel little but the dip. Then
 * it belongs into the derivatives; elsewhere it is enough to add it to the readings. */
static inline bool fit_jacobian_needs_dip(const struct fit_array *array, const struct fit_settings *settings) {
  return fit_has_dip(settings) && fit_has_prior(settings) && settings->prior_sigma_mm < FIT_WIDTHS_SIGMA_MIN * array->pitch_mm;
}

/* The share of a dip that a sensor at (x, y) has of a contact, pitches (FIT_DIP_END). low, high: the box of the location. */
static inline float fit_dip_share_along(float low, float high, float at, float place) {
  float inside = place < low + 2.0f ? at - low : high - at;
  bool is_end = fminf(place - low, high - place) < 2.0f && high - low > 4.5f;
  return is_end ? 1.0f - fminf(fmaxf(FIT_DIP_END - 0.75f * (inside - 1.5f), 0.0f), FIT_DIP_END) : 1.0f;
}
static inline float fit_dip_share(const struct fit_array *array, float at_x, float at_y, float x, float y) {
  return fit_dip_share_along(array->x_min, array->x_max, at_x, x) * fit_dip_share_along(array->y_min, array->y_max, at_y, y);
}

/* Whether the sensors are the rectangle of the build. */
static inline bool fit_is_rectangle(const struct fit_array *array) {
#ifdef FIT_GRID_ANY
  return array->grid.columns > 0;
#else
  return array->grid.columns == FIT_GRID_COLUMNS && array->grid.rows == FIT_GRID_ROWS;
#endif
}

/* What a reading below zero counts as. */
static inline int32_t fit_reading(const struct fit_settings *settings, int32_t pressure_Pa_q10) {
  if (settings->clip_below_sds == 0 || pressure_Pa_q10 >= 0) {
    return pressure_Pa_q10;
  }
  int32_t noise = settings->noise_Pa_q10 < 1 << 22 ? settings->noise_Pa_q10 : 1 << 22;
  return pressure_Pa_q10 < -noise * settings->clip_below_sds ? 0 : pressure_Pa_q10;
}

/* Whether the fit without an outlier is the better one. rough: its residuals still are. An outlier above the others
 * takes the place of a narrow press, and makes others outliers. Then either fit may be the right one. */
static inline bool fit_is_better_without(const struct fit_settings *settings, const struct fit_result *with, struct fit_result *without,
                                         bool rough, float pitch_mm) {
  if (!(without->flags & CONTACT_FLAG_FIT_VALID) || !(without->residual_rms_Pa < FIT_OUTLIER_GAIN * with->residual_rms_Pa)) {
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
