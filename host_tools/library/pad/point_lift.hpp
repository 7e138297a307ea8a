// A layer (layer.hpp) with one point of its base lifted. The base moves by a unit of volume (1
// mm^3) upwards at r = 0 and nowhere else. The surface is free.
//
// Betti's theorem: the surface's displacement there is the pressure of that point of the base per
// force on the surface (block.hpp). This header gives the stress inside. An infinite layer holds
// itself with that stress. A block with free sides lacks it.
//
// Waves of a lift exp(i k . x) have two parts. The first is the displacement of a half-space above
// the base, in closed form,
//   u_z = (1 + k z / b) exp(-k z),  u_r = -k z / b exp(-k z),  b = 3 - 4 nu
// The rest has no displacement at the base, and takes the stress from the surface: (1, -+1) exp(-+k
// z) and the terms of Papkovich and Neuber, with four constants for each k. The rest falls as
// exp(-k h), so its integrals over k are short.
#pragma once

#include "library/pad/layer.hpp"

#include <vector>

namespace fingertip::twin {

class PointLift {
public:
  // At these heights above the base (0..thickness), for distances from r_min_mm to r_max_mm.
  PointLift(const Layer &layer, std::vector<double> heights_mm, double r_max_mm);

  // Per shear modulus and per unit of volume lifted, 1 / mm^3.
  struct Stress {
    double rr, tt, rz; // along r, around the axis, shear
  };
  // r_mm > 0.
  Stress stress(double r_mm, std::size_t height) const;

private:
  struct Parts { // of the displacement's derivatives
    double volume, plane, stretch, shear;
  };
  Parts half_space(double r_mm, double z_mm) const;

  double poisson_;
  std::vector<double> heights_mm_;
  std::vector<Parts> rest_; // [height][distance]
  std::size_t distances_;
};

} // namespace fingertip::twin
