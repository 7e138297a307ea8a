#include "twin/contact.hpp"

#include <algorithm>
#include <cmath>
#include <fftw3.h>
#include <mutex>
#include <stdexcept>
#include <string>

namespace fingertip::twin {
namespace {

constexpr double FINE_STEP_mm = 0.25, STEP_mm = 0.5;
// Wider ones press a wider area: the base cannot tell the finer step.
constexpr double SMALL_REACH_mm = 5.0;
constexpr double TABLE_REACH_mm = 45.0;
constexpr double ROOM_THICKNESSES = 3.0;
constexpr int STEPS_MAX = 2000;
// Change of the pressure in one step, relative to the force.
constexpr double SETTLED = 1e-7;

// Planning in FFTW is not safe in several threads.
std::mutex planning;

} // namespace

Grid grid_for(const Indenter &indenter, const Layer &layer) {
  const double half_mm =
      std::max(TABLE_REACH_mm, indenter.reach_mm()) + ROOM_THICKNESSES * layer.thickness_mm;
  const double step_mm = indenter.reach_mm() < SMALL_REACH_mm ? FINE_STEP_mm : STEP_mm;
  int nodes = 32;
  while (nodes * step_mm < 2.0 * half_mm) {
    nodes += 32;
  }
  return {nodes, step_mm};
}

struct ContactSolver::Work {
  Grid grid;
  std::size_t nodes2, waves;
  std::vector<double> height_mm;  // of the indenter, infinite where it has no surface
  std::vector<double> compliance; // mm per Pa of each wave, the transforms' norm in it
  std::vector<double> transfer;   // to the base, likewise
  std::vector<double> pressure_Pa;
  double yield_mm_Pa; // of one node under its own pressure
  double *real;
  fftw_complex *spectrum;
  fftw_plan forward, backward;

  Work(const Indenter &indenter, const Layer &layer, const Grid &g)
      : grid(g), nodes2(std::size_t(g.nodes) * std::size_t(g.nodes)),
        waves(std::size_t(g.nodes) * std::size_t(g.nodes / 2 + 1)), height_mm(nodes2),
        compliance(waves), transfer(waves), pressure_Pa(nodes2, 0.0), real(fftw_alloc_real(nodes2)),
        spectrum(fftw_alloc_complex(waves)) {
    const std::lock_guard<std::mutex> lock(planning);
    forward = fftw_plan_dft_r2c_2d(g.nodes, g.nodes, real, spectrum, FFTW_ESTIMATE);
    backward = fftw_plan_dft_c2r_2d(g.nodes, g.nodes, spectrum, real, FFTW_ESTIMATE);
    for (int i = 0; i < g.nodes; i++) {
      for (int j = 0; j < g.nodes; j++) {
        height_mm[at(i, j)] =
            indenter.profile_mm((i - g.nodes / 2) * g.step_mm, (j - g.nodes / 2) * g.step_mm);
      }
    }
    const double unit = 2.0 * M_PI / (g.nodes * g.step_mm); // per mm
    const double nu = layer.poisson, norm = 1.0 / static_cast<double>(nodes2);
    const double of_layer = 2.0 * (1.0 - nu * nu) / layer.youngs_modulus_Pa;
    const double of_body =
        indenter.youngs_modulus_Pa > 0.0 ? 2.0 * (1.0 - nu * nu) / indenter.youngs_modulus_Pa : 0.0;
    for (int i = 0; i < g.nodes; i++) {
      for (int j = 0; j <= g.nodes / 2; j++) {
        const int wave = i <= g.nodes / 2 ? i : i - g.nodes;
        const double k = unit * std::hypot(wave, j), h = layer.thickness_mm;
        const std::size_t n = std::size_t(i) * std::size_t(g.nodes / 2 + 1) + std::size_t(j);
        compliance[n] = norm * of_layer * h * surface_compliance(k * h, nu);
        if (k > 0.0) { // the mean of a half-space's displacement is a matter of definition
          compliance[n] += norm * of_body / k;
        }
        transfer[n] = norm * base_transfer(k * h, nu);
      }
    }
    pressure_Pa.front() = 1.0;
    apply(pressure_Pa, compliance);
    yield_mm_Pa = real[0];
    pressure_Pa.front() = 0.0;
  }

  ~Work() {
    const std::lock_guard<std::mutex> lock(planning);
    fftw_destroy_plan(forward);
    fftw_destroy_plan(backward);
    fftw_free(real);
    fftw_free(spectrum);
  }

  Work(const Work &) = delete;
  Work &operator=(const Work &) = delete;

  std::size_t at(int i, int j) const {
    return std::size_t(i) * std::size_t(grid.nodes) + std::size_t(j);
  }

  // real := the field after this response.
  void apply(const std::vector<double> &field, const std::vector<double> &response) {
    std::copy(field.begin(), field.end(), real);
    fftw_execute(forward);
    for (std::size_t n = 0; n < waves; n++) {
      spectrum[n][0] *= response[n];
      spectrum[n][1] *= response[n];
    }
    fftw_execute(backward);
  }
};

ContactSolver::ContactSolver(const Indenter &indenter, const Layer &layer, const Grid &grid)
    : work_(std::make_unique<Work>(indenter, layer, grid)) {}
ContactSolver::~ContactSolver() = default;

std::vector<double> ContactSolver::displacement_mm(const std::vector<double> &pressure_Pa) {
  work_->apply(pressure_Pa, work_->compliance);
  return {work_->real, work_->real + work_->nodes2};
}

Contact ContactSolver::solve(double force_N) {
  Work &w = *work_;
  const double area_m2 = 1e-6 * w.grid.step_mm * w.grid.step_mm;
  std::vector<double> &p = w.pressure_Pa;
  std::vector<double> gap(w.nodes2), direction(w.nodes2, 0.0);

  double sum = 0.0;
  for (double value : p) {
    sum += value;
  }
  if (sum <= 0.0) { // anywhere that can touch at all
    for (std::size_t n = 0; n < w.nodes2; n++) {
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
    w.apply(p, w.compliance);
    double mean = 0.0;
    std::size_t touching = 0;
    for (std::size_t n = 0; n < w.nodes2; n++) {
      gap[n] = w.real[n] + w.height_mm[n];
      if (p[n] > 0.0) {
        mean += gap[n];
        touching++;
      }
    }
    mean /= static_cast<double>(touching);
    approach_mm = mean;
    double square = 0.0;
    for (std::size_t n = 0; n < w.nodes2; n++) {
      gap[n] -= mean;
      square += p[n] > 0.0 ? gap[n] * gap[n] : 0.0;
    }
    const double share = conjugate ? square / before : 0.0;
    before = square;
    for (std::size_t n = 0; n < w.nodes2; n++) {
      direction[n] = p[n] > 0.0 ? gap[n] + share * direction[n] : 0.0;
    }
    w.apply(direction, w.compliance);
    double mean_response = 0.0;
    for (std::size_t n = 0; n < w.nodes2; n++) {
      mean_response += p[n] > 0.0 ? w.real[n] : 0.0;
    }
    mean_response /= static_cast<double>(touching);
    double along = 0.0, curvature = 0.0;
    for (std::size_t n = 0; n < w.nodes2; n++) {
      if (p[n] > 0.0) {
        along += gap[n] * direction[n];
        curvature += (w.real[n] - mean_response) * direction[n];
      }
    }
    // One node alone has no neighbour to share with, but those that overlap shall still join.
    const double length = curvature > 0.0 ? along / curvature : 1.0 / w.yield_mm_Pa;
    double change = 0.0;
    conjugate = true;
    sum = 0.0;
    for (std::size_t n = 0; n < w.nodes2; n++) {
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
      Contact contact{force_N, approach_mm, 0.0, step, p, std::vector<double>(w.nodes2)};
      for (double value : p) {
        contact.contact_area_mm2 += value > 0.0 ? w.grid.step_mm * w.grid.step_mm : 0.0;
      }
      w.apply(p, w.transfer);
      std::copy(w.real, w.real + w.nodes2, contact.base_Pa.begin());
      return contact;
    }
  }
  throw std::runtime_error("the contact of " + std::to_string(force_N) + " N did not settle");
}

} // namespace fingertip::twin
