#include "library/pad/block.hpp"

#include "libfingertip/in_parallel.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <stdexcept>
#include <thread>
#include <utility>

namespace fingertip::twin {
namespace {

using Eigen::Index;
using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

// Residual at which conjugate gradients end, relative to the load.
constexpr double SETTLED = 1e-7;
constexpr int STEPS_MAX = 3000;

// The rest is smooth over a thickness, 3 mm at least: the cubic between these is good to 1e-6.
constexpr double STEP_mm = 0.25;
// Waves with more than this many radians in a thickness are nothing at the surface, exp(-32).
constexpr double H_END = 32.0;
// Panels of eight points each: this many radians of wave number times the largest distance.
constexpr double PANEL_rad = 6.0;

// Gauss and Legendre, eight points in -1..1.
constexpr double POINT[4] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363};
constexpr double WEIGHT[4] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};

// Displacement (i u along the wave, w upward) of one wave and its derivatives by k z.
struct Wave {
  double u, w, du, dw;
};

// The four solutions of one wave number: fading upwards from the base or downwards from the
// surface, y = k z or k (z - h), each as a gradient and as Papkovich and Neuber's.
Wave solution(int n, double kz, double kh, double b) {
  const bool up = n < 2;
  const double y = up ? kz : kz - kh, e = std::exp(up ? -kz : kz - kh), s = up ? -1.0 : 1.0;
  if (n % 2 == 0) {
    return {e, s * e, s * e, e};
  }
  return {-y * e, (b - s * y) * e, -(1.0 + s * y) * e, (s * b - s - y) * e};
}

// A layer (layer.hpp) with one point of its base lifted. The base moves by a unit of volume (1
// mm^3) upwards at r = 0 and nowhere else. The surface is free.
//
// Betti's theorem: the surface's displacement there is the pressure of that point of the base per force on the surface (block.hpp). This is
// the stress inside. An infinite layer holds itself with that stress. A block with free sides lacks it.
//
// Waves of a lift exp(i k . x) have two parts. The first is the displacement of a half-space above the base, in closed form,
//   u_z = (1 + k z / b) exp(-k z),  u_r = -k z / b exp(-k z),  b = 3 - 4 nu
// The rest has no displacement at the base, and takes the stress from the surface: (1, -+1) exp(-+k z) and the terms of
// Papkovich and Neuber, with four constants for each k. The rest falls as exp(-k h), so its integrals over k are short.
class PointLift {
public:
  // At these heights above the base (0..thickness), for distances from r_min_mm to r_max_mm.
  PointLift(const Layer &layer, std::vector<double> heights_mm, double r_max_mm)
      : poisson_(layer.poisson), heights_mm_(std::move(heights_mm)), distances_(static_cast<std::size_t>(r_max_mm / STEP_mm) + 4) {
    const double h = layer.thickness_mm, b = 3.0 - 4.0 * poisson_;
    const double lame = 2.0 * poisson_ / (1.0 - 2.0 * poisson_); // per shear modulus
    const double k_end = H_END / h;
    const int panels = static_cast<int>(k_end * r_max_mm / PANEL_rad) + 8;
    const Eigen::Index waves = 8 * panels, heights = static_cast<Eigen::Index>(heights_mm_.size());
    Eigen::MatrixXd volume(waves, heights), along(waves, heights), shear(waves, heights);
    Eigen::VectorXd k_of(waves);
    for (Eigen::Index n = 0; n < waves; n++) {
      const std::size_t q = static_cast<std::size_t>(n % 8);
      const double half = 0.5 * k_end / panels, sign = q < 4 ? -1.0 : 1.0;
      const double k = half * (2.0 * static_cast<double>(n / 8) + 1.0 + sign * POINT[q % 4]);
      const double kh = k * h;
      // Free of stress at the surface, with the half-space's; held at the base.
      const auto stresses = [&](const Wave &wave) { return std::pair{lame * (wave.dw - wave.u) + 2.0 * wave.dw, wave.du + wave.w}; };
      Eigen::Matrix4d conditions;
      for (int c = 0; c < 4; c++) {
        const Wave base = solution(c, 0.0, kh, b), top = solution(c, kh, kh, b);
        const auto [normal, tangential] = stresses(top);
        conditions.col(c) << base.u, base.w, normal, tangential;
      }
      const auto [normal, tangential] = stresses(solution(1, kh, kh, b));
      const Eigen::Vector4d amount = conditions.fullPivLu().solve(Eigen::Vector4d(0.0, 0.0, -normal / b, -tangential / b));
      const double weight = half * WEIGHT[q % 4] * k * k / (2.0 * M_PI);
      k_of[n] = k;
      for (Eigen::Index z = 0; z < heights; z++) {
        Wave sum{0.0, 0.0, 0.0, 0.0};
        for (int c = 0; c < 4; c++) {
          const Wave one = solution(c, k * heights_mm_[static_cast<std::size_t>(z)], kh, b);
          sum.u += amount[c] * one.u;
          sum.w += amount[c] * one.w;
          sum.du += amount[c] * one.du;
          sum.dw += amount[c] * one.dw;
        }
        volume(n, z) = weight * (sum.dw - sum.u);
        along(n, z) = -weight * sum.u;
        shear(n, z) = -weight * (sum.du + sum.w);
      }
    }
    Eigen::MatrixXd j0(distances_, waves), j1(distances_, waves), j2(distances_, waves);
    for (Eigen::Index r = 0; r < j0.rows(); r++) {
      for (Eigen::Index n = 0; n < waves; n++) {
        const double kr = k_of[n] * STEP_mm * static_cast<double>(r);
        j0(r, n) = ::j0(kr);
        j1(r, n) = ::j1(kr);
        j2(r, n) = kr > 0.0 ? 2.0 * j1(r, n) / kr - j0(r, n) : 0.0;
      }
    }
    const Eigen::MatrixXd volumes = j0 * volume, planes = j0 * along, stretches = -j2 * along, shears = j1 * shear;
    rest_.reserve(distances_ * heights_mm_.size());
    for (Eigen::Index z = 0; z < heights; z++) {
      for (Eigen::Index r = 0; r < j0.rows(); r++) {
        rest_.push_back({volumes(r, z), planes(r, z), stretches(r, z), shears(r, z)});
      }
    }
  }

  // Per shear modulus and per unit of volume lifted, 1 / mm^3.
  struct Stress {
    double rr, tt, rz; // along r, around the axis, shear
  };
  // r_mm > 0.
  Stress stress(double r_mm, std::size_t height) const {
    const auto [first, weight] = cubic_at(r_mm / STEP_mm, static_cast<int>(distances_));
    Parts sum = half_space(r_mm, heights_mm_[height]);
    for (std::size_t n = 0; n < 4; n++) {
      const Parts &part = rest_[height * distances_ + static_cast<std::size_t>(first) + n];
      sum.volume += weight[n] * part.volume;
      sum.plane += weight[n] * part.plane;
      sum.stretch += weight[n] * part.stretch;
      sum.shear += weight[n] * part.shear;
    }
    const double lame = 2.0 * poisson_ / (1.0 - 2.0 * poisson_);
    return {lame * sum.volume + sum.plane + sum.stretch, lame * sum.volume + sum.plane - sum.stretch, sum.shear};
  }

private:
  struct Parts { // of the displacement's derivatives
    double volume, plane, stretch, shear;
  };
  // With f = z / (2 pi R^3), which is harmonic, u = f e_z - z / b grad f.
  Parts half_space(double r, double z) const {
    const double b = 3.0 - 4.0 * poisson_, R2 = r * r + z * z;
    const double by = 1.0 / (2.0 * M_PI * R2 * R2 * std::sqrt(R2)); // R^-5 / (2 pi)
    const double f_z = (r * r - 2.0 * z * z) * by, f_r = -3.0 * z * r * by;
    const double f_rz = 3.0 * r * (4.0 * z * z - r * r) / R2 * by;
    const double f_rr_less = 15.0 * z * r * r / R2 * by; // f_rr - f_r / r
    const double f_zz = 3.0 * z * (2.0 * z * z - 3.0 * r * r) / R2 * by;
    return {f_z * (1.0 - 1.0 / b), z / b * f_zz, -z / b * f_rr_less, f_r * (1.0 - 1.0 / b) - 2.0 * z / b * f_rz};
  }

  double poisson_;
  std::vector<double> heights_mm_;
  std::vector<Parts> rest_; // [height][distance]
  std::size_t distances_;
};

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

// Values (or derivatives) at s, in -1..1, of the polynomials that are 1 at one of the nodes and 0 at the others.
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
    made.segment((above - 1 - edges_.begin()) * degree_, degree_ + 1) = lagrange(nodes_, (place - begin) / half - 1.0, false);
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
  Eigen::Map<Matrix>(out.data(), by.rows(), from.y * from.z).noalias() += by * Eigen::Map<const Matrix>(in.data(), from.x, from.y * from.z);
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

// A quarter of the block, x and y from 0 on, for fields that are even or odd: as the vertical displacement is.
class Quarter {
public:
  Quarter(const Line &x, const Line &y, const Line &z, bool odd_x, bool odd_y, double lame)
      : lame_(lame), x_{Modes(x, !odd_x), Modes(x, odd_x)}, y_{Modes(y, !odd_y), Modes(y, odd_y)}, z_(z, true),
        gx_(slopes_by_values(x, x_[0], x_[1])), hx_(slopes_by_values(x, x_[1], x_[0]).transpose()), gy_(slopes_by_values(y, y_[0], y_[1])),
        hy_(slopes_by_values(y, y_[1], y_[0]).transpose()), gz_(slopes_by_values(z, z_, z_)) {
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
  static void along(std::size_t c, const Matrix &by_x, const Matrix &by_y, const Matrix &by_z, const Vector &in, const Shape &from,
                    Vector &out, bool add) {
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
        const Matrix projected = (along.values() * modes.modes).transpose() * along.weights().asDiagonal() * traction[c] *
                                 z_.weights().asDiagonal() * (z_.values() * quarter.z_of().modes);
        const Line &across = of_x ? x_ : y_;
        const Vector end = (of_x ? quarter.x_of(c) : quarter.y_of(c)).modes.transpose() * across.values_at(across.end());
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

Cubic cubic_at(double at, int nodes) {
  const int first = std::clamp(static_cast<int>(at) - 1, 0, nodes - 4);
  const double t = at - first - 1;
  return {first,
          {-t * (t - 1.0) * (t - 2.0) / 6.0, (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0, -(t + 1.0) * t * (t - 2.0) / 2.0,
           (t + 1.0) * t * (t - 1.0) / 6.0}};
}

int block_nodes(double half_mm, double step_mm) { return static_cast<int>(std::ceil(2.0 * half_mm / step_mm)) + 1; }

std::vector<BlockAnswer> solve_block(const Block &block, const std::vector<Place> &places, double step_mm, const BlockGrid &grid,
                                     const std::function<void(double)> &on_progress) {
  double reach_mm = 0.0;
  for (const Place &place : places) {
    reach_mm = std::max(reach_mm, std::hypot(block.half_x_mm + std::abs(place.x_mm), block.half_y_mm + std::abs(place.y_mm)));
  }
  const BlockSolver solver(block, grid, reach_mm);
  const int nodes_x = block_nodes(block.half_x_mm, step_mm);
  const int nodes_y = block_nodes(block.half_y_mm, step_mm);
  std::vector<BlockAnswer> answers(places.size());
  const auto caller = std::this_thread::get_id();
  std::atomic<std::size_t> done{0};
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
    const std::size_t finished = ++done;
    if (on_progress && finished < places.size() && std::this_thread::get_id() == caller) {
      on_progress(static_cast<double>(finished) / static_cast<double>(places.size()));
    }
  };
  in_parallel(places.size(), solve, std::max(1u, std::thread::hardware_concurrency()));
  if (on_progress) {
    on_progress(1.0);
  }
  return answers;
}

} // namespace fingertip::twin
