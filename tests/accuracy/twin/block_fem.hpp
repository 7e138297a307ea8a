// A second solution of the block that shares nothing with the first: finite elements of twenty nodes with two by two by
// two points of integration, which do not lock as the rubber becomes incompressible, under the load itself. A quarter
// of the block, for loads whose pressure on the base is even or odd in x and y.
#pragma once

#include <Eigen/Sparse>
#include <array>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <vector>

namespace fingertip::twin {

class BlockFem {
public:
  using Vector3 = Eigen::Vector3d;
  // Edges of the elements, mm, from the middle (from the base) on; the last ones are free.
  BlockFem(const std::array<std::vector<double>, 3> &edges_mm, double poisson, bool odd_x, bool odd_y)
      : edges_(edges_mm), poisson_(poisson) {
    for (std::size_t d = 0; d < 3; d++) {
      elements_[d] = static_cast<int>(edges_[d].size()) - 1;
    }
    number_nodes(odd_x, odd_y);
    std::vector<Eigen::Triplet<double>> entries;
    for_each_element([&](const std::array<int, 3> &e) {
      Eigen::Matrix<double, 60, 60> stiffness = Eigen::Matrix<double, 60, 60>::Zero();
      for (int q = 0; q < 8; q++) {
        const Strains b = strains(e, point(q));
        stiffness += b.transpose() * elasticity() * b * (volume(e) / 8.0);
      }
      const std::array<int, 60> at = unknowns(e);
      for (int i = 0; i < 60; i++) {
        for (int j = 0; j <= i; j++) {
          const int row = at[std::size_t(i)], column = at[std::size_t(j)];
          if (row >= 0 && column >= 0) {
            entries.emplace_back(std::max(row, column), std::min(row, column), stiffness(i, j));
          }
        }
      }
    });
    Eigen::SparseMatrix<double> matrix(unknowns_, unknowns_);
    matrix.setFromTriplets(entries.begin(), entries.end());
    solver_.compute(matrix);
    if (solver_.info() != Eigen::Success) {
      throw std::runtime_error("the elements' matrix is singular");
    }
  }

  // Solves under this traction on the surface, per shear modulus, of x and y.
  void load(const std::function<Vector3(double, double)> &traction) {
    Eigen::VectorXd force = Eigen::VectorXd::Zero(unknowns_);
    constexpr double POINT[4] = {-0.8611363115940526, -0.3399810435848563, 0.3399810435848563, 0.8611363115940526};
    constexpr double WEIGHT[4] = {0.3478548451374538, 0.6521451548625461, 0.6521451548625461, 0.3478548451374538};
    for_each_element([&](const std::array<int, 3> &e) {
      if (e[2] != elements_[2] - 1) {
        return;
      }
      const std::array<int, 60> at = unknowns(e);
      for (std::size_t q = 0; q < 16; q++) {
        const Vector3 s(POINT[q / 4], POINT[q % 4], 1.0);
        const Vector3 t = traction(place(e, s, 0), place(e, s, 1)) * WEIGHT[q / 4] * WEIGHT[q % 4] * size(e, 0) * size(e, 1) / 4.0;
        for (int i = 0; i < 60; i++) {
          if (at[std::size_t(i)] >= 0) {
            force[at[std::size_t(i)]] += t[i % 3] * shape(i / 3, s);
          }
        }
      }
    });
    moved_ = solver_.solve(force);
  }

  // The pressure on the base times a weight of x and y, integrated over the quarter: the work of the base when it is lifted by the weight.
  // Better than the stress at any point, which oscillates in rubber that hardly changes its volume.
  double base_work(const std::function<double(double, double)> &weight) const {
    double work = 0.0;
    for_each_element([&](const std::array<int, 3> &e) {
      if (e[2] != 0) {
        return;
      }
      const std::array<int, 60> at = unknowns(e);
      Eigen::Matrix<double, 60, 1> moved, lifted = Eigen::Matrix<double, 60, 1>::Zero();
      for (int i = 0; i < 60; i++) {
        moved[i] = at[std::size_t(i)] < 0 ? 0.0 : moved_[at[std::size_t(i)]];
        const Vector3 s = corner_or_middle(i / 3);
        if (i % 3 == 2 && s[2] == -1.0) {
          lifted[i] = weight(place(e, s, 0), place(e, s, 1));
        }
      }
      for (int q = 0; q < 8; q++) {
        const Strains b = strains(e, point(q));
        work += (b * lifted).dot(elasticity() * (b * moved)) * volume(e) / 8.0;
      }
    });
    return work;
  }

private:
  using Strains = Eigen::Matrix<double, 6, 60>;

  // Corners, then middles of edges: where an element's nodes are, in -1..1.
  static Vector3 corner_or_middle(int node) {
    if (node < 8) {
      return {node & 1 ? 1.0 : -1.0, node & 2 ? 1.0 : -1.0, node & 4 ? 1.0 : -1.0};
    }
    const int along = (node - 8) / 4, n = (node - 8) % 4;
    Vector3 made = Vector3::Zero();
    made[(along + 1) % 3] = n & 1 ? 1.0 : -1.0;
    made[(along + 2) % 3] = n & 2 ? 1.0 : -1.0;
    return made;
  }

  static double shape(int node, const Vector3 &s) {
    const Vector3 n = corner_or_middle(node);
    double product = 1.0;
    for (int d = 0; d < 3; d++) {
      product *= n[d] == 0.0 ? 1.0 - s[d] * s[d] : 1.0 + n[d] * s[d];
    }
    return node < 8 ? 0.125 * product * (n.dot(s) - 2.0) : 0.25 * product;
  }

  static double slope(int node, const Vector3 &s, int along) {
    const Vector3 n = corner_or_middle(node);
    double others = 1.0;
    for (int d = 0; d < 3; d++) {
      others *= d == along ? 1.0 : n[d] == 0.0 ? 1.0 - s[d] * s[d] : 1.0 + n[d] * s[d];
    }
    if (node < 8) {
      return 0.125 * others * n[along] * (n.dot(s) - 2.0 + 1.0 + n[along] * s[along]);
    }
    return 0.25 * others * (n[along] == 0.0 ? -2.0 * s[along] : n[along]);
  }

  static Vector3 point(int q) { return Vector3(q & 1 ? 1.0 : -1.0, q & 2 ? 1.0 : -1.0, q & 4 ? 1.0 : -1.0) / std::sqrt(3.0); }

  double size(const std::array<int, 3> &e, std::size_t d) const { return edges_[d][std::size_t(e[d]) + 1] - edges_[d][std::size_t(e[d])]; }
  double volume(const std::array<int, 3> &e) const { return size(e, 0) * size(e, 1) * size(e, 2); }
  double place(const std::array<int, 3> &e, const Vector3 &s, std::size_t d) const {
    return edges_[d][std::size_t(e[d])] + 0.5 * (1.0 + s[Eigen::Index(d)]) * size(e, d);
  }

  // xx, yy, zz, xy, yz, zx.
  Strains strains(const std::array<int, 3> &e, const Vector3 &s) const {
    Strains made = Strains::Zero();
    for (int node = 0; node < 20; node++) {
      Vector3 g;
      for (int d = 0; d < 3; d++) {
        g[d] = slope(node, s, d) * 2.0 / size(e, std::size_t(d));
        made(d, 3 * node + d) = g[d];
      }
      for (int d = 0; d < 3; d++) {
        const int next = (d + 1) % 3;
        made(3 + d, 3 * node + d) = g[next];
        made(3 + d, 3 * node + next) = g[d];
      }
    }
    return made;
  }

  Eigen::Matrix<double, 6, 6> elasticity() const {
    Eigen::Matrix<double, 6, 6> made = Eigen::Matrix<double, 6, 6>::Zero();
    made.topLeftCorner<3, 3>().setConstant(2.0 * poisson_ / (1.0 - 2.0 * poisson_));
    made.diagonal().head<3>().array() += 2.0;
    made.diagonal().tail<3>().setConstant(1.0);
    return made;
  }

  template <typename Do> void for_each_element(const Do &what) const {
    for (int i = 0; i < elements_[0]; i++) {
      for (int j = 0; j < elements_[1]; j++) {
        for (int k = 0; k < elements_[2]; k++) {
          what(std::array<int, 3>{i, j, k});
        }
      }
    }
  }

  std::size_t lattice(int i, int j, int k) const { return std::size_t((i * (2 * elements_[1] + 1) + j) * (2 * elements_[2] + 1) + k); }

  // -1: held. Middles of faces and of elements have no node.
  void number_nodes(bool odd_x, bool odd_y) {
    number_.assign(lattice(2 * elements_[0] + 1, 0, 0), {-1, -1, -1});
    for (int i = 0; i <= 2 * elements_[0]; i++) {
      for (int j = 0; j <= 2 * elements_[1]; j++) {
        for (int k = 1; k <= 2 * elements_[2]; k++) {
          if (i % 2 + j % 2 + k % 2 > 1) {
            continue;
          }
          for (std::size_t d = 0; d < 3; d++) {
            const bool held = (i == 0 && odd_x != (d == 0)) || (j == 0 && odd_y != (d == 1));
            number_[lattice(i, j, k)][d] = held ? -1 : unknowns_++;
          }
        }
      }
    }
  }

  std::array<int, 60> unknowns(const std::array<int, 3> &e) const {
    std::array<int, 60> made{};
    for (int node = 0; node < 20; node++) {
      const Vector3 n = corner_or_middle(node);
      const auto at = [&](int d) { return 2 * e[std::size_t(d)] + 1 + static_cast<int>(n[d]); };
      for (std::size_t d = 0; d < 3; d++) {
        made[std::size_t(3 * node) + d] = number_[lattice(at(0), at(1), at(2))][d];
      }
    }
    return made;
  }

  std::array<std::vector<double>, 3> edges_;
  double poisson_;
  std::array<int, 3> elements_{};
  std::vector<std::array<int, 3>> number_; // [lattice][direction]
  int unknowns_ = 0;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver_;
  Eigen::VectorXd moved_;
};

} // namespace fingertip::twin
