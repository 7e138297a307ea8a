/* A calibration of one pad, as `fingertip calibrate` finds it by pressing the pad with one weight,
 * and as the packets carry it and the fingertip keeps it.
 */
#ifndef COMMON_CALIBRATION_H
#define COMMON_CALIBRATION_H

#include "common/limits.h"

#include <stdbool.h>
#include <stdint.h>

struct sensor_calibration {
  float gain;    /* sensitivity relative to the pad's mean: pressure = reading / gain */
  float gain_sd; /* relative standard deviation */
};

struct calibration {
  uint32_t date_s;      /* Unix time */
  uint16_t placements;  /* of the weight that entered */
  float force_scale;    /* force is this times 2 pi p0 sigma^2 */
  float force_scale_sd; /* standard deviation of force_scale */
  struct sensor_calibration sensors[FT_MAX_SENSORS];
};

/* Ranges. Cast pads spread by 5 to 10 %; a gain beyond these is no sensor under rubber. */
#define CALIBRATION_GAIN_MIN 0.25f
#define CALIBRATION_GAIN_MAX 4.0f
#define CALIBRATION_GAIN_SD_MAX 0.5f /* from 0 */
#define CALIBRATION_FORCE_SCALE_MIN 0.1f
#define CALIBRATION_FORCE_SCALE_MAX 10.0f
#define CALIBRATION_FORCE_SCALE_SD_MAX 1.0f /* from 0 */

/* Every value of it, for the first sensor_count sensors, is finite and in its range. */
bool calibration_is_valid(const struct calibration *calibration, unsigned sensor_count);

#endif
