#include "report/reference/press_sets.hpp"

#include "library/pad/layer.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip::reference {
namespace {

constexpr double POISSON = 0.49;
// Young's modulus of silicone rubber of Shore hardness 15 A by Gent's relation.
constexpr double YOUNG_Pa = 0.56e6;
constexpr double TABLE_REACH = 24.0; // thicknesses
constexpr int STEPS_PER_THICKNESS = 128;

struct Node {
  double at, weight; // on 0..1
};

// Gauss-Legendre rule with n nodes on 0..1, by Newton from the Chebyshev estimate.
std::vector<Node> gauss_legendre(int n) {
  std::vector<Node> nodes;
  for (int i = 0; i < n; i++) {
    double z = std::cos(M_PI * (i + 0.75) / (n + 0.5));
    double slope = 1.0;
    for (int iteration = 0; iteration < 50; iteration++) {
      double p = 1.0, before = 0.0;
      for (int j = 1; j <= n; j++) {
        const double older = before;
        before = p;
        p = ((2 * j - 1) * z * before - (j - 1) * older) / j;
      }
      slope = n * (z * p - before) / (z * z - 1.0);
      const double step = p / slope;
      z -= step;
      if (std::abs(step) < 1e-15) {
        break;
      }
    }
    nodes.push_back({0.5 * (1.0 - z), 1.0 / ((1.0 - z * z) * slope * slope)});
  }
  return nodes;
}

// Pressure under a point load on a layer of thickness 1, [r * STEPS_PER_THICKNESS]: the Hankel
// transform (1 / 2 pi) int u T(u) J0(u r) du. T falls as u exp(-u), and a panel of 1/4 holds one
// period of J0 at the reach.
std::vector<double> tabulate_point_load() {
  struct Wave {
    double u, weight;
  };
  std::vector<Wave> waves;
  const std::vector<Node> rule = gauss_legendre(8);
  for (double start = 0.0; start < 48.0; start += 0.25) {
    for (const Node &node : rule) {
      const double u = start + 0.25 * node.at;
      waves.push_back({u, 0.25 * node.weight * u * twin::base_transfer(u, POISSON) / (2.0 * M_PI)});
    }
  }
  std::vector<double> table;
  const int count = static_cast<int>(TABLE_REACH * STEPS_PER_THICKNESS) + 3;
  for (int i = 0; i < count; i++) {
    double sum = 0.0;
    for (const Wave &wave : waves) {
      sum += wave.weight * j0(wave.u * i / STEPS_PER_THICKNESS);
    }
    table.push_back(sum);
  }
  return table;
}

double half_extent(const std::vector<double> &coordinates) {
  double largest = 0.0;
  for (double c : coordinates) {
    largest = std::max(largest, std::abs(c));
  }
  return largest;
}

} // namespace

char name_of(PressSet set) {
  return static_cast<char>('A' + static_cast<int>(set));
}

double Layer::point_load_Pa(double r_mm) const {
  static const std::vector<double> table = tabulate_point_load();
  const double position = r_mm / thickness_mm_ * STEPS_PER_THICKNESS;
  if (!(position < TABLE_REACH * STEPS_PER_THICKNESS)) {
    return 0.0;
  }
  // Cubic through the four neighbours; the response is even in r.
  const auto i = static_cast<std::size_t>(position);
  const double t = position - static_cast<double>(i);
  const double before = table[i == 0 ? 1 : i - 1];
  const double *at = &table[i];
  const double value = -t * (t - 1.0) * (t - 2.0) / 6.0 * before + (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0 * at[0] -
                       (t + 1.0) * t * (t - 2.0) / 2.0 * at[1] + (t + 1.0) * t * (t - 1.0) / 6.0 * at[2];
  return 1e6 / (thickness_mm_ * thickness_mm_) * value;
}

std::vector<PointLoad> contact_pressure(Indenter indenter, double force_N, double layer_thickness_mm) {
  // With t = sqrt(1 - (r/a)^2) the force within the contour r is dt for the punch, whose pressure
  // goes as 1/t, and 3 t^2 dt for Hertz, whose pressure goes as t. The base sees even powers of r.
  const bool sphere = indenter == Indenter::sphere_6mm || indenter == Indenter::sphere_15mm;
  double a_mm = 3.0;
  if (sphere) {
    const double radius_mm = indenter == Indenter::sphere_6mm ? 3.0 : 7.5;
    const double modulus_Pa = YOUNG_Pa / (1.0 - POISSON * POISSON);
    a_mm = 1e3 * std::cbrt(0.75 * force_N * radius_mm * 1e-3 / modulus_Pa);
    a_mm = std::min({a_mm, radius_mm, layer_thickness_mm});
  }
  static const std::vector<Node> contours = gauss_legendre(6);
  static const std::vector<Node> side = gauss_legendre(6);
  constexpr int DIRECTIONS = 16;
  std::vector<PointLoad> loads;
  for (const Node &contour : contours) {
    const double t = contour.at;
    const double r_mm = a_mm * std::sqrt(1.0 - t * t);
    const double share = contour.weight * (sphere ? 3.0 * t * t : 1.0);
    if (indenter == Indenter::cube_6mm) {
      for (const Node &node : side) {
        const double along_mm = r_mm * (2.0 * node.at - 1.0);
        const double part = 0.25 * share * node.weight;
        loads.push_back({along_mm, r_mm, part});
        loads.push_back({along_mm, -r_mm, part});
        loads.push_back({r_mm, along_mm, part});
        loads.push_back({-r_mm, along_mm, part});
      }
    } else {
      for (int i = 0; i < DIRECTIONS; i++) {
        const double angle = 2.0 * M_PI * (i + 0.5) / DIRECTIONS;
        loads.push_back({r_mm * std::cos(angle), r_mm * std::sin(angle), share / DIRECTIONS});
      }
    }
  }
  return loads;
}

Press make_press(PressSet set, const Array &array, std::uint64_t seed, std::size_t index) {
  constexpr double OUTSIDE_mm = 6.0;
  const double x_half = half_extent(array.x_mm);
  const double y_half = half_extent(array.y_mm);
  Random random(seed, static_cast<std::uint64_t>(set), index);
  for (;;) {
    Press press{};
    press.x_mm = random.uniform(-x_half, x_half);
    press.y_mm = random.uniform(-y_half, y_half);
    if (set == PressSet::B) {
      do {
        press.x_mm = random.uniform(-x_half - OUTSIDE_mm, x_half + OUTSIDE_mm);
        press.y_mm = random.uniform(-y_half - OUTSIDE_mm, y_half + OUTSIDE_mm);
      } while (std::abs(press.x_mm) <= x_half && std::abs(press.y_mm) <= y_half);
    }
    press.noise_Pa = random.log_uniform(2.0, 20.0);
    if (set == PressSet::A || set == PressSet::B) {
      const double sigma_mm = random.log_uniform(3.0, 20.0);
      const double p0_Pa = random.log_uniform(500.0, 100000.0);
      press.force_N = 2.0 * M_PI * p0_Pa * sigma_mm * sigma_mm * 1e-6;
      for (std::size_t k = 0; k < array.x_mm.size(); k++) {
        const double dx = array.x_mm[k] - press.x_mm;
        const double dy = array.y_mm[k] - press.y_mm;
        press.pressure_Pa.push_back(p0_Pa * std::exp(-0.5 * (dx * dx + dy * dy) / (sigma_mm * sigma_mm)));
      }
    } else {
      const Layer layer(set == PressSet::C ? 12.0 : 6.0);
      press.force_N = random.log_uniform(1.0, 25.0);
      const Indenter indenter = ALL_INDENTERS[random.next() % ALL_INDENTERS.size()];
      const auto loads = contact_pressure(indenter, press.force_N, layer.thickness_mm());
      for (std::size_t k = 0; k < array.x_mm.size(); k++) {
        double sum = 0.0;
        for (const PointLoad &load : loads) {
          const double dx = array.x_mm[k] - press.x_mm - load.x_mm;
          const double dy = array.y_mm[k] - press.y_mm - load.y_mm;
          sum += load.share * layer.point_load_Pa(std::sqrt(dx * dx + dy * dy));
        }
        press.pressure_Pa.push_back(press.force_N * sum);
      }
    }
    for (double &p : press.pressure_Pa) {
      p += press.noise_Pa * random.normal();
    }
    if (*std::max_element(press.pressure_Pa.begin(), press.pressure_Pa.end()) >= GATE_SIGMAS * press.noise_Pa) {
      return press;
    }
  }
}

std::vector<std::int32_t> quantise(const std::vector<double> &pressure_Pa, double lsb_Pa) {
  std::vector<std::int32_t> q10;
  for (double p : pressure_Pa) {
    const double rounded = lsb_Pa * std::round(p / lsb_Pa);
    q10.push_back(static_cast<std::int32_t>(std::lround(1024.0 * rounded)));
  }
  return q10;
}

} // namespace fingertip::reference
