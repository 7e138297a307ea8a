// A rigid flat larger than the pad, which takes hold of all of the rubber's top: nothing moves on
// the base when it slides.
//
// The pad is a block of rubber, PAD_OVERHANG_mm beyond the outer sensors. Pressed flat between two
// plates that hold it, the base has Gent and Lindley's sum of plain compression and of what keeps
// nearly incompressible rubber from being squeezed out ("The compression of bonded rubber blocks",
// Proc. Inst. Mech. Eng. 173, 1959; for rectangles Gent and Meinecke, Polymer Eng. Sci. 10, 1970):
//   p = E strain (1 + P),  Laplacian of P = -4 / h^2, P = 0 at the sides
// Sheared, nothing presses but near the ends, which balance the moment Q h / 2 that a plate which
// does not tilt leaves to the base; it fades inwards as exp(-4.2 s / h), the strip's first
// Papkovich-Fadle root. So a tangential force is hardly measurable.
//
// Approximate: ends of a block as high as a third of its width, whose field is taken as one of
// thin blocks. Left out: tilting, a flat that is not, friction that does not hold the rubber.
#pragma once

#include "library/pad/layer.hpp"

namespace fingertip::cell {

constexpr double PAD_OVERHANG_mm = 9.0;

class Plate {
public:
  Plate(const twin::Layer &layer, double half_x_mm, double half_y_mm);

  double stiffness_N_mm() const { return stiffness_N_mm_; }
  double radius_mm() const; // of the disc of the same area
  // Pressure on the base per force down, along x, along y.
  double normal_Pa_N(double x_mm, double y_mm) const;
  double along_x_Pa_N(double x_mm) const;
  double along_y_Pa_N(double y_mm) const;

private:
  double squeezed(double x_mm, double y_mm) const; // P
  double edge_Pa_N(double half_mm, double at_mm) const;

  double thickness_mm_, half_x_mm_, half_y_mm_;
  double mean_ = 0.0; // of 1 + P
  double stiffness_N_mm_;
};

} // namespace fingertip::cell
