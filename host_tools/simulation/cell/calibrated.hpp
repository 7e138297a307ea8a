// What a fingertip of the cell would have stored.
#pragma once

#include "libfingertip/random.hpp"
#include "libfingertip/wire.hpp"
#include "simulation/cell/face.hpp"

namespace fingertip::cell {

constexpr double GAIN_SD = 0.012; // to which a calibration finds the gains of a cast pad: the report's part truth

// Gains that are known to within gain_sd; forces come out force_gain times the true ones.
inline calibration calibrated(const Pressures &gain, double gain_sd, double force_gain, const pad_profile &profile, Random &random) {
  calibration stored{};
  stored.placements = 20;
  stored.force_scale = static_cast<float>(force_gain) / profile.force_ratio;
  stored.force_scale_sd = 0.02F;
  for (std::size_t k = 0; k < SENSORS; k++) {
    stored.sensors[k].gain = static_cast<float>(gain[k] * (1.0 + gain_sd * random.normal()));
    stored.sensors[k].gain_sd = static_cast<float>(gain_sd);
  }
  return stored;
}

} // namespace fingertip::cell
