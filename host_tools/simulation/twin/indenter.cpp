#include "simulation/twin/indenter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace fingertip::twin {

constexpr double NOTHING_mm = std::numeric_limits<double>::infinity();
// Printed parts have no sharper edges, and a sharp one would ask for infinite pressure.
constexpr double EDGE_mm = 0.4;

// Quarter of a circle of this radius, from flat to upright; `in` counts from where it begins.
static double rounding(double in, double radius) {
  if (in <= 0.0) {
    return 0.0;
  }
  return in < radius ? radius - std::sqrt(radius * radius - in * in) : NOTHING_mm;
}

static Indenter sphere(const std::string &name, double d, const std::string &description, double E = 0.0) {
  return {name, description, Indenter::Shape::sphere, d, d, d, 0.0, E};
}

static Indenter flat(Indenter::Shape shape, const std::string &name, double size, double edge, const std::string &description) {
  return {name, description, shape, size, size, 0.0, edge, 0.0};
}

static std::vector<Indenter> make() {
  using Shape = Indenter::Shape;
  std::vector<Indenter> all{
      sphere("sphere6", 6, "small spherical indenter, 6 mm"),
      sphere("sphere15", 15, "large spherical indenter, 15 mm"),
      flat(Shape::flat_cylinder, "cylinder6", 6, EDGE_mm, "cylindrical indenter, flat end of 6 mm"),
      flat(Shape::flat_square, "cube6", 6, EDGE_mm, "cubical indenter, flat side of 6 mm"),
      {"ball_bearing", "ball bearing held by its outer ring: steel roller, 22 mm by 7 mm", Shape::roller, 22, 7, 0, EDGE_mm, 0},
      flat(Shape::flat_cylinder, "bottle_cap", 28, 1.5, "bottle cap held by its top: flat disc, 28 mm"),
      {"lime", "lime: ellipsoid 45 by 55 mm, as stiff as its rind, 1 MPa", Shape::ellipsoid, 45, 55, 45, 0, 1e6},
      {"finger", "finger: ellipsoid 16 by 20 mm of 0.15 MPa; assumed", Shape::ellipsoid, 16, 20, 16, 0, 0.15e6},
      sphere("ping_pong", 40, "ping-pong ball: rigid sphere, 40 mm"),
      sphere("rubber_duck", 30, "rubber duck held by its body: sphere 30 mm of soft vinyl, 0.5 MPa", 0.5e6),
  };
  for (int size : {12, 18, 24}) {
    const std::string mm = std::to_string(size);
    all.push_back(sphere("sphere" + mm, size, "sphere of " + mm + " mm"));
    all.push_back({"cylinder" + mm, "cylinder of " + mm + " mm on its side, as long as it is thick", Shape::roller, double(size),
                   double(size), 0, EDGE_mm, 0});
    all.push_back(flat(Shape::flat_square, "cube" + mm, size, EDGE_mm, "cube of " + mm + " mm"));
  }
  return all;
}

double Indenter::profile_mm(double x_mm, double y_mm) const {
  const double x = std::abs(x_mm), y = std::abs(y_mm);
  const double a = 0.5 * size_x_mm, b = 0.5 * size_y_mm, c = 0.5 * size_z_mm;
  switch (shape) {
  case Shape::sphere:
  case Shape::ellipsoid: {
    const double share = x * x / (a * a) + y * y / (b * b);
    return share < 1.0 ? c * (1.0 - std::sqrt(1.0 - share)) : NOTHING_mm;
  }
  case Shape::flat_cylinder: return rounding(std::hypot(x, y) - (a - edge_mm), edge_mm);
  case Shape::flat_square: return rounding(std::max(x, y) - (a - edge_mm), edge_mm);
  case Shape::roller: return (x < a ? a - std::sqrt(a * a - x * x) : NOTHING_mm) + rounding(y - (b - edge_mm), edge_mm);
  }
  return NOTHING_mm;
}

double Indenter::reach_mm() const { return 0.5 * std::max(size_x_mm, size_y_mm); }

const std::vector<Indenter> &indenters() {
  static const std::vector<Indenter> all = make();
  return all;
}

const Indenter &indenter(const std::string &name) {
  std::string names;
  for (const Indenter &one : indenters()) {
    if (one.name == name) {
      return one;
    }
    names += " " + one.name;
  }
  throw std::runtime_error("there is no indenter \"" + name + "\"; choose one of:" + names);
}

} // namespace fingertip::twin
