// What a contact does to the base around it, for any force and place: planes of values at equal
// steps of the logarithm of the force, cubic between nodes and between planes.
//
// Forces 0..50 N; below 0.02 N a contact is as if at 0.02 N. Places up to 45 mm away; beyond, there is nothing.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace fingertip::twin {

class ForcePlanes {
public:
  static constexpr double FORCE_MIN_N = 0.02, FORCE_MAX_N = 50.0;
  static constexpr double REACH_mm = 45.0;
  static constexpr int FORCES = 20;
  static constexpr double STEP_mm = 0.5;
  // One node more than the reach on the far side, for the cubic.
  static constexpr int NODES = static_cast<int>(REACH_mm / STEP_mm) + 2;
  static constexpr std::size_t PLANE = std::size_t(NODES) * std::size_t(NODES);
  static double force_at(int n); // 0..FORCES-1

  enum class Symmetry { even, odd };
  ForcePlanes() = default;
  // values: [force][x][y] for x, y from 0 on, per newton; as many along x as along y, so far apart.
  ForcePlanes(std::vector<float> values, Symmetry in_x, Symmetry in_y, double step_mm = STEP_mm, int nodes = NODES)
      : values_(std::move(values)), in_x_(in_x), in_y_(in_y), step_mm_(step_mm), nodes_(nodes) {}

  // The value at dx, dy from the middle of the contact; for the whole force.
  double at(double force_N, double dx_mm, double dy_mm) const;
  double node(int force, int i, int j) const;
  // Interpolates one value for each force.
  static double between_forces(const std::vector<float> &values, double force_N);

private:
  std::vector<float> values_;
  Symmetry in_x_ = Symmetry::even, in_y_ = Symmetry::even;
  double step_mm_ = STEP_mm;
  int nodes_ = NODES;
};

} // namespace fingertip::twin
