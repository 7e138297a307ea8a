// A tangential force on a contact, and its pressure on the base (traction_table.hpp), given the planes of a sliding contact.
#pragma once

#include "simulation/twin/force_planes.hpp"

#include <algorithm>

namespace fingertip::twin {

struct TractionLoad {
  double force_N, stuck_N; // F, S
  double x_N, y_N;         // Q, along the indenter's own axes
};

// What stays without sliding when the tangential force has risen to this at a constant normal one; 0 if all slides.
inline double stuck_force_N(double force_N, double tangential_N, double friction) {
  return std::max(0.0, force_N - tangential_N / friction);
}

// The pressure at dx, dy from the middle of the contact, along the same axes. along_x, along_y: under a traction p along that axis, Pa.
double traction_pressure_Pa(const ForcePlanes &along_x, const ForcePlanes &along_y, const TractionLoad &load, double dx_mm, double dy_mm);

} // namespace fingertip::twin
