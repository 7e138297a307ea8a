/* What the fingertip reports about one frame: the flags of the fit, every other flag that applies, and the slip. */
#pragma once

#include "contact/slip.h"
#include "fit/fit.h"
#include "fit/fit_tangential.h"

#include <stdbool.h>
#include <stdint.h>

struct contact_settings {
  float slip_threshold_mm;
  uint32_t slip_window_us;
  float force_scale;    /* force is this times 2 pi p0 sigma^2 */
  float force_scale_sd; /* standard deviation of force_scale */
};

/* Input of the flags. */
struct contact_input {
  uint64_t t_us; /* of the frame */
  bool contact;  /* the gate is open */
  bool tared;
  bool masked;                             /* a sensor is missing or was left out */
  bool zero_doubtful;                      /* see condition.h */
  bool sensor_doubtful;                    /* a sensor in use is doubtful, see frame.h */
  bool calibrated;                         /* gains and force scale of a calibration are applied */
  sensor_map unsettled;                    /* bitmap, see frame.h */
  sensor_map saturated;                    /* bitmap: left out of the fit for being beyond their range */
  const struct fit_result *fit;            /* NULL where nothing was fitted */
  const struct fit_tangential *tangential; /* NULL where nothing was estimated */
};

struct contact_result {
  uint32_t flags; /* enum contact_flag */
  float slip_mm;  /* 0 unless SLIP_VALID */
};

struct contact_force {
  float force_N, force_sd_N; /* 0 unless FIT_VALID, and UNCERTAINTY_VALID */
};

/* With fewer unsaturated sensors the peak is extrapolated, and the force a lower bound. */
#define CONTACT_MIN_UNSATURATED 5

bool contact_is_lower_bound(const struct fit_result *fit, sensor_map saturated);

/* The scaled force of a fit, with the scale's error in its standard deviation. largest_Pa: reading, of any size where a sensor is
 * saturated. A fit at its bound, or whose location is less certain than its width, may have any peak: its force is limited to that of the
 * largest reading at its width, and the standard deviation contains what is cut. */
struct contact_force contact_scale_force(const struct contact_settings *settings, const struct fit_result *fit, float largest_Pa);

/* Sets the flags, without slip. */
void contact_set_flags(const struct contact_input *input, struct contact_result *result);

/* Sets the flags, with slip. Locations flagged FLAT, AT_BOUND or ZERO_DOUBTFUL do not enter the slip history. Neither do those whose
 * noise alone has a standard deviation above CONTACT_JITTER_MAX_mm. The history starts again after them, as after a
 * loss of contact. At that limit noise alone exceeds the usual threshold of 0.75 mm once in a million frames. Of other
 * settled sensors the first frame does not enter either, and a second starts again. Velocity starts again with the
 * first frame of other sensors, settled or not (motion.h). The tangential force is estimated from every frame. */
#define CONTACT_JITTER_MAX_mm 0.2f

void contact_update(struct slip_history *history, const struct contact_settings *settings, const struct contact_input *input,
                    struct contact_result *result);
