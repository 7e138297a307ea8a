#include "common/calibration.h"

/* False for NaN too. */
static bool is_within(float value, float least, float greatest) { return value >= least && value <= greatest; }

static bool is_to_both_sides(int value, int greatest) { return value >= -greatest && value <= greatest; }

bool calibration_is_valid(const struct calibration *calibration, unsigned sensor_count) {
  bool valid = is_within(calibration->force_scale, CALIBRATION_FORCE_SCALE_MIN, CALIBRATION_FORCE_SCALE_MAX) &&
               is_within(calibration->force_scale_sd, 0.0f, CALIBRATION_FORCE_SCALE_SD_MAX);
  valid = valid && (calibration->sigma_um == 0
                        ? calibration->sigma_sd_um == 0
                        : calibration->sigma_um >= CALIBRATION_SIGMA_MIN_um && calibration->sigma_sd_um >= CALIBRATION_SIGMA_SD_MIN_um);
  valid = valid && calibration->dip_share_q16 <= CALIBRATION_DIP_SHARE_MAX_Q16 &&
          (calibration->dip_share_q16 == 0) == (calibration->dip_sd_um == 0);
  for (unsigned k = 0; k < sensor_count; k++) {
    const struct sensor_calibration *sensor = &calibration->sensors[k];
    valid = valid && is_within(sensor->gain, CALIBRATION_GAIN_MIN, CALIBRATION_GAIN_MAX) &&
            is_within(sensor->gain_sd, 0.0f, CALIBRATION_GAIN_SD_MAX) && is_to_both_sides(sensor->off_x_um, CALIBRATION_OFF_MAX_um) &&
            is_to_both_sides(sensor->off_y_um, CALIBRATION_OFF_MAX_um) && is_to_both_sides(sensor->wider_q15, CALIBRATION_WIDER_MAX_Q15);
  }
  return valid;
}
