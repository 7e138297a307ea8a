/* Fits p0 exp(-((x - xc)^2 + (y - yc)^2) / (2 sigma^2)) to the readings of the array by least
 * squares. The result is location, peak, width and force, and how far they can be trusted.
 *
 * De Clercq et al., RA-L 2022, eq. (2) to (4). Gauss-Newton with a fixed number of iterations from
 * a new first guess for every frame. There is no state between frames and no early exit, so the
 * cost depends on the array alone. Any positions, any subset of sensors.
 *
 * A rectangular grid, with every sensor or without some, takes fixed point. Everything else takes
 * float32. Both use integer exponentials and logarithms, so that a Cortex-M0+, a Cortex-M4F and a
 * PC compute the same bits. Main context only: they divide with port/divide.h.
 *
 * Sensors on a line do not show where a contact lies across it. The fit holds the location to the
 * line. p0 and force are those of a contact whose centre is there. */
#ifndef FIT_FIT_H
#define FIT_FIT_H

#include "common/limits.h"
#include "common/status.h"
#include "fit/fit_grid.h"

#include <stdbool.h>
#include <stdint.h>

/* The array as the fit sees it. Fill with fit_array_init; read-only afterwards. */
struct fit_array {
  uint8_t sensor_count;
  float pitch_mm;
  float x[FT_MAX_SENSORS], y[FT_MAX_SENSORS]; /* [sensor], pitches */
  float x_min, x_max, y_min, y_max;           /* box of the location: the array and 1.5 pitches around it */
  bool is_line;                               /* the sensors lie on x line_x + y line_y = line_offset, and */
  float line_x, line_y, line_offset;          /* (line_x, line_y) is of unit length */
  struct fit_grid_shape grid;
};

/* Of a sensor, beside its gain: how far it is from its place in the array, and how much wider than
 * the others it feels a contact. */
struct fit_own {
  int32_t off_x_q15, off_y_q15; /* pitches; within +-1, as the next */
  int32_t wider_q15;            /* log of its width over theirs */
};

struct fit_settings {
  uint8_t iterations;   /* 0 (the guess)..FIT_MAX_ITERATIONS; 4 come as near to the truth as more
                           do, 7 bring 99.9 % of observable presses within 1 um of the optimum */
  int32_t noise_Pa_q10; /* rms noise of a reading, 1/1024 Pa; below 1 there is no fit */
  uint8_t n_largest;    /* fit the n largest readings only, of equal ones those of lower number, as
                           the paper does; 0: all, which is more accurate. Fewer than a fit
                           needs give none. Takes the general kernel. */
  /* Weak prior on sigma, for rubber so stiff that the array can hardly determine it: one more row
   * FIT_PRIOR_WEIGHT largest (sigma - prior_sigma) / prior_width. None unless the width is
   * 0.001..10000 mm and sigma 0..10000 mm. */
  float prior_sigma_mm, prior_width_mm;
  /* A reading so many noise_Pa below zero counts as zero, since a Gaussian is never negative. 0: no
   * reading is changed, as a tangential load asks for. */
  uint8_t cut_noises;
  /* What the rubber takes from the readings around a contact, where that is known:
   * dip_share p0 exp(-r^2 / (2 dip_sd^2)). Readings are not cut then. None unless the share is above 0 and at most
   * FIT_DIP_SHARE_MAX, and the sd is 0.001..10000 mm. */
  float dip_share, dip_sd_mm;
  /* [sensor] or NULL: not known. Before the last two of three and more iterations, each reading is
   * corrected by it to first order, by at most half of what the model has there. */
  const struct fit_own *own;
  /* Other errors that the standard deviations contain. */
  uint16_t gain_sd_q16[FT_MAX_SENSORS]; /* [sensor] relative sd of its gain; 0: exact */
  uint16_t model_sd_q16;                /* sd of the model's own error, as a share of the largest reading; 0: none */
  float location_sd_limit_mm;           /* UNCERTAIN above it; 0: FIT_LOCATION_SD_LIMIT_mm */
};
#define FIT_LOCATION_SD_LIMIT_mm 0.6f
#define FIT_PRIOR_WEIGHT 0.01f
#define FIT_DIP_SHARE_MAX 0.1f
#define FIT_MAX_ITERATIONS 20

/* Widths that the fit can estimate, in pitches: narrower ones fall between the sensors, wider ones
 * have no location on the array. */
#define FIT_SIGMA_MIN 0.158f
#define FIT_SIGMA_MAX 5.0f

/* The same gain_sd for every sensor, and model_sd: shares of 1, below 1. */
void fit_set_errors(struct fit_settings *settings, float gain_sd, float model_sd);

/* Every member is finite, whatever the input. Where FIT_VALID is off all but the flags are zero. */
struct fit_result {
  float x_mm, y_mm;
  float p0_Pa;
  float sigma_mm;
  float force_N;           /* 2 pi p0 sigma^2 */
  float residual_rms_Pa;   /* over the sensors used */
  float location_sd_mm;    /* radial: 63 % of errors are smaller, 98 % smaller than twice it; without
                              what a tangential load does, which fit_load.h adds */
  float location_noise_mm; /* what of it is noise: how far a contact at rest jitters */
  float force_sd_N;
  float sigma_x_mm, sigma_y_mm; /* WIDTHS_VALID: of an elliptic Gaussian, along the axes */
  float width_correlation;      /* and its correlation, -1..1: 0 unless it lies aslant */
  uint32_t used;                /* bitmap of the sensors that entered */
  uint32_t flags;               /* of enum contact_flag: FIT_VALID, UNCERTAINTY_VALID, LOW_SIGNAL, FLAT,
                                   UNCERTAIN, MODEL, AT_BOUND, SENSOR_MASKED, WIDTHS_VALID, ELONGATED */
};

/* FT_ERR_ARGUMENT: sensor_count outside 1..FT_MAX_SENSORS, pitch outside 0.01..10000 mm, or a
 * position outside +-10000 mm. Arrays more than 2^30 / 2^24 .. 2^23 = 64 to 128 pitches off the
 * origin take the general kernel. */
enum ft_status fit_array_init(struct fit_array *array, uint8_t sensor_count, const float *x_mm, const float *y_mm,
                              float pitch_mm);

/* The same for an image that knows its layout. It takes only the rectangle of FIT_GRID_COLUMNS x
 * FIT_GRID_ROWS nodes that the fixed-point kernels are compiled for. Any other is FT_ERR_ARGUMENT
 * too. Use it with fit_gaussian_grid. */
enum ft_status fit_array_init_grid(struct fit_array *array, uint8_t sensor_count, const float *x_mm, const float *y_mm,
                                   float pitch_mm);

/* A second fit leaves out a sensor whose reading does not belong to the others' (fit_limits.h).
 * SENSOR_MASKED and `used` show it. The fit looks for one only where residuals are rough, and more
 * than noise, gains and model explain.
 *
 * Widths and ELONGATED need every sensor of the grid.
 *
 * pressure_Pa_q10[sensor]: pressure on the pad, 1/1024 Pa, any bits. usable: bitmap of the sensors
 * to use. With fewer than four (of an array on a line, three), or no positive reading, FIT_VALID
 * stays off. */
void fit_gaussian(const struct fit_array *array, const int32_t *pressure_Pa_q10, uint32_t usable,
                  const struct fit_settings *settings, struct fit_result *result);

/* The same without the general kernel, so that an image does not hold it: n_largest must be 0. */
void fit_gaussian_grid(const struct fit_array *array, const int32_t *pressure_Pa_q10, uint32_t usable,
                       const struct fit_settings *settings, struct fit_result *result);

/* What frames that follow each other keep of the search for an outlier. A sensor that is broken
 * stays broken, and a pad that the model fits roughly does so in each frame. So what the search
 * found stands for FIT_WATCH_FRAMES frames of the same sensors: an outlier is left out at once, and
 * where there was none, none is looked for. Before, only residuals that have grown by half of what
 * they were, relative to the force, begin another search, and not in the first FIT_WATCH_LEAST
 * frames. So at most one frame in FIT_WATCH_LEAST + 1 takes as long as a search, and where the
 * contact is the same one in FIT_WATCH_FRAMES + 1 (NUMERICS.md has the cycles). All zeros: nothing
 * found yet, as in the first frame of a contact. */
#define FIT_WATCH_FRAMES 128
#define FIT_WATCH_LEAST 8
struct fit_watch {
  uint32_t usable;   /* of these sensors */
  uint32_t left_out; /* bitmap of at most one */
  uint16_t frames;   /* that it still stands for */
  float residual_rms_Pa, force_N;
  struct fit_result without; /* room of a search */
};

/* fit_gaussian and fit_gaussian_grid for frames that follow each other. */
void fit_gaussian_follow(const struct fit_array *array, const int32_t *pressure_Pa_q10, uint32_t usable,
                         const struct fit_settings *settings, struct fit_watch *watch, struct fit_result *result);
void fit_gaussian_grid_follow(const struct fit_array *array, const int32_t *pressure_Pa_q10, uint32_t usable,
                              const struct fit_settings *settings, struct fit_watch *watch, struct fit_result *result);

/* sqrt((a b)^2 + (c d)^2) within 0.1 %, for standard deviations: some 800 cycles less than in soft
 * float, and the same bits everywhere. All are finite and not negative; at most 1e9. */
float fit_quadrature(float a, float b, float c, float d);

/* The kernels behind fit_gaussian, to compare them.
 *
 * fit_grid: fixed point, for a full rectangle of FIT_GRID_COLUMNS x FIT_GRID_ROWS nodes (of the
 * build, 2 to 6 each way) with every sensor usable; sigma from 0.216 pitch.
 * fit_grid_masked: the same with any sensors missing, at twice the cost. It also takes a full
 * rectangle whose width, known by the prior, is below FIT_SHAPE_LEAST pitches and has a dip.
 * fit_general: float32, any positions, any sensors missing; leaves an outlier out by itself.
 * The former two return whether they have settled with residuals that look like an outlier: rough,
 * and more than noise, gains and model explain. */
bool fit_grid(const struct fit_array *array, const int32_t *pressure_Pa_q10, const struct fit_settings *settings,
              struct fit_result *result);
bool fit_grid_masked(const struct fit_array *array, const int32_t *pressure_Pa_q10, uint32_t usable,
                     const struct fit_settings *settings, struct fit_result *result);
void fit_general(const struct fit_array *array, const int32_t *pressure_Pa_q10, uint32_t usable,
                 const struct fit_settings *settings, struct fit_result *result);

#endif
