#include "layer_collocation.hpp"

#include <Eigen/LU>
#include <cmath>

namespace fingertip::twin {

LayerWave solve_layer_wave(double H, double poisson, int order) {
  const int n = order + 1;
  // Derivatives of the interpolating polynomial, from the surface (row 0) to the base (row order):
  // Trefethen, Spectral Methods in MATLAB, SIAM 2000, chapter 6.
  Eigen::MatrixXd d(n, n);
  const auto point = [&](int i) { return std::cos(M_PI * i / order); };
  const auto weight = [&](int i) { return (i == 0 || i == order ? 2.0 : 1.0) * (i % 2 == 0 ? 1.0 : -1.0); };
  for (int i = 0; i < n; i++) {
    for (int j = 0; j < n; j++) {
      d(i, j) = i == j ? 0.0 : weight(i) / (weight(j) * (point(i) - point(j)));
    }
  }
  for (int i = 0; i < n; i++) {
    d(i, i) = -d.row(i).sum();
  }
  d *= 2.0; // the points span -1..1, the layer 0..1
  const Eigen::MatrixXd d2 = d * d, one = Eigen::MatrixXd::Identity(n, n);
  const double m = 1.0 / (1.0 - 2.0 * poisson);

  Eigen::MatrixXd system(2 * n, 2 * n); // unknowns U, W
  system << d2 - (1.0 + m) * H * H * one, m * H * d, -m * H * d, (1.0 + m) * d2 - H * H * one;
  const auto tension_at = [&](int row) {
    Eigen::RowVectorXd tension(2 * n);
    tension << -(m - 1.0) * H * one.row(row), (m + 1.0) * d.row(row);
    return tension;
  };
  system.row(0) << d.row(0), H * one.row(0);
  system.row(n) = tension_at(0);
  for (int at : {order, n + order}) {
    system.row(at).setZero();
    system(at, at) = 1.0;
  }
  Eigen::MatrixXd load = Eigen::MatrixXd::Zero(2 * n, 2);
  load(n, 0) = -1.0; // pressure 1
  load(0, 1) = -1.0; // traction 1 is shear i (-i)
  const Eigen::MatrixXd moved = system.fullPivLu().solve(load);
  const Eigen::RowVectorXd base = -tension_at(order) * moved;
  return {base(0), -moved(n, 0), -base(1), -moved(0, 1)};
}

} // namespace fingertip::twin
