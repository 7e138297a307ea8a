// A second solution of the layer that shares nothing with the first: finite elements in r and z,
// eight nodes with two by two points of integration, which do not lock as the rubber becomes
// incompressible.
#pragma once

#include <Eigen/Sparse>
#include <array>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <vector>

namespace fingertip::twin {

class AxisymmetricFem {
public:
  // r_mm: edges of the elements from the axis outwards, the last one free; layers: along z.
  AxisymmetricFem(std::vector<double> r_mm, double thickness_mm, int layers, double young_Pa, double poisson)
      : r_(std::move(r_mm)), h_(thickness_mm), columns_(static_cast<int>(r_.size()) - 1), layers_(layers),
        young_(young_Pa), poisson_(poisson) {}

  // Solves under this pressure on the surface (Pa, downward), a function of r in mm.
  void load(const std::function<double(double)> &pressure_Pa) {
    const int dofs = 2 * node(2 * columns_, 2 * layers_) + 2;
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::VectorXd force = Eigen::VectorXd::Zero(dofs);
    for (int c = 0; c < columns_; c++) {
      for (int l = 0; l < layers_; l++) {
        add_element(c, l, entries);
      }
      // Work of the pressure on the upper edge, three points of Gauss.
      for (int q = 0; q < 3; q++) {
        const double s = std::sqrt(0.6) * (q - 1), weight = q == 1 ? 8.0 / 9.0 : 5.0 / 9.0;
        const double r = 0.5 * (r_[at(c)] + r_[at(c + 1)]) + 0.5 * s * (r_[at(c + 1)] - r_[at(c)]);
        const double share = weight * 0.5 * (r_[at(c + 1)] - r_[at(c)]) * r * pressure_Pa(r);
        const double shape[3] = {0.5 * s * (s - 1.0), 1.0 - s * s, 0.5 * s * (s + 1.0)};
        for (int k = 0; k < 3; k++) {
          force[2 * node(2 * c + k, 2 * layers_) + 1] -= share * shape[k];
        }
      }
    }
    Eigen::SparseMatrix<double> stiffness(dofs, dofs);
    stiffness.setFromTriplets(entries.begin(), entries.end());
    // Held: all at the base, the radius on the axis, and the centres of elements, which have no
    // node.
    for (int i = 0; i <= 2 * columns_; i++) {
      for (int j = 0; j <= 2 * layers_; j++) {
        const bool centre = i % 2 == 1 && j % 2 == 1;
        for (int d = 0; d < 2; d++) {
          if (j == 0 || centre || (i == 0 && d == 0)) {
            stiffness.coeffRef(2 * node(i, j) + d, 2 * node(i, j) + d) += 1e12 * young_;
          }
        }
      }
    }
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(stiffness);
    if (solver.info() != Eigen::Success) {
      throw std::runtime_error("the elements' matrix is singular");
    }
    moved_ = solver.solve(force);
  }

  // Downward displacement of the surface at the element edge c.
  double surface_mm(int c) const { return -moved_[2 * node(2 * c, 2 * layers_) + 1]; }

  // Pressure on the base at the middle of column c: vertical stress at the points of the lowest two
  // elements, continued to the base.
  double base_pressure_Pa(int c) const {
    const double low = stress_zz(c, 0), high = stress_zz(c, 1);
    return -(1.5 * low - 0.5 * high);
  }
  double middle_mm(int c) const { return 0.5 * (r_[at(c)] + r_[at(c + 1)]); }

private:
  using Element = std::array<int, 8>;
  static std::size_t at(int i) { return static_cast<std::size_t>(i); }
  int node(int i, int j) const { return i * (2 * layers_ + 1) + j; }

  Element nodes_of(int c, int l) const {
    const int i = 2 * c, j = 2 * l;
    return {node(i, j),     node(i + 2, j),     node(i + 2, j + 2), node(i, j + 2),
            node(i + 1, j), node(i + 2, j + 1), node(i + 1, j + 2), node(i, j + 1)};
  }

  // Strains (rr, zz, tt, rz) per displacement, 4 x 16, at the place s, t in -1..1.
  Eigen::Matrix<double, 4, 16> strains(int c, double s, double t) const {
    const double half_r = 0.5 * (r_[at(c + 1)] - r_[at(c)]), half_z = 0.5 * h_ / layers_;
    const double r = 0.5 * (r_[at(c)] + r_[at(c + 1)]) + s * half_r;
    static constexpr double S[8] = {-1, 1, 1, -1, 0, 1, 0, -1}, T[8] = {-1, -1, 1, 1, -1, 0, 1, 0};
    Eigen::Matrix<double, 4, 16> made = Eigen::Matrix<double, 4, 16>::Zero();
    for (int k = 0; k < 8; k++) {
      double n = 0, ds = 0, dt = 0;
      const double a = S[k], b = T[k];
      if (k < 4) {
        n = 0.25 * (1 + a * s) * (1 + b * t) * (a * s + b * t - 1);
        ds = 0.25 * a * (1 + b * t) * (2 * a * s + b * t);
        dt = 0.25 * b * (1 + a * s) * (a * s + 2 * b * t);
      } else if (a == 0) {
        n = 0.5 * (1 - s * s) * (1 + b * t);
        ds = -s * (1 + b * t);
        dt = 0.5 * b * (1 - s * s);
      } else {
        n = 0.5 * (1 + a * s) * (1 - t * t);
        ds = 0.5 * a * (1 - t * t);
        dt = -t * (1 + a * s);
      }
      made(0, 2 * k) = ds / half_r;
      made(1, 2 * k + 1) = dt / half_z;
      made(2, 2 * k) = n / r;
      made(3, 2 * k) = dt / half_z;
      made(3, 2 * k + 1) = ds / half_r;
    }
    return made;
  }

  Eigen::Matrix4d elasticity() const {
    const double lame = young_ * poisson_ / ((1 + poisson_) * (1 - 2 * poisson_));
    const double shear = young_ / (2 * (1 + poisson_));
    Eigen::Matrix4d made = Eigen::Matrix4d::Zero();
    made.topLeftCorner<3, 3>().setConstant(lame);
    made.diagonal() += Eigen::Vector4d(2 * shear, 2 * shear, 2 * shear, shear);
    return made;
  }

  void add_element(int c, int l, std::vector<Eigen::Triplet<double>> &entries) const {
    const double half_r = 0.5 * (r_[at(c + 1)] - r_[at(c)]), half_z = 0.5 * h_ / layers_;
    const Eigen::Matrix4d elastic = elasticity();
    Eigen::Matrix<double, 16, 16> stiffness = Eigen::Matrix<double, 16, 16>::Zero();
    for (double s : {-std::sqrt(1.0 / 3), std::sqrt(1.0 / 3)}) {
      for (double t : {-std::sqrt(1.0 / 3), std::sqrt(1.0 / 3)}) {
        const double r = 0.5 * (r_[at(c)] + r_[at(c + 1)]) + s * half_r;
        const Eigen::Matrix<double, 4, 16> b = strains(c, s, t);
        stiffness += b.transpose() * elastic * b * (half_r * half_z * r);
      }
    }
    const Element nodes = nodes_of(c, l);
    for (int i = 0; i < 16; i++) {
      for (int j = 0; j < 16; j++) {
        entries.emplace_back(2 * nodes[at(i / 2)] + i % 2, 2 * nodes[at(j / 2)] + j % 2, stiffness(i, j));
      }
    }
  }

  // Mean over the element's points of integration, which is the value at its middle.
  double stress_zz(int c, int l) const {
    const Element nodes = nodes_of(c, l);
    Eigen::Matrix<double, 16, 1> moved;
    for (int i = 0; i < 16; i++) {
      moved[i] = moved_[2 * nodes[at(i / 2)] + i % 2];
    }
    double sum = 0;
    for (double s : {-std::sqrt(1.0 / 3), std::sqrt(1.0 / 3)}) {
      for (double t : {-std::sqrt(1.0 / 3), std::sqrt(1.0 / 3)}) {
        sum += 0.25 * (elasticity() * (strains(c, s, t) * moved))[1];
      }
    }
    return sum;
  }

  std::vector<double> r_; // [edge]
  double h_;
  int columns_, layers_;
  double young_, poisson_;
  Eigen::VectorXd moved_; // [2 * node + (r, z)], mm
};

} // namespace fingertip::twin
