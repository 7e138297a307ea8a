/* Fits p0 exp(-((x - xc)^2 + (y - yc)^2) / (2 sigma^2)) to the readings of the array by least
 * squares. The result is location, peak, width and force, and how far they can be trusted.
 *
 * De Clercq et al., RA-L 2022, eq. (2) to (4). Gauss-Newton with a fixed number of iterations from a new first guess for every frame. There
 * is no state between frames and no early exit, so the cost depends on the array alone. Any positions, any subset of sensors.
 *
 * A rectangular grid, with every sensor or without some, takes fixed point. Everything else takes float32. Both use integer exponentials
 * and logarithms, so that a Cortex-M0+, a Cortex-M4F and a PC compute the same bits. Main context only: they divide with port/divide.h.
 *
 * Sensors on a line do not show where a contact lies across it. The fit assumes that its centre is on the line. */
#pragma once

#include "common/status.h"
#include "fit/fit_types.h"

#include <stdbool.h>
#include <stdint.h>

/* The same gain_sd for every sensor, and model_sd: shares of 1, below 1. */
void fit_set_errors(struct fit_settings *settings, float gain_sd, float model_sd);

/* FT_ERR_ARGUMENT: sensor_count outside 1..FT_MAX_SENSORS, pitch outside 0.01..10000 mm, or a position outside +-10000
 * mm. Arrays more than 2^30 / 2^24 .. 2^23 = 64 to 128 pitches off the origin take the general kernel. */
enum ft_status fit_array_init(struct fit_array *array, uint8_t sensor_count, const float *x_mm, const float *y_mm, float pitch_mm);

/* The same for an image that knows its layout. It takes only the rectangle of FIT_GRID_COLUMNS x FIT_GRID_ROWS nodes
 * that the fixed-point kernels are compiled for. Any other is FT_ERR_ARGUMENT too. Use it with fit_gaussian_grid. */
enum ft_status fit_array_init_grid(struct fit_array *array, uint8_t sensor_count, const float *x_mm, const float *y_mm, float pitch_mm);

/* Where residuals are rough, and larger than noise, gains and model explain, the fit searches for an outlier (fit_limits.h) and fits again
 * without it: SENSOR_MASKED and `used` report it. Widths and ELONGATED need every sensor of the grid.
 *
 * pressure_Pa_q10[sensor]: pressure on the pad, 1/1024 Pa, any bits. usable: bitmap of the sensors to use. With fewer
 * than four (of an array on a line, three), or no positive reading, FIT_VALID stays off. */
void fit_gaussian(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable, const struct fit_settings *settings,
                  struct fit_result *result);

/* The same without the general kernel, so that an image does not hold it. */
void fit_gaussian_grid(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable,
                       const struct fit_settings *settings, struct fit_result *result);

/* The same for consecutive frames, with the state of the search for an outlier. */
void fit_gaussian_update(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable,
                         const struct fit_settings *settings, struct fit_outlier_state *outliers, struct fit_result *result);
void fit_gaussian_grid_update(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable,
                              const struct fit_settings *settings, struct fit_outlier_state *outliers, struct fit_result *result);

/* fit_gaussian_grid without the search for an outlier, and also without the kernel for full rectangles: 11 kB less
 * code, 18 000 cycles more for each fit with every sensor, and neither widths nor ELONGATED. */
void fit_gaussian_grid_plain(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable,
                             const struct fit_settings *settings, struct fit_result *result);
void fit_gaussian_grid_small(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable,
                             const struct fit_settings *settings, struct fit_result *result);

/* sqrt((a b)^2 + (c d)^2) within 0.1 %, for standard deviations: some 800 cycles less than soft float takes, and the same bits everywhere.
 * The arguments are finite, not negative, and at most 1e9. */
float fit_quadrature(float a, float b, float c, float d);

/* The kernels behind fit_gaussian, to compare them.
 *
 * fit_grid: fixed point, for a full rectangle of FIT_GRID_COLUMNS x FIT_GRID_ROWS nodes (of the build, 2 to 6 each way)
 * with every sensor usable; sigma from 0.216 pitch. fit_grid_masked: the same with any sensors missing, at twice the
 * cost. It also takes a full rectangle whose width, known by the prior, is below FIT_WIDTHS_SIGMA_MIN pitches and has a dip.
 * fit_general: float32, any positions, any sensors missing; leaves an outlier out by itself. The former two return whether they have
 * settled with residuals that look like an outlier: rough, and more than noise, gains and model explain. */
bool fit_grid(const struct fit_array *array, const int32_t *pressure_Pa_q10, const struct fit_settings *settings,
              struct fit_result *result);
bool fit_grid_masked(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable, const struct fit_settings *settings,
                     struct fit_result *result);
void fit_general(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable, const struct fit_settings *settings,
                 struct fit_result *result);
