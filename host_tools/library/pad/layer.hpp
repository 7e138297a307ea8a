// A rubber layer bonded to a rigid base, loaded on its surface: linear elasticity at small strain, laterally without end.
//
// In wave numbers the layer answers each wave of the surface's load by itself. With H = k h and
//   D = (3-4nu) cosh^2 H + H^2 + (1-2nu)^2:
//   base pressure / surface pressure  T(H) = 2 (1-nu) [2 (1-nu) cosh H + H sinh H] / D
//   surface displacement              2 (1-nu^2) / (E k) W(H)
//                                     W(H) = [(3-4nu) sinh H cosh H - H] / D
// T(0) = 1: the base carries the whole force. W tends to 1, a half-space, for short waves. For long
// waves W / k tends to (1-2nu) h / (2 (1-nu)^2): a bonded layer yields by volume change alone.
//
// A tangential traction t on the rubber, waves exp(i k . x), makes the base pressure
//   -i (k . t / |k|) Q(H),  Q(H) = 2 (1-nu) [H cosh H + (1-2nu) sinh H] / D
// Only the part of t along k makes pressure. The other part shears the layer and presses nowhere, so the base does not feel torsion. Q(H)
// tends to H for long waves: the base carries the moment of t about itself, with more pressure ahead of it, as much less behind, and no
// force. (Plane or axisymmetric Navier equations with u = 0 at z = 0; the tests solve them numerically.)
//
// Left out: the pad's edges (block.hpp), large strain, the sensors' own stiffness in the base, and time (effects.hpp).
#pragma once

namespace fingertip::twin {

struct Layer {
  double thickness_mm;
  double youngs_modulus_Pa;
  double poisson; // below 0.5
};

// Young's modulus from Shore A hardness: Gent, "On the relation between indentation hardness and Young's modulus",
// Rubber Chemistry and Technology 31 (1958). 0.56 MPa at 15 A, the rubber of De Clercq et al., RA-L 2022.
double youngs_modulus_Pa(double shore_a);

// Silicone rubber of Shore 15 A, nu = 0.49: nearly incompressible. Closer to 0.5 the pressure on
// the base hardly changes, but a contact wider than the layer would press infinitely hard.
Layer silicone(double thickness_mm);

// T, W / H, Q and Q / T above, for H >= 0.
double base_transfer(double H, double poisson);
double surface_compliance(double H, double poisson);
double tangential_transfer(double H, double poisson);
// H for long waves, 1 for short ones.
double tangential_share(double H, double poisson);

} // namespace fingertip::twin
