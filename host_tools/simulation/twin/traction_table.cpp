#include "simulation/twin/traction_table.hpp"

#include "simulation/twin/transform.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

namespace fingertip::twin {
namespace {

constexpr int FORCES = ForcePlanes::FORCES, NODES = ForcePlanes::NODES;
// A quadrant and its mirrors: the last node of each is shared.
constexpr int SIDE = 2 * (NODES - 1);

enum class Axis { x, y };

// Base pressure under a traction along an axis per base pressure under the like pressure, and the transforms' norm.
std::vector<std::complex<double>> response(const Transform &transform, const Layer &layer, Axis axis) {
  const double unit = 2.0 * M_PI / (SIDE * ForcePlanes::STEP_mm); // per mm
  std::vector<std::complex<double>> made(transform.waves());
  for (int row = 0; row < SIDE; row++) {
    for (int j = 0; j <= SIDE / 2; j++) {
      const int i = transform.i_of(row), along = axis == Axis::x ? i : j;
      const double k = std::hypot(i, j);
      // The shortest waves look like their mirrors: they have no direction.
      const bool directed = along != 0 && along != SIDE / 2;
      const double share = tangential_share(unit * k * layer.thickness_mm, layer.poisson);
      made[std::size_t(row * (SIDE / 2 + 1) + j)] = {0.0, directed ? -along / k * share / (double(SIDE) * SIDE) : 0.0};
    }
  }
  return made;
}

} // namespace

TractionTable::TractionTable(const ContactTable &table, const Layer &layer) {
  using Symmetry = ForcePlanes::Symmetry;
  Transform transform(SIDE);
  const auto of_axis = [&](Axis axis) {
    const std::vector<std::complex<double>> answer = response(transform, layer, axis);
    std::vector<float> values;
    values.reserve(FORCES * ForcePlanes::PLANE);
    std::vector<double> pressure(std::size_t(SIDE) * SIDE);
    for (int f = 0; f < FORCES; f++) {
      for (int i = 0; i < SIDE; i++) {
        for (int j = 0; j < SIDE; j++) {
          pressure[std::size_t(i * SIDE + j)] = table.pressure().node(f, std::min(i, SIDE - i), std::min(j, SIDE - j));
        }
      }
      const double *base = transform.apply(pressure, answer);
      for (int i = 0; i < NODES; i++) {
        for (int j = 0; j < NODES; j++) {
          values.push_back(static_cast<float>(base[i * SIDE + j]));
        }
      }
    }
    return values;
  };
  along_x_ = {of_axis(Axis::x), Symmetry::odd, Symmetry::even};
  along_y_ = {of_axis(Axis::y), Symmetry::even, Symmetry::odd};
}

} // namespace fingertip::twin
