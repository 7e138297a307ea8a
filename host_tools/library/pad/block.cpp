#include "library/pad/block.hpp"

#include "libfingertip/in_parallel.hpp"
#include "library/pad/point_lift.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <stdexcept>
#include <thread>

namespace fingertip::twin {
namespace {

using Eigen::Index;
using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

// Residual at which conjugate gradients end, relative to the load.
constexpr double SETTLED = 1e-7;
constexpr int STEPS_MAX = 3000;

// Points and weights of Gauss and Legendre in -1..1: the eigenvalues of Jacobi's matrix.
struct Quadrature {
  Vector points, weights;
};

Quadrature gauss(int count) {
  Matrix jacobi = Matrix::Zero(count, count);
  for (int i = 1; i < count; i++) {
    jacobi(i, i - 1) = jacobi(i - 1, i) = i / std::sqrt(4.0 * i * i - 1.0);
  }
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(jacobi);
  return {solver.eigenvalues(), 2.0 * solver.eigenvectors().row(0).transpose().cwiseAbs2()};
}

// Values (or derivatives) at s, in -1..1, of the polynomials that are 1 at one of the nodes and 0
// at the others.
Vector lagrange(const Vector &nodes, double s, bool derivative) {
  const Index n = nodes.size();
  Vector made(n);
  for (Index k = 0; k < n; k++) {
    double value = 1.0, slope = 0.0;
    for (Index m = 0; m < n; m++) {
      if (m != k) {
        slope = (slope * (s - nodes[m]) + value) / (nodes[k] - nodes[m]);
        value *= (s - nodes[m]) / (nodes[k] - nodes[m]);
      }
    }
    made[k] = derivative ? slope : value;
  }
  return made;
}

// Functions on a line cut into elements.
class Line {
public:
  Line(std::vector<double> edges, int degree) : edges_(std::move(edges)), degree_(degree), nodes_(degree + 1) {
    for (int k = 0; k <= degree; k++) { // Chebyshev's: the functions, not the nodes, matter
      nodes_[k] = -std::cos(M_PI * k / degree);
    }
    const Quadrature rule = gauss(degree + 2);
    const Index points = rule.points.size(), elements = static_cast<Index>(edges_.size()) - 1;
    values_ = slopes_ = Matrix::Zero(elements * points, size());
    points_ = weights_ = Vector::Zero(elements * points);
    for (Index e = 0; e < elements; e++) {
      const double begin = edges_[static_cast<std::size_t>(e)];
      const double half = 0.5 * (edges_[static_cast<std::size_t>(e) + 1] - begin);
      for (Index q = 0; q < points; q++) {
        const Index row = e * points + q;
        points_[row] = begin + half * (1.0 + rule.points[q]);
        weights_[row] = half * rule.weights[q];
        values_.block(row, e * degree, 1, degree + 1) = lagrange(nodes_, rule.points[q], false).transpose();
        slopes_.block(row, e * degree, 1, degree + 1) = lagrange(nodes_, rule.points[q], true).transpose() / half;
      }
    }
  }

  Index size() const { return static_cast<Index>(edges_.size() - 1) * degree_ + 1; }
  double end() const { return edges_.back(); }
  const Vector &points() const { return points_; }
  const Vector &weights() const { return weights_; }
  const Matrix &values() const { return values_; } // [point][function]
  const Matrix &slopes() const { return slopes_; }

  Vector values_at(double place) const {
    const auto above = std::upper_bound(edges_.begin() + 1, edges_.end() - 1, place);
    const double begin = *(above - 1), half = 0.5 * (*above - begin);
    Vector made = Vector::Zero(size());
    made.segment((above - 1 - edges_.begin()) * degree_, degree_ + 1) =
        lagrange(nodes_, (place - begin) / half - 1.0, false);
    return made;
  }

private:
  std::vector<double> edges_;
  int degree_;
  Vector nodes_, points_, weights_;
  Matrix values_, slopes_;
};

// A line's functions, held at its beginning or free there, as modes: orthonormal, and so are their
// slopes but for the factors in `stiffness`.
struct Modes {
  Matrix modes; // [function][mode]
  Vector stiffness;

  Modes(const Line &line, bool held) {
    const Index less = held ? 1 : 0, size = line.size() - less;
    const auto gram = [&](const Matrix &of) -> Matrix {
      return (of.transpose() * line.weights().asDiagonal() * of).bottomRightCorner(size, size);
    };
    const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix> solver(gram(line.slopes()), gram(line.values()));
    modes = Matrix::Zero(line.size(), size);
    modes.bottomRows(size) = solver.eigenvectors();
    stiffness = solver.eigenvalues();
  }
};

// Integrals of slopes of the one times values of the other.
Matrix slopes_by_values(const Line &line, const Modes &a, const Modes &b) {
  return (line.slopes() * a.modes).transpose() * line.weights().asDiagonal() * (line.values() * b.modes);
}

struct Shape {
  Index x, y, z;
};

// Fields [x + nx (y + ny z)]: multiplied along one axis, and added to `out` if add is set.
void along_x(const Matrix &by, const Shape &from, const Vector &in, Vector &out, bool add) {
  if (!add) {
    out.setZero(by.rows() * from.y * from.z);
  }
  Eigen::Map<Matrix>(out.data(), by.rows(), from.y * from.z).noalias() +=
      by * Eigen::Map<const Matrix>(in.data(), from.x, from.y * from.z);
}

void along_y(const Matrix &by, const Shape &from, const Vector &in, Vector &out, bool add) {
  if (!add) {
    out.setZero(from.x * by.rows() * from.z);
  }
  for (Index z = 0; z < from.z; z++) {
    Eigen::Map<Matrix>(out.data() + z * from.x * by.rows(), from.x, by.rows()).noalias() +=
        Eigen::Map<const Matrix>(in.data() + z * from.x * from.y, from.x, from.y) * by.transpose();
  }
}

void along_z(const Matrix &by, const Shape &from, const Vector &in, Vector &out, bool add) {
  if (!add) {
    out.setZero(from.x * from.y * by.rows());
  }
  Eigen::Map<Matrix>(out.data(), from.x * from.y, by.rows()).noalias() +=
      Eigen::Map<const Matrix>(in.data(), from.x * from.y, from.z) * by.transpose();
}

using Field = std::array<Vector, 3>;

// A quarter of the block, x and y from 0 on, for fields that are even or odd: as the vertical
// displacement is.
class Quarter {
public:
  Quarter(const Line &x, const Line &y, const Line &z, bool odd_x, bool odd_y, double lame)
      : lame_(lame), x_{Modes(x, !odd_x), Modes(x, odd_x)}, y_{Modes(y, !odd_y), Modes(y, odd_y)}, z_(z, true),
        gx_(slopes_by_values(x, x_[0], x_[1])), hx_(slopes_by_values(x, x_[1], x_[0]).transpose()),
        gy_(slopes_by_values(y, y_[0], y_[1])), hy_(slopes_by_values(y, y_[1], y_[0]).transpose()),
        gz_(slopes_by_values(z, z_, z_)) {
    for (std::size_t c = 0; c < 3; c++) {
      const Shape s = shape(c);
      diagonal_[c].resize(s.x * s.y * s.z);
      for (Index k = 0; k < s.z; k++) {
        for (Index j = 0; j < s.y; j++) {
          for (Index i = 0; i < s.x; i++) {
            diagonal_[c][i + s.x * (j + s.y * k)] = (c == 0 ? lame_ + 2.0 : 1.0) * x_of(c).stiffness[i] +
                                                    (c == 1 ? lame_ + 2.0 : 1.0) * y_of(c).stiffness[j] +
                                                    (c == 2 ? lame_ + 2.0 : 1.0) * z_.stiffness[k];
          }
        }
      }
    }
  }

  const Modes &x_of(std::size_t c) const { return x_[c == 0 ? 0 : 1]; }
  const Modes &y_of(std::size_t c) const { return y_[c == 1 ? 0 : 1]; }
  const Modes &z_of() const { return z_; }
  Shape shape(std::size_t c) const { return {x_of(c).stiffness.size(), y_of(c).stiffness.size(), z_.stiffness.size()}; }

  // Solves by conjugate gradients, with the diagonal as preconditioner.
  Field solve(const Field &load) const {
    Field at, rest = load, way, image, scaled;
    double before = 0.0, first = 0.0;
    for (std::size_t c = 0; c < 3; c++) {
      at[c].setZero(load[c].size());
      way[c].setZero(load[c].size());
    }
    for (int step = 0; step < STEPS_MAX; step++) {
      double now = 0.0;
      for (std::size_t c = 0; c < 3; c++) {
        scaled[c] = rest[c].cwiseQuotient(diagonal_[c]);
        now += scaled[c].dot(rest[c]);
      }
      first = step == 0 ? now : first;
      if (now <= SETTLED * SETTLED * first) {
        return at;
      }
      for (std::size_t c = 0; c < 3; c++) {
        way[c] = scaled[c] + (step == 0 ? 0.0 : now / before) * way[c];
      }
      apply(way, image);
      double work = 0.0;
      for (std::size_t c = 0; c < 3; c++) {
        work += way[c].dot(image[c]);
      }
      for (std::size_t c = 0; c < 3; c++) {
        at[c] += now / work * way[c];
        rest[c] -= now / work * image[c];
      }
      before = now;
    }
    throw std::runtime_error("the block's equations do not settle");
  }

private:
  // Virtual work: lame div v div u + 2 strain(v) . strain(u), shear modulus 1. What the slopes of a
  // component along one axis do to the two others is computed once for both.
  void apply(const Field &in, Field &out) const {
    Vector g[3], h[3];
    for (std::size_t c = 0; c < 3; c++) {
      out[c] = diagonal_[c].cwiseProduct(in[c]);
      along(c, gx_.transpose(), gy_.transpose(), gz_.transpose(), in[c], shape(c), g[c], false);
      along(c, hx_.transpose(), hy_.transpose(), gz_, in[c], shape(c), h[c], false);
    }
    const Shape between{x_of(1).stiffness.size(), y_of(0).stiffness.size(), z_.stiffness.size()};
    for (std::size_t c = 0; c < 3; c++) {
      const std::size_t a = (c + 1) % 3, b = (c + 2) % 3;
      along(c, gx_, gy_, gz_, lame_ * (g[a] + g[b]), between, out[c], true);
      along(c, hx_, hy_, gz_.transpose(), h[a] + h[b], between, out[c], true);
    }
  }

  // Along the axis of the component, by the matrix of that axis.
  static void along(std::size_t c, const Matrix &by_x, const Matrix &by_y, const Matrix &by_z, const Vector &in,
                    const Shape &from, Vector &out, bool add) {
    if (c == 0) {
      along_x(by_x, from, in, out, add);
    } else if (c == 1) {
      along_y(by_y, from, in, out, add);
    } else {
      along_z(by_z, from, in, out, add);
    }
  }

  double lame_;
  std::array<Modes, 2> x_, y_; // of the displacement along the line, and of the others
  Modes z_;
  // Integrals of slopes of the first times values of the second, and of values times slopes.
  Matrix gx_, hx_, gy_, hy_, gz_;
  Field diagonal_;
};

// From the middle (or the base) to an end, where elements are small; at the beginning too if both_ends.
std::vector<double> edges_of(double length, double element, double edge, double growth, bool both_ends) {
  std::vector<double> sizes;
  double small = 0.0;
  const double room = both_ends ? 0.5 * length : length;
  for (double size = std::min(edge, room); size < element && small + size < 0.5 * room; size *= growth) {
    sizes.push_back(size);
    small += size;
  }
  const double left = length - (both_ends ? 2.0 : 1.0) * small;
  const int large = std::max(1, static_cast<int>(std::ceil(left / element)));
  std::vector<double> edges{0.0};
  const auto next = [&](double size) { edges.push_back(edges.back() + size); };
  if (both_ends) {
    std::for_each(sizes.begin(), sizes.end(), next);
  }
  for (int n = 0; n < large; n++) {
    next(left / large);
  }
  std::for_each(sizes.rbegin(), sizes.rend(), next);
  edges.back() = length;
  return edges;
}

// Nodes from side to side, and the functions of half the line there: even ones.
Matrix at_nodes(const Line &line, int nodes) {
  Matrix made(nodes, line.size());
  for (int n = 0; n < nodes; n++) {
    made.row(n) = line.values_at(line.end() * std::abs(2.0 * n / (nodes - 1) - 1.0)).transpose();
  }
  return made;
}

Matrix mirrored(Matrix values, bool odd) {
  if (odd) {
    values.topRows(values.rows() / 2) *= -1.0;
    if (values.rows() % 2 == 1) {
      values.row(values.rows() / 2).setZero();
    }
  }
  return values;
}

class BlockSolver {
public:
  BlockSolver(const Block &block, const BlockGrid &grid, double reach_mm)
      : element_mm_(std::min(grid.element_mm, grid.element_thicknesses * block.layer.thickness_mm)),
        edge_mm_(grid.edge_thicknesses * block.layer.thickness_mm),
        x_(edges_of(block.half_x_mm, element_mm_, edge_mm_, grid.growth, false), grid.degree),
        y_(edges_of(block.half_y_mm, element_mm_, edge_mm_, grid.growth, false), grid.degree),
        z_(edges_of(block.layer.thickness_mm, element_mm_, edge_mm_, grid.growth, true), grid.degree),
        lift_(block.layer, {z_.points().begin(), z_.points().end()}, reach_mm) {
    const double lame = 2.0 * block.layer.poisson / (1.0 - 2.0 * block.layer.poisson);
    for (int c = 0; c < 4; c++) {
      quarters_.emplace_back(x_, y_, z_, c / 2 == 1, c % 2 == 1, lame);
    }
  }

  // Adds what is even or odd in x and y of the answer of one place.
  void add(const Place &place, bool odd_x, bool odd_y, int nodes_x, int nodes_y, std::array<Matrix, 3> &answer) const {
    const Quarter &quarter = quarters_[odd_x ? (odd_y ? 3 : 2) : (odd_y ? 1 : 0)];
    const Field moved = quarter.solve(load(quarter, place, odd_x, odd_y));
    const Vector top = quarter.z_of().modes.transpose() * z_.values_at(z_.end());
    for (std::size_t c = 0; c < 3; c++) {
      const Shape s = quarter.shape(c);
      const Vector flat = Eigen::Map<const Matrix>(moved[c].data(), s.x * s.y, s.z) * top;
      const Matrix of_x = mirrored(at_nodes(x_, nodes_x), odd_x != (c == 0)) * quarter.x_of(c).modes;
      const Matrix of_y = mirrored(at_nodes(y_, nodes_y), odd_y != (c == 1)) * quarter.y_of(c).modes;
      answer[c] += of_x * Eigen::Map<const Matrix>(flat.data(), s.x, s.y) * of_y.transpose();
    }
  }

private:
  // The layer's stress on both sides, taken away.
  Field load(const Quarter &quarter, const Place &place, bool odd_x, bool odd_y) const {
    Field made;
    for (std::size_t c = 0; c < 3; c++) {
      const Shape s = quarter.shape(c);
      made[c].setZero(s.x * s.y * s.z);
    }
    for (bool of_x : {true, false}) {
      const Line &along = of_x ? y_ : x_;
      std::array<Matrix, 3> traction;
      traction.fill(Matrix::Zero(along.points().size(), z_.points().size()));
      for (Index i = 0; i < along.points().size(); i++) {
        for (int image = 0; image < 4; image++) {
          const double sign_x = image / 2 == 0 ? 1.0 : -1.0, sign_y = image % 2 == 0 ? 1.0 : -1.0;
          const double dx = (of_x ? x_.end() : along.points()[i]) - sign_x * place.x_mm;
          const double dy = (of_x ? along.points()[i] : y_.end()) - sign_y * place.y_mm;
          const double r = std::hypot(dx, dy), cosine = dx / r, sine = dy / r;
          const double share = 0.25 * (odd_x ? sign_x : 1.0) * (odd_y ? sign_y : 1.0);
          for (Index k = 0; k < z_.points().size(); k++) {
            const PointLift::Stress stress = lift_.stress(r, static_cast<std::size_t>(k));
            const double across = share * (stress.rr - stress.tt) * cosine * sine;
            const double x_x = stress.rr * cosine * cosine + stress.tt * sine * sine;
            const double y_y = stress.rr * sine * sine + stress.tt * cosine * cosine;
            traction[0](i, k) += of_x ? share * x_x : across;
            traction[1](i, k) += of_x ? across : share * y_y;
            traction[2](i, k) += share * stress.rz * (of_x ? cosine : sine);
          }
        }
      }
      for (std::size_t c = 0; c < 3; c++) {
        const Shape s = quarter.shape(c);
        const Modes &modes = of_x ? quarter.y_of(c) : quarter.x_of(c);
        const Matrix projected = (along.values() * modes.modes).transpose() * along.weights().asDiagonal() *
                                 traction[c] * z_.weights().asDiagonal() * (z_.values() * quarter.z_of().modes);
        const Line &across = of_x ? x_ : y_;
        const Vector end =
            (of_x ? quarter.x_of(c) : quarter.y_of(c)).modes.transpose() * across.values_at(across.end());
        for (Index k = 0; k < s.z; k++) {
          Eigen::Map<Matrix> layer(made[c].data() + k * s.x * s.y, s.x, s.y);
          if (of_x) {
            layer -= end * projected.col(k).transpose();
          } else {
            layer -= projected.col(k) * end.transpose();
          }
        }
      }
    }
    return made;
  }

  double element_mm_, edge_mm_;
  Line x_, y_, z_;
  PointLift lift_;
  std::vector<Quarter> quarters_;
};

} // namespace

int block_nodes(double half_mm, double step_mm) { return static_cast<int>(std::ceil(2.0 * half_mm / step_mm)) + 1; }

std::vector<BlockAnswer> solve_block(const Block &block, const std::vector<Place> &places, double step_mm,
                                     const BlockGrid &grid, const std::function<void(double)> &on_progress) {
  double reach_mm = 0.0;
  for (const Place &place : places) {
    reach_mm =
        std::max(reach_mm, std::hypot(block.half_x_mm + std::abs(place.x_mm), block.half_y_mm + std::abs(place.y_mm)));
  }
  const BlockSolver solver(block, grid, reach_mm);
  const int nodes_x = block_nodes(block.half_x_mm, step_mm);
  const int nodes_y = block_nodes(block.half_y_mm, step_mm);
  std::vector<BlockAnswer> answers(places.size());
  std::mutex telling;
  std::size_t done = 0;
  const auto solve = [&](std::size_t n) {
    const Place &place = places[n];
    std::array<Matrix, 3> moved;
    moved.fill(Matrix::Zero(nodes_x, nodes_y));
    for (bool odd_x : {false, true}) {
      for (bool odd_y : {false, true}) {
        // Nothing of a place in the middle is odd.
        if ((!odd_x || place.x_mm != 0.0) && (!odd_y || place.y_mm != 0.0)) {
          solver.add(place, odd_x, odd_y, nodes_x, nodes_y, moved);
        }
      }
    }
    BlockAnswer &answer = answers[n];
    answer = {nodes_x, nodes_y, {}, {}, {}};
    // Pressure is what a lift by one cubic millimetre lets the load do, in MPa per N.
    for (int i = 0; i < nodes_x; i++) {
      for (int j = 0; j < nodes_y; j++) {
        answer.down.push_back(static_cast<float>(1e6 * moved[2](i, j)));
        answer.along_x.push_back(static_cast<float>(-1e6 * moved[0](i, j)));
        answer.along_y.push_back(static_cast<float>(-1e6 * moved[1](i, j)));
      }
    }
    const std::lock_guard<std::mutex> lock(telling);
    done++;
    if (on_progress) {
      on_progress(static_cast<double>(done) / static_cast<double>(places.size()));
    }
  };
  in_parallel(places.size(), solve, std::max(1u, std::thread::hardware_concurrency()));
  return answers;
}

} // namespace fingertip::twin
