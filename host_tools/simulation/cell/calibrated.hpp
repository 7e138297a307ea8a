// What a fingertip of the cell would have stored.
#pragma once

#include "libfingertip/random.hpp"
#include "libfingertip/wire.hpp"
#include "simulation/cell/face.hpp"

namespace fingertip::cell {

// Gains that are known to within gain_sd, and a force scale.
inline calibration calibrated(const Pressures &gain, double gain_sd, double force_scale, double force_scale_sd, Random &random) {
  calibration stored{};
  stored.placements = 20;
  stored.force_scale = static_cast<float>(force_scale);
  stored.force_scale_sd = static_cast<float>(force_scale_sd);
  for (std::size_t k = 0; k < SENSORS; k++) {
    stored.sensors[k].gain = static_cast<float>(gain[k] * (1.0 + gain_sd * random.normal()));
    stored.sensors[k].gain_sd = static_cast<float>(gain_sd);
  }
  return stored;
}

} // namespace fingertip::cell
