// Simulated presses that the fit is measured on, deterministic from a seed.
//
//   A  Gaussian inside the array: sigma 3..20 mm, peak 0.5..100 kPa
//   B  the same, centre up to 6 mm outside the array
//   C  elastic layer of 12 mm on the sensors, the paper's four indenters, 1..25 N
//   D  elastic layer of 6 mm: stiff, the pressure is narrower than the pitch tells well
//
// Noise 2..20 Pa rms, every range log-uniform, location uniform over the array (18 x 36 mm, De
// Clercq et al., RA-L 2022). Presses whose largest reading is below 20 noise sigmas would not pass
// the firmware's gate and are drawn again.
//
// C and D: pressure on the bonded base of a linear elastic layer under a contact pressure without
// friction. The contact pressure is assumed, not solved: Hertz for the spheres (radius from the
// force by Hertz for a half-space, at most the sphere's radius and the layer's thickness), the
// rigid punch on a half-space for the cylinder, its analogue with square contours for the cube.
// That is a model different from the fitted Gaussian, with the width and tails of a layer; it is
// not a contact solver and says nothing about hyperelastic rubber.
#pragma once

#include "libfingertip/random.hpp"
#include "report/reference/reference.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace fingertip::reference {

using fingertip::Random;

// A press counts if its largest reading is at least so many times the noise, as at the firmware's
// gate.
constexpr double GATE_SIGMAS = 20.0;

enum class PressSet { A, B, C, D };
constexpr std::array<PressSet, 4> ALL_PRESS_SETS{PressSet::A, PressSet::B, PressSet::C, PressSet::D};
char name_of(PressSet set);

struct Press {
  double x_mm, y_mm;               // where the contact truly is
  double force_N;                  // true; for a Gaussian 2 pi p0 sigma^2
  double noise_Pa;                 // rms
  std::vector<double> pressure_Pa; // [sensor], exact value plus noise
};

// Press number `index` of a set; independent of how many are drawn.
Press make_press(PressSet set, const Array &array, std::uint64_t seed, std::size_t index);

// As the firmware receives it, 1/1024 Pa, after rounding to multiples of lsb_Pa.
std::vector<std::int32_t> quantise(const std::vector<double> &pressure_Pa, double lsb_Pa = 1.0 / 1024.0);

// Pressure on the base of a bonded elastic layer of Poisson's ratio 0.49 (pad/layer.hpp).
class Layer {
public:
  explicit Layer(double thickness_mm) : thickness_mm_(thickness_mm) {}
  double thickness_mm() const { return thickness_mm_; }
  // Under a point load of 1 N, at distance r_mm from it, Pa. Relative error to the peak below 1e-7;
  // 0 beyond 24 thicknesses.
  double point_load_Pa(double r_mm) const;

private:
  double thickness_mm_;
};

enum class Indenter { sphere_6mm, sphere_15mm, cylinder_6mm, cube_6mm };
constexpr std::array<Indenter, 4> ALL_INDENTERS{Indenter::sphere_6mm, Indenter::sphere_15mm, Indenter::cylinder_6mm,
                                                Indenter::cube_6mm};

// The contact pressure as point loads: quadrature nodes relative to the contact's centre.
struct PointLoad {
  double x_mm, y_mm, share; // shares are positive and add up to 1
};
std::vector<PointLoad> contact_pressure(Indenter indenter, double force_N, double layer_thickness_mm);

} // namespace fingertip::reference
