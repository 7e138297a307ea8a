#include "simulation/cell/face.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip::cell {

Face::Face(const std::string &name, const std::filesystem::path &cache)
    : table_(twin::ContactTable::load_or_build(twin::indenter(name), twin::silicone(LAYER_mm), cache)),
      traction_(table_, twin::silicone(LAYER_mm)) {}

Pressures Face::base_Pa(const Patch &patch) const {
  Pressures base_Pa(SENSORS);
  if (!(patch.force_N > 0.0)) {
    return base_Pa;
  }
  // Nodes in the middle of equal parts; their weights give the centre of pressure.
  struct Node {
    double u_mm, v_mm, weight;
  };
  const auto parts = [](double mm) { return static_cast<int>(std::ceil(mm / NODE_mm + 0.5)); };
  const int along = parts(patch.length_mm), across = parts(patch.width_mm);
  const double a_mm = 0.5 * patch.length_mm, b_mm = 0.5 * patch.width_mm;
  std::vector<Node> nodes;
  double sum = 0.0;
  for (int i = 0; i < along; i++) {
    for (int j = 0; j < across; j++) {
      const double u = a_mm * ((2 * i + 1.0) / along - 1.0), v = b_mm * ((2 * j + 1.0) / across - 1.0);
      const double held_in =
          2.0 / (LAYER_mm * LAYER_mm) * (a_mm * a_mm - u * u) * (b_mm * b_mm - v * v) / std::max(a_mm * a_mm + b_mm * b_mm, 1e-9);
      nodes.push_back({u, v, 1.0 + held_in});
      sum += nodes.back().weight;
    }
  }
  double uu = 0.0, vv = 0.0;
  for (Node &node : nodes) {
    node.weight /= sum;
    uu += node.weight * node.u_mm * node.u_mm;
    vv += node.weight * node.v_mm * node.v_mm;
  }
  const double tilt_u = uu > 0.0 ? patch.off_length_mm / uu : 0.0, tilt_v = vv > 0.0 ? patch.off_width_mm / vv : 0.0;
  sum = 0.0;
  for (Node &node : nodes) {
    node.weight *= std::max(1.0 + tilt_u * node.u_mm + tilt_v * node.v_mm, 0.0);
    sum += node.weight;
  }
  const double c = std::cos(patch.angle_rad), s = std::sin(patch.angle_rad);
  for (const Node &node : nodes) {
    const double share = node.weight / sum;
    if (share > 0.0) {
      const double u = node.u_mm - patch.off_length_mm, v = node.v_mm - patch.off_width_mm;
      add({share * patch.force_N, patch.x_mm + c * u - s * v, patch.y_mm + s * u + c * v, patch.angle_rad, share * patch.pull_x_N,
           share * patch.pull_y_N, share * patch.stuck_N},
          base_Pa);
    }
  }
  return base_Pa;
}

void Face::add(const twin::Touch &touch, Pressures &base_Pa) const {
  const double c = std::cos(touch.angle_rad), s = std::sin(touch.angle_rad);
  const twin::TractionLoad load{touch.force_N, touch.stuck_N, c * touch.pull_x_N + s * touch.pull_y_N,
                                c * touch.pull_y_N - s * touch.pull_x_N};
  for (std::size_t k = 0; k < SENSORS; k++) {
    const double dx = static_cast<double>(geometry.x_mm[k]) - touch.x_mm;
    const double dy = static_cast<double>(geometry.y_mm[k]) - touch.y_mm;
    const double x = c * dx + s * dy, y = c * dy - s * dx;
    base_Pa[k] += table_.base_pressure_Pa(touch.force_N, x, y) + traction_.base_pressure_Pa(load, x, y);
  }
}

} // namespace fingertip::cell
