#include "simulation/twin/traction.hpp"

#include <utility>

namespace fingertip::twin {

double traction_pressure_Pa(const ForcePlanes &along_x, const ForcePlanes &along_y, const TractionLoad &load, double dx_mm, double dy_mm) {
  const double carried_N = load.force_N - load.stuck_N;
  if (!(carried_N > 0.0)) {
    return 0.0;
  }
  double sum = 0.0;
  for (const auto &[share_N, planes] : {std::pair{load.x_N, &along_x}, {load.y_N, &along_y}}) {
    if (share_N != 0.0) {
      sum += share_N / carried_N * (planes->at(load.force_N, dx_mm, dy_mm) - planes->at(load.stuck_N, dx_mm, dy_mm));
    }
  }
  return sum;
}

} // namespace fingertip::twin
