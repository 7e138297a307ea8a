/* A calibration of one pad, as `fingertip calibrate` finds it by pressing the pad with one weight, and as the packets
 * carry it and the fingertip keeps it. */
#pragma once

#include "common/limits.h"

#include <stdbool.h>
#include <stdint.h>

struct sensor_calibration {
  float gain;    /* sensitivity relative to the pad's mean: pressure = reading / gain */
  float gain_sd; /* relative standard deviation */
  /* Offset of the sensor from its place in the layout, and the log of the width in which it measures a
   * contact over that of the others, 1/32768; positive: wider. Zeros: not known, none. */
  int16_t off_x_um, off_y_um;
  int16_t wider_q15;
};

struct calibration {
  uint32_t date_s;      /* Unix time */
  uint16_t placements;  /* of the weight that entered */
  float force_scale;    /* force is this times 2 pi p0 sigma^2 */
  float force_scale_sd; /* standard deviation of force_scale */
  /* The pad's response to a usual contact, as the fit is given it (fit.h): a prior on sigma, and the
   * dip around a contact. Zeros: not known, none. */
  uint16_t sigma_um, sigma_sd_um;
  uint16_t dip_share_q16, dip_sd_um;
  /* Of the air in which force_scale was found; 0: not known. The sensors measure absolute pressure,
   * and the scale of a cast pad changes with it. */
  uint8_t ambient_kPa;
  struct sensor_calibration sensors[FT_MAX_SENSORS];
};

/* Ranges. Cast pads spread by 5 to 10 %; a gain beyond these is no sensor under rubber. */
#define CALIBRATION_GAIN_MIN 0.25f
#define CALIBRATION_GAIN_MAX 4.0f
#define CALIBRATION_GAIN_SD_MAX 0.5f   /* from 0 */
#define CALIBRATION_OFF_MAX_um 2000    /* to both sides */
#define CALIBRATION_WIDER_MAX_Q15 9830 /* to both sides: 0.3 */
#define CALIBRATION_FORCE_SCALE_MIN 0.1f
#define CALIBRATION_FORCE_SCALE_MAX 10.0f
#define CALIBRATION_FORCE_SCALE_SD_MAX 1.0f /* from 0 */
#define CALIBRATION_SIGMA_MIN_um 500        /* or 0, and then its sd is 0 too */
#define CALIBRATION_SIGMA_SD_MIN_um 10
#define CALIBRATION_DIP_SHARE_MAX_Q16 6553 /* from 0: a tenth; with its sd, or neither */

/* Every value of it, for the first sensor_count sensors, is finite and in its range. */
bool calibration_is_valid(const struct calibration *calibration, unsigned sensor_count);
