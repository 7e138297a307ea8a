// Contact shapes: the paper's four indenters, spheres, cylinders and cubes of three sizes, and approximations of its
// five objects (De Clercq et al., RA-L 2022, figures 4 and 5 and tables III and IV).
//
// The approximations are ours; the paper gives names and pictures, no measures. A body softer than steel
// yields as an elastic half-space does.
#pragma once

#include <string>
#include <vector>

namespace fingertip::twin {

struct Indenter {
  enum class Shape {
    sphere,        // sizes: diameter. A hemisphere on a shaft: nothing beyond its radius touches
    flat_cylinder, // sizes: diameter. A flat end, its edge rounded by edge_mm
    flat_square,   // sizes: side. A flat end, its edge rounded too
    ellipsoid,     // sizes: the two diameters along x and y, and the height. A hemisphere's like
    roller,        // sizes: diameter, length along y. A cylinder on its side
  };
  std::string name;
  std::string description;
  Shape shape;
  double size_x_mm, size_y_mm, size_z_mm;
  double edge_mm;           // radius of the rounded edge; 0 where there is none
  double youngs_modulus_Pa; // of its own half-space, with nu = 0.49; 0: rigid

  // Height of its surface above its lowest point; infinite where it has none. Even in x and y.
  double profile_mm(double x_mm, double y_mm) const;
  // Half the extent of what can touch, along x and y.
  double reach_mm() const;
};

// All of them, in the order of the paper.
const std::vector<Indenter> &indenters();
// Throws std::runtime_error, with the names that there are.
const Indenter &indenter(const std::string &name);

} // namespace fingertip::twin
