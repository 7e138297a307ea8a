/* Fits p0 exp(-((x - xc)^2 + (y - yc)^2) / (2 sigma^2)) to the readings of the array by least
 * squares: location, peak, width, force, and how far they can be trusted.
 *
 * De Clercq et al., RA-L 2022, eq. (2) to (4). Gauss-Newton with a fixed number of iterations from
 * a first guess made anew for every frame: no state between frames, no early exit, so the cost
 * depends on the number of sensors alone. Any positions, any subset of sensors.
 *
 * Works in pitches and in units of the largest reading, in float32 with integer exponential and
 * logarithm, so that a Cortex-M0+, a Cortex-M4F and a PC compute the same bits.
 */
#ifndef FIT_FIT_H
#define FIT_FIT_H

#include "common/limits.h"
#include "common/status.h"

#include <stdint.h>

/* The array as the fit sees it. Fill with fit_array_init; read-only afterwards. */
struct fit_array {
  uint8_t sensor_count;
  float pitch_mm;
  float x[FT_MAX_SENSORS], y[FT_MAX_SENSORS]; /* [sensor], pitches */
  float x_min, x_max, y_min, y_max; /* box of the location: the array and 1.5 pitches around it */
};

struct fit_settings {
  uint8_t iterations;   /* 1..FIT_MAX_ITERATIONS; 7 brings 99.9 % of observable presses within 1 um
                           of the optimum */
  int32_t noise_Pa_q10; /* rms noise of a reading, 1/1024 Pa, at least 1 */
};
#define FIT_MAX_ITERATIONS 20

/* Widths that the fit can tell, in pitches: narrower ones fall between the sensors, wider ones
 * have no location on the array. */
#define FIT_SIGMA_MIN 0.158f
#define FIT_SIGMA_MAX 5.0f

/* Every member is finite, whatever the input. Where FIT_VALID is off all are zero but the flags. */
struct fit_result {
  float x_mm, y_mm;
  float p0_Pa;
  float sigma_mm;
  float force_N;         /* 2 pi p0 sigma^2 */
  float residual_rms_Pa; /* over the sensors used */
  float location_sd_mm;  /* radial, from the covariance at the solution */
  float force_sd_N;
  uint32_t used;  /* bitmap of the sensors that entered */
  uint32_t flags; /* of enum contact_flag: FIT_VALID, UNCERTAINTY_VALID, LOW_SIGNAL, FLAT,
                     UNCERTAIN, MODEL, AT_BOUND, SENSOR_MASKED */
};

/* FT_ERR_ARGUMENT: sensor_count outside 1..FT_MAX_SENSORS, pitch outside 0.01..10000 mm, or a
 * position outside +-10000 mm. */
enum ft_status fit_array_init(struct fit_array *array, uint8_t sensor_count, const float *x_mm,
                              const float *y_mm, float pitch_mm);

/* pressure_Pa_q10[sensor]: pressure on the pad, 1/1024 Pa, any bits. usable: bitmap of the sensors
 * to use. With fewer than four, or no positive reading, FIT_VALID stays off. */
void fit_gaussian(const struct fit_array *array, const int32_t *pressure_Pa_q10, uint32_t usable,
                  const struct fit_settings *settings, struct fit_result *result);

#endif
