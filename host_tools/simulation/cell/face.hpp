// What a fingertip's rubber meets: a patch of an object, its pressures from the twin's tables.
//
// A face is one of the twin's indenters (twin/indenter.hpp) on a layer without end, and what the
// sensors feel of it wherever it is and however it pulls. A line or an area is as many of them side by
// side: the base's pressures add up, and rubber as thick as their distance does not resolve them. On an area wider than the layer the
// middle carries more, as Gent and Lindley's bonded block does ("The compression of bonded rubber blocks", Proc. Inst. Mech. Eng. 173,
// 1959; for rectangles Gent and Meinecke, Polymer Eng. Sci. 10, 1970): p = E strain (1 + P), Laplacian of P = -4 / h^2.
#pragma once

extern "C" {
#include "config/geometry.h"
}
#include "libfingertip/random.hpp"
#include "libfingertip/wire.hpp"
#include "simulation/twin/traction_table.hpp"
#include "simulation/twin/trajectory.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace fingertip::cell {

inline const std::size_t SENSORS = geometry.sensor_count;
constexpr double AIR_Pa = 101325.0, LAYER_mm = 12.0; // of rubber
using Pressures = std::vector<double>;               // [sensor] Pa, on the base

// Its place is the centre of pressure, its angle that of its length.
struct Patch : twin::Touch {
  double length_mm = 0.0, width_mm = 0.0;         // both 0: a point
  double off_length_mm = 0.0, off_width_mm = 0.0; // of the centre of pressure from the middle
};

// What a fingertip of the cell would have stored.
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

class Face {
public:
  // Solved once and kept in the cache (contact_table.hpp). Throws std::runtime_error for a name that there is not.
  Face(const std::string &name, const std::filesystem::path &cache);

  Pressures base_Pa(const Patch &patch) const;

private:
  static constexpr double NODE_mm = 11.0; // apart at most

  void add(const twin::Touch &touch, Pressures &base_Pa) const;

  twin::ContactTable table_;
  twin::TractionTable traction_;
};

} // namespace fingertip::cell
