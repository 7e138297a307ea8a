/* The data of the fit: the array, its settings, its result, and what it keeps from frame to frame. */
#pragma once

#include "common/limits.h"

#include <stdbool.h>
#include <stdint.h>

/* Widths that the fit can estimate, in pitches: narrower ones fall between the sensors, wider ones have no location on the array. */
#define FIT_SIGMA_MIN 0.158f
#define FIT_SIGMA_MAX 5.0f

/* Nodes of a rectangle along one axis, at most. */
#define FIT_GRID_MAX_SIDE 6

/* The fixed-point kernels take the rectangle of FIT_GRID_COLUMNS x FIT_GRID_ROWS sensors that they are compiled for;
 * with FIT_GRID_ANY instead, as for the host, each call takes that of its array, and gives the same bits more slowly. */
#ifdef FIT_GRID_ANY
#define FIT_GRID_MAX_NODES FT_MAX_SENSORS
#else
#define FIT_GRID_MAX_NODES (FIT_GRID_COLUMNS * FIT_GRID_ROWS)
#endif

/* A full rectangle of sensors, for the fixed-point kernels. */
struct fit_grid_shape {
  uint8_t columns, rows;               /* nodes along x and y, 2..FIT_GRID_MAX_SIDE; 0: no grid */
  uint8_t sensor[FT_MAX_SENSORS];      /* [column * rows + row] */
  int32_t x_min, x_max;                /* box of the location, Q26 pitches from node (columns / 2, */
  int32_t y_min, y_max;                /* rows / 2) */
  int32_t pitch, pitch_exponent;       /* the pitch is pitch * 2^(pitch_exponent - 6) mm */
  int32_t x_origin, y_origin;          /* that node, 2^pitch_exponent mm */
  int32_t force_scale, force_exponent; /* 2 pi 1e-6 pitch^2, mantissa * 2^exponent */
  int32_t settled_square;              /* half the square of the settled step, Q22 pitches */
};

/* The array. fit_array_init fills it; it is read-only afterwards. */
struct fit_array {
  uint8_t sensor_count;
  float pitch_mm;
  float x[FT_MAX_SENSORS], y[FT_MAX_SENSORS]; /* [sensor], pitches */
  float x_min, x_max, y_min, y_max;           /* box of the location: the array and 1.5 pitches around it */
  bool is_line;                               /* the sensors lie on x line_x + y line_y = line_offset, and */
  float line_x, line_y, line_offset;          /* (line_x, line_y) is of unit length */
  struct fit_grid_shape grid;
};

/* How a sensor differs from the others, besides its gain: its offset from its place in the array, and the width of its response. */
struct fit_deviation {
  int32_t off_x_q15, off_y_q15; /* pitches; within +-1, as the next */
  int32_t wider_q15;            /* log of its width over theirs */
};

struct fit_settings {
  uint8_t iterations;   /* 0 (the guess)..FIT_MAX_ITERATIONS; 4 come as near to the truth as more
                           do, 7 bring 99.9 % of observable presses within 1 um of the optimum */
  int32_t noise_Pa_q10; /* rms noise of a reading, 1/1024 Pa; below 1 there is no fit */
  /* Weak prior on sigma, for rubber so stiff that the array can hardly determine it: one more row FIT_PRIOR_WEIGHT
   * largest (sigma - prior_sigma) / prior_width. None unless the width is 0.001..10000 mm and sigma 0..10000 mm. */
  float prior_sigma_mm, prior_width_mm;
  /* A reading more than clip_below_sds noise_Pa below zero counts as zero, since a Gaussian is never negative. 0: no
   * reading is changed, as a tangential force asks for. */
  uint8_t clip_below_sds;
  /* What the rubber takes from the readings around a contact, where that is known: dip_share p0 exp(-r^2 / (2 dip_sd^2)). Readings are not
   * cut then. None unless the share is above 0 and at most FIT_DIP_SHARE_MAX, and the sd is 0.001..10000 mm. */
  float dip_share, dip_sd_mm;
  /* [sensor] or NULL: not known. The fit corrects each reading by it to first order, by at most half of the model there, before the last
   * two of three and more iterations. */
  const struct fit_deviation *deviations;
  /* Other errors that the standard deviations contain. */
  uint16_t gain_sd_q16[FT_MAX_SENSORS];         /* [sensor] relative sd of its gain; 0: exact */
  int32_t hysteresis_sd_Pa_q10[FT_MAX_SENSORS]; /* [sensor] sd of the hysteresis of its rubber, before gains, 1/1024 Pa; 0..2^29 */
  uint16_t model_sd_q16;                        /* sd of the model's own error, as a share of the largest reading; 0: none */
  float location_sd_limit_mm;                   /* UNCERTAIN above it; 0: FIT_LOCATION_SD_LIMIT_mm */
};
#define FIT_LOCATION_SD_LIMIT_mm 0.6f
#define FIT_PRIOR_WEIGHT 0.01f
#define FIT_DIP_SHARE_MAX 0.1f
#define FIT_MAX_ITERATIONS 20

/* Every member is finite, whatever the input. Where FIT_VALID is off all but the flags are zero. */
struct fit_result {
  float x_mm, y_mm;
  float p0_Pa;
  float sigma_mm;
  float force_N;           /* 2 pi p0 sigma^2 */
  float residual_rms_Pa;   /* over the sensors used */
  float location_sd_mm;    /* radial: 63 % of errors are smaller, 98 % smaller than twice it; without
                              what a tangential force does, which fit_bias.h adds */
  float location_noise_mm; /* what of it is noise: how far a contact at rest jitters */
  float force_sd_N;
  float sigma_x_mm, sigma_y_mm; /* WIDTHS_VALID: of an elliptic Gaussian, along the axes */
  float width_correlation;      /* and its correlation, -1..1: 0 unless it lies aslant */
  sensor_map used;              /* bitmap of the sensors that entered */
  uint32_t flags;               /* of enum contact_flag: FIT_VALID, UNCERTAINTY_VALID, LOW_SIGNAL, FLAT,
                                   UNCERTAIN, MODEL, AT_BOUND, SENSOR_MASKED, WIDTHS_VALID, ELONGATED */
};

/* Result of the search for an outlier, valid for FIT_OUTLIER_FRAMES frames of the same sensors. An outlier is left out at once; where there
 * was none, the fit does not search. After FIT_OUTLIER_RETRY_FRAMES, residuals that have grown by half, relative to the force, begin
 * another search (NUMERICS.md, "Outliers"). All zeros: no search yet. */
#define FIT_OUTLIER_FRAMES 128
#define FIT_OUTLIER_RETRY_FRAMES 8
struct fit_outlier_state {
  sensor_map usable;  /* of these sensors */
  sensor_map outlier; /* bitmap of at most one */
  uint16_t frames;    /* for which it is still valid */
  float residual_rms_Pa, force_N;
  struct fit_result refit; /* working memory of a search */
};
