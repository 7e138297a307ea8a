// What a calibration found, as the entry points hand it out.
#pragma once

#include "tool/calibration/judge.hpp"

#include <cstdint>
#include <vector>

extern "C" {
#include "fit/fit.h"
}

namespace fingertip::measure {

// What a session ends with, and what the tool would keep of it.
struct calibration {
  std::int32_t state;         // 0: more, 1: good, 2: refused
  char reason[16], text[512]; // text: a sentence, why and what to do
  bool solved;
  bool has_deviations; // the tool would keep `deviations`
  double width_mm, residual_share;
  double prior_sigma_mm, prior_width_mm, dip_share, dip_sd_mm; // as fit_settings has them
  double sigma_sd_mm, dip, dip_sd, position_mm, halves_shape, halves_gauge;
  double force_scale, force_scale_sd; // 0: there is none
  double worst_shape_sd, force_share, ellipse, offset_share, drift_share, slope;
  double wanted_x_mm, wanted_y_mm; // where a placement more would help most
};
// What it found of one sensor.
struct calibrated_sensor {
  double gain, gain_sd, reading_sd; // reading_sd: what the firmware gets as the gain's
  double off_x_mm, off_y_mm, wider;
};

// sensors, deviations: [sensor]; deviations is zeros unless has_deviations. force_N: of each placement.
void describe(const calibrating::Array &layout, const std::vector<calibrating::Placement> &placements,
              const calibrating::Judgement &judgement, double force_N, calibration &found, calibrated_sensor *sensors,
              fit_deviation *deviations);

} // namespace fingertip::measure
