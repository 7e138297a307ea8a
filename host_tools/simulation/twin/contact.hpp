// Frictionless contact of an indenter with a layer at a given force, and the pressure that reaches the base.
//
// Solved on a square periodic grid by conjugate gradients on the pressure with the surface compliance applied by
// Fourier transform (Polonsky and Keer, "A numerical method for solving rough contact problems based on the multi-level
// multi-summation and conjugate gradient techniques", Wear 231, 1999). A bonded layer forgets a load within a few
// thicknesses, so the periodic images need no more than room; what they do is measured by the tests. A soft indenter's
// own half-space reaches further: there the images change the share of load by some 1 %.
#pragma once

#include "library/pad/layer.hpp"
#include "simulation/twin/indenter.hpp"

#include <memory>
#include <vector>

namespace fingertip::twin {

struct Grid {
  int nodes;      // along each side; a product of small primes is fast
  double step_mm; // node (i, j) lies at ((i - nodes / 2) step, (j - nodes / 2) step)
};

// Side long enough for the footprint and three thicknesses on either side, and the reach of a table.
Grid grid_for(const Indenter &indenter, const Layer &layer);

struct Contact {
  double force_N;
  double indentation_mm;
  double contact_area_mm2;
  int iterations;
  std::vector<double> pressure_Pa; // [i * nodes + j], on the surface
  std::vector<double> base_Pa;     // the same, on the base
};

// One indenter on one layer, for forces one after the other. Each solution starts from the last. Not to be shared between threads.
class ContactSolver {
public:
  ContactSolver(const Indenter &indenter, const Layer &layer, const Grid &grid);
  ~ContactSolver();
  // force_N > 0. Throws std::runtime_error where the pressure does not settle within 2000 steps.
  Contact solve(double force_N);
  // Downward, under this pressure on the surface: that of the layer and of the indenter's own body
  // together. Of a body's part only differences mean anything.
  std::vector<double> displacement_mm(const std::vector<double> &pressure_Pa);

private:
  struct Work;
  std::unique_ptr<Work> work_;
};

} // namespace fingertip::twin
