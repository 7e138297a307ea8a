// A second solution of one wave on the layer that shares nothing with the first: Navier's equations
// of plane strain by collocation in Chebyshev's points.
//
// With x = X / h from the base (0) to the surface (1) and H = k h, in multiples of the shear
// modulus G, displacements u = i U(x) exp(i k X), w = W(x) exp(i k X) and m = 1 / (1 - 2 nu):
//   U'' - (1 + m) H^2 U + m H W' = 0         along the layer
//   (1 + m) W'' - H^2 W - m H U' = 0         across it
// bonded at the base. Tension is (m - 1) (W' - H U) + 2 W', shear i (U' + H W).
#pragma once

namespace fingertip::twin {

struct LayerWave {
  double base_per_pressure;  // T: pressure on the base per pressure on the surface
  double sinks_per_pressure; // downward displacement of the surface, h / G
  double base_per_traction;  // Q: the base's pressure is -i Q per traction along k
  double moves_per_traction; // displacement of the surface along k, h / G
};

// order: of the polynomials.
LayerWave solve_layer_wave(double H, double poisson, int order);

} // namespace fingertip::twin
