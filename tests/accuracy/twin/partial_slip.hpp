// What sticks and what slides in a contact under a tangential force, solved for itself: the
// traction q, nowhere above friction times pressure, that a rigid shift of the object finds.
//
// The least of 1/2 <q, C q> - shift <q_x> over |q| <= friction p, by accelerated projected gradients (Beck and Teboulle, SIAM J. Imaging
// Sciences 2, 2009): where q is below its bound the surface has moved by the shift; elsewhere it slides back along q (Kalker,
// Three-Dimensional Elastic Bodies in Rolling Contact, Kluwer 1990, for one step from rest). C is the layer's answer along and across each
// wave. Normal displacements are left alone: solved with them, a pull of 0.3 of 8 N changes the base by 0.3 % of the tangential field's
// peak for sphere6 on 12 mm, by 12 % for sphere15 on 6 mm.
#pragma once

#include "simulation/twin/contact.hpp"
#include "simulation/twin/transform.hpp"

#include <cmath>
#include <complex>
#include <vector>

namespace fingertip::twin {

// Displacement of the surface along its traction, h / G: the wave along it, and across.
inline double surface_shift_along(double H, double poisson) {
  const double b = 1.0 - 2.0 * poisson;
  if (H < 1e-4) {
    return 1.0;
  }
  if (H > 300.0) {
    return (1.0 - poisson) / H;
  }
  const double cosh = std::cosh(H), c = 3.0 - 4.0 * poisson;
  return (1.0 - poisson) * (c * std::sinh(H) * cosh + H) / (H * (c * cosh * cosh + H * H + b * b));
}

inline double surface_shift_across(double H) { return H < 1e-4 ? 1.0 : std::tanh(H) / H; }

struct Traction {
  std::vector<double> x_Pa, y_Pa;
};

class PartialSlip {
public:
  PartialSlip(const Layer &layer, const Grid &grid)
      : layer_(layer), grid_(grid), transform_(grid.nodes), xx_(transform_.waves()), xy_(transform_.waves()), yy_(transform_.waves()),
        base_x_(transform_.waves()), base_y_(transform_.waves()) {
    const double unit = 2.0 * M_PI / (grid.nodes * grid.step_mm);
    const double norm = 1.0 / (double(grid.nodes) * grid.nodes);
    const double h_per_G = layer.thickness_mm * 2.0 * (1.0 + layer.poisson) / layer.youngs_modulus_Pa;
    for (int row = 0; row < grid.nodes; row++) {
      for (int j = 0; j <= grid.nodes / 2; j++) {
        const int i = transform_.i_of(row);
        const double k = std::hypot(i, j), H = unit * k * layer.thickness_mm;
        const double cx = k > 0.0 ? i / k : 1.0, cy = k > 0.0 ? j / k : 0.0;
        const double along = norm * h_per_G * surface_shift_along(H, layer.poisson);
        const double across = norm * h_per_G * surface_shift_across(H);
        const double base = norm * tangential_transfer(H, layer.poisson);
        const bool ends_x = 2 * i == grid.nodes, ends_y = 2 * j == grid.nodes;
        const std::size_t n = std::size_t(row * (grid.nodes / 2 + 1) + j);
        xx_[n] = cx * cx * along + cy * cy * across;
        yy_[n] = cy * cy * along + cx * cx * across;
        xy_[n] = ends_x || ends_y ? 0.0 : cx * cy * (along - across);
        base_x_[n] = {0.0, ends_x ? 0.0 : -cx * base};
        base_y_[n] = {0.0, ends_y ? 0.0 : -cy * base};
      }
    }
    steepest_ = 1.0 / h_per_G;
  }

  // Under a shift along x.
  Traction solve(const std::vector<double> &pressure_Pa, double friction, double shift_mm) {
    const std::size_t size = pressure_Pa.size();
    Traction q{std::vector<double>(size, 0.0), std::vector<double>(size, 0.0)}, ahead = q;
    double t = 1.0;
    for (int step = 0; step < 300; step++) {
      std::vector<double> ux = answer(ahead.x_Pa, xx_), uy = answer(ahead.y_Pa, yy_);
      add(ux, answer(ahead.y_Pa, xy_));
      add(uy, answer(ahead.x_Pa, xy_));
      const double next = 0.5 * (1.0 + std::sqrt(1.0 + 4.0 * t * t));
      for (std::size_t n = 0; n < size; n++) {
        double x = ahead.x_Pa[n] - steepest_ * (ux[n] - shift_mm);
        double y = ahead.y_Pa[n] - steepest_ * uy[n];
        const double length = std::hypot(x, y), most = friction * pressure_Pa[n];
        const double cut = length > most ? most / length : 1.0;
        x *= cut;
        y *= cut;
        ahead.x_Pa[n] = x + (t - 1.0) / next * (x - q.x_Pa[n]);
        ahead.y_Pa[n] = y + (t - 1.0) / next * (y - q.y_Pa[n]);
        q.x_Pa[n] = x;
        q.y_Pa[n] = y;
      }
      t = next;
    }
    return q;
  }

  // Pressure on the base under a traction.
  std::vector<double> base_Pa(const Traction &q) {
    std::vector<double> base = answer(q.x_Pa, base_x_);
    add(base, answer(q.y_Pa, base_y_));
    return base;
  }

  double force_N(const std::vector<double> &stress_Pa) const {
    double sum = 0.0;
    for (double value : stress_Pa) {
      sum += value;
    }
    return 1e-6 * grid_.step_mm * grid_.step_mm * sum;
  }

private:
  template <typename Response> std::vector<double> answer(const std::vector<double> &field, const Response &response) {
    const double *values = transform_.apply(field, response);
    return {values, values + field.size()};
  }

  static void add(std::vector<double> &sum, const std::vector<double> &more) {
    for (std::size_t n = 0; n < sum.size(); n++) {
      sum[n] += more[n];
    }
  }

  Layer layer_;
  Grid grid_;
  Transform transform_;
  std::vector<double> xx_, xy_, yy_;
  std::vector<std::complex<double>> base_x_, base_y_;
  double steepest_; // length of a step that never overshoots, Pa / mm
};

} // namespace fingertip::twin
