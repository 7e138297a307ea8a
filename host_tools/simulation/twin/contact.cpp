#include "simulation/twin/contact.hpp"

#include "simulation/twin/transform.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace fingertip::twin {

constexpr double FINE_STEP_mm = 0.25, STEP_mm = 0.5;
// Wider ones press a wider area: the base cannot resolve the finer step.
constexpr double SMALL_REACH_mm = 5.0;
constexpr double TABLE_REACH_mm = 45.0;
constexpr double ROOM_THICKNESSES = 3.0;
constexpr int STEPS_MAX = 2000;
// Change of the pressure in one step, relative to the force.
constexpr double SETTLED = 1e-7;
// Of gaps, relative to the approach: solutions settle at some 1e-7, or, of few nodes, at rounding: 1e-15.
constexpr double EVEN = 1e-12;

Grid grid_for(const Indenter &indenter, const Layer &layer) {
  const double half_mm = std::max(TABLE_REACH_mm, indenter.reach_mm()) + ROOM_THICKNESSES * layer.thickness_mm;
  const double step_mm = indenter.reach_mm() < SMALL_REACH_mm ? FINE_STEP_mm : STEP_mm;
  int nodes = 32;
  while (nodes * step_mm < 2.0 * half_mm) {
    nodes += 32;
  }
  return {nodes, step_mm};
}

// About the middle, with room between the images of what can touch for what each node does to each other.
static Grid near_grid(const Indenter &indenter, const Grid &grid) {
  const int reach = static_cast<int>(indenter.reach_mm() / grid.step_mm) + 1;
  return {std::min((4 * reach + 16) / 16 * 16, grid.nodes), grid.step_mm};
}

struct ContactSolver::Work {
  Grid grid, near;
  std::size_t nodes2, near2;
  Transform transform, near_transform;
  std::vector<double> height_mm;                   // of the indenter, infinite where it has no surface; near
  std::vector<double> compliance, near_compliance; // mm per Pa of each wave, the transforms' norm in it
  std::vector<double> transfer;                    // to the base
  std::vector<double> pressure_Pa;                 // near
  double yield_mm_Pa;                              // of one node under its own pressure

  Work(const Indenter &indenter, const Layer &layer, const Grid &g)
      : grid(g), near(near_grid(indenter, g)), nodes2(std::size_t(g.nodes) * std::size_t(g.nodes)),
        near2(std::size_t(near.nodes) * std::size_t(near.nodes)), transform(g.nodes), near_transform(near.nodes), height_mm(near2),
        compliance(transform.waves()), transfer(transform.waves()), pressure_Pa(near2, 0.0) {
    const double unit = 2.0 * M_PI / (g.nodes * g.step_mm); // per mm
    const double nu = layer.poisson, norm = 1.0 / static_cast<double>(nodes2);
    const double of_layer = 2.0 * (1.0 - nu * nu) / layer.youngs_modulus_Pa;
    const double of_body = indenter.youngs_modulus_Pa > 0.0 ? 2.0 * (1.0 - nu * nu) / indenter.youngs_modulus_Pa : 0.0;
    for (int i = 0; i < g.nodes; i++) {
      for (int j = 0; j <= g.nodes / 2; j++) {
        const double k = unit * std::hypot(transform.i_of(i), j), h = layer.thickness_mm;
        const std::size_t n = std::size_t(i) * std::size_t(g.nodes / 2 + 1) + std::size_t(j);
        compliance[n] = norm * of_layer * h * surface_compliance(k * h, nu);
        if (k > 0.0) { // the mean of a half-space's displacement is a matter of definition
          compliance[n] += norm * of_body / k;
        }
        transfer[n] = norm * base_transfer(k * h, nu);
      }
    }
    std::vector<double> one(nodes2, 0.0), answer_mm(near2);
    one.front() = 1.0;
    const double *sunk_mm = transform.apply(one, compliance);
    yield_mm_Pa = sunk_mm[0];
    for (int i = 0; i < near.nodes; i++) {
      for (int j = 0; j < near.nodes; j++) {
        const std::size_t n = std::size_t(i) * std::size_t(near.nodes) + std::size_t(j);
        height_mm[n] = indenter.profile_mm((i - near.nodes / 2) * g.step_mm, (j - near.nodes / 2) * g.step_mm);
        answer_mm[n] = sunk_mm[at(near_transform.i_of(i), near_transform.i_of(j))];
      }
    }
    near_compliance = near_transform.response_of(answer_mm);
  }

  // The node i, j from [0][0]; of the periodic grid.
  std::size_t at(int i, int j) const {
    return std::size_t((i + grid.nodes) % grid.nodes) * std::size_t(grid.nodes) + std::size_t((j + grid.nodes) % grid.nodes);
  }
};

ContactSolver::ContactSolver(const Indenter &indenter, const Layer &layer, const Grid &grid)
    : work_(std::make_unique<Work>(indenter, layer, grid)) {}
ContactSolver::~ContactSolver() = default;

std::vector<double> ContactSolver::displacement_mm(const std::vector<double> &pressure_Pa) {
  const double *sunk_mm = work_->transform.apply(pressure_Pa, work_->compliance);
  return {sunk_mm, sunk_mm + work_->nodes2};
}

Contact ContactSolver::solve(double force_N) {
  Work &w = *work_;
  const double area_m2 = 1e-6 * w.grid.step_mm * w.grid.step_mm;
  std::vector<double> &p = w.pressure_Pa;
  std::vector<double> gap(w.near2), direction(w.near2, 0.0);

  double sum = 0.0;
  for (double value : p) {
    sum += value;
  }
  if (sum <= 0.0) { // anywhere that can touch at all
    for (std::size_t n = 0; n < w.near2; n++) {
      p[n] = std::isfinite(w.height_mm[n]) ? 1.0 : 0.0;
      sum += p[n];
    }
  }
  for (double &value : p) {
    value *= force_N / (area_m2 * sum);
  }

  double before = 1.0, approach_mm = 0.0;
  bool conjugate = false;
  for (int step = 1; step <= STEPS_MAX; step++) {
    const double *sunk_mm = w.near_transform.apply(p, w.near_compliance);
    double mean = 0.0;
    std::size_t touching = 0;
    for (std::size_t n = 0; n < w.near2; n++) {
      gap[n] = sunk_mm[n] + w.height_mm[n];
      if (p[n] > 0.0) {
        mean += gap[n];
        touching++;
      }
    }
    mean /= static_cast<double>(touching);
    approach_mm = mean;
    double square = 0.0;
    for (std::size_t n = 0; n < w.near2; n++) {
      gap[n] -= mean;
      square += p[n] > 0.0 ? gap[n] * gap[n] : 0.0;
    }
    const double share = conjugate ? square / before : 0.0;
    before = square;
    for (std::size_t n = 0; n < w.near2; n++) {
      direction[n] = p[n] > 0.0 ? gap[n] + share * direction[n] : 0.0;
    }
    const double *answer_mm = w.near_transform.apply(direction, w.near_compliance);
    double mean_response = 0.0;
    for (std::size_t n = 0; n < w.near2; n++) {
      mean_response += p[n] > 0.0 ? answer_mm[n] : 0.0;
    }
    mean_response /= static_cast<double>(touching);
    double along = 0.0, curvature = 0.0;
    for (std::size_t n = 0; n < w.near2; n++) {
      if (p[n] > 0.0) {
        along += gap[n] * direction[n];
        curvature += (answer_mm[n] - mean_response) * direction[n];
      }
    }
    // Of gaps that are even but for rounding, as that of one node alone, a length is noise; but those that overlap shall still join.
    const double length = std::sqrt(square) > EVEN * mean ? along / curvature : 1.0 / w.yield_mm_Pa;
    double change = 0.0;
    conjugate = true;
    sum = 0.0;
    for (std::size_t n = 0; n < w.near2; n++) {
      const double old = p[n];
      if (p[n] > 0.0) {
        p[n] = std::max(0.0, p[n] - length * direction[n]);
      }
      if (p[n] == 0.0 && gap[n] < 0.0) { // it overlaps: touches from here on
        p[n] = -length * gap[n];
        conjugate = false;
      }
      sum += p[n];
      change += std::abs(p[n] - old);
    }
    const double scale = force_N / (area_m2 * sum);
    for (double &value : p) {
      value *= scale;
    }
    if (change * area_m2 < SETTLED * force_N && conjugate) {
      Contact contact{force_N, approach_mm, 0.0, step, std::vector<double>(w.nodes2, 0.0), {}};
      const int from = w.grid.nodes / 2 - w.near.nodes / 2;
      for (std::size_t n = 0; n < w.near2; n++) {
        contact.contact_area_mm2 += p[n] > 0.0 ? w.grid.step_mm * w.grid.step_mm : 0.0;
        contact.pressure_Pa[w.at(from + static_cast<int>(n) / w.near.nodes, from + static_cast<int>(n) % w.near.nodes)] = p[n];
      }
      const double *base_Pa = w.transform.apply(contact.pressure_Pa, w.transfer);
      contact.base_Pa.assign(base_Pa, base_Pa + w.nodes2);
      return contact;
    }
  }
  throw std::runtime_error("the contact of " + std::to_string(force_N) + " N did not settle");
}

} // namespace fingertip::twin
