// A rubber block bonded to a rigid base, its sides and its top free. The result is the pressure at one point of the
// base under a load on the surface. Linear elasticity at small strain, as layer.hpp, but the block ends.
//
// Betti's theorem: displace one point of the base alone. The surface's displacement at (x, y) along a force is then the
// pressure of that point per force at (x, y). So one solution for each point answers every load. The solver computes
// only the difference from the infinite layer: it takes the stress of PointLift (block.cpp) from the block's sides. The
// point itself, where all is singular, is not in the equations. The remainder is smooth except at the edges along the
// base, where held rubber and free rubber meet (displacement there goes with the distance to the power of 0.6).
//
// Elements have a high degree, on a grid of lines that is dense at the sides and the base. At degree 6 rubber of nu = 0.49 does not lock.
// Each displacement is written in products of the three lines' own modes. In these all but the coupling of the three displacements is
// diagonal. Conjugate gradients do the rest. Symmetry leaves a quarter of the block, four times.
//
// Cost of six points on two processors: 2 s for 12 mm and 9 mm beyond the outer sensors, 31 s for 4 mm and 20 mm. Error
// against smaller elements of a higher degree, anywhere on the surface, in parts of the layer's peak under that load:
//   12 mm and 9 mm   1e-4
//   with 4.5 mm      4e-4, where the difference itself reaches three peaks at the corner
//   20 mm and 3 mm   4e-3 of eleven
// Elements of twenty nodes under loads on the surface agree to 0.1 % of the peak, 0.5 % near a
// corner. The base carries the load's force and moment to 1 %.
//
// Left out: large strain, the sensors' own stiffness in the base, a base that ends or bends, rounded or cast edges.
#pragma once

#include "library/pad/layer.hpp"

#include <array>
#include <functional>
#include <vector>

namespace fingertip::twin {

struct Place {
  double x_mm, y_mm;
};

struct Block {
  Layer layer;
  double half_x_mm, half_y_mm; // it ends at +- these
};

struct BlockGrid {
  int degree = 6;
  // The largest elements, at most this share of the thickness; the ones at the edges; how much larger each next is.
  double element_mm = 8.0, element_thicknesses = 0.7, edge_thicknesses = 0.02, growth = 4.0;
};

// The pressure of a point of the base in the block, less that in the layer without end.
struct BlockAnswer {
  // Lines along x and y, equally spaced from side to side.
  int nodes_x, nodes_y;
  // [x][y], pressure per force: Pa / N under a force down, along x, along y.
  std::vector<float> down, along_x, along_y;
};

// The four of equally spaced nodes around a place, in steps from the first node, and their weights.
struct Cubic {
  int first;
  std::array<double, 4> weight;
};
Cubic cubic_at(double at, int nodes);

// Lines from -half_mm to half_mm, at most step_mm apart.
int block_nodes(double half_mm, double step_mm);

// Solves for each place on the base; one closer than 3 mm to a side needs smaller elements. Runs on all processors. on_progress gets the
// share done, on the calling thread, and 1 in the end. Throws std::runtime_error if conjugate gradients do not end.
std::vector<BlockAnswer> solve_block(const Block &block, const std::vector<Place> &places, double step_mm, const BlockGrid &grid = {},
                                     const std::function<void(double)> &on_progress = {});

} // namespace fingertip::twin
