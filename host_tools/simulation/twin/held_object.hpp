// An object that a grip presses on the rubber while a load pulls it along: whether, when and how
// fast it slips comes out of its equation of motion,
//   mass d2x/dt2 = load - Q
// along one line, x from where nothing pulled, Q what the rubber holds against it.
//
// The contact is a bundle of elements, each a spring with a damper that ends in a slider, side by side (Iwan, "On a class of models for the
// yielding behavior of continuous and composite systems", J. Appl. Mech. 34, 1967). Springs and sliders are such that a growing load meets
// what Cattaneo and Mindlin's contact does ("Compliance of elastic bodies in contact", J. Appl. Mech. 16, 1949),
//   Q = mu F (1 - (1 - x / d)^(3/2)),  d = 1.5 mu F / stiffness
// and so does, with both axes doubled, one that turns back, as in Mindlin and Deresiewicz' at constant F (J. Appl. Mech. 20, 1953):
// Masing's rule. More and more of the elements slide: partial slip. Where all do, x is no longer held: gross slip.
//
// Friction: a slider holds its share of mu F. mu falls from the static to the kinetic one within
// some SETTLES_mm of gross slip and grows back in some HEALS_s of rest,
//   mu = kinetic + (static - kinetic) h,  dh/dt = (1 - h) / HEALS_s - h u / SETTLES_mm
// where u is the speed of gross slip: a simple form of the laws of state (Rabinowicz, "The nature of the static and
// kinetic coefficients of friction", J. Appl. Phys. 22, 1951; Ruina, "Slip instability and state variable friction
// laws", J. Geophys. Res. 88, 1983). In steady slip it is smooth in the speed. Both constants are assumed, and so is
// that friction of rubber does not grow with speed, which depends on rubber, object and dirt.
//
// Assumed besides: where F changes, springs go with the contact's radius and sliders with F, and
// what is in a spring stays; springs are damped with LOSS_s, a loss factor of 0.1 at 100 rad/s.
// Left out: the rubber's mass, its relaxation, rolling and tilting, the normal force's own motion.
#pragma once

#include <array>

namespace fingertip::twin {

// Q / (mu F) over x / d.
double mindlin(double share);

class HeldObject {
public:
  static constexpr double SETTLES_mm = 0.2, HEALS_s = 0.1, LOSS_s = 1e-3;
  // A slide of up to 30 mm ends within 3 um of where steps fifty times shorter end it.
  static constexpr double STEP_s = 5e-5;

  // kinetic_share: kinetic friction per static one.
  HeldObject(double mass_kg, double friction, double kinetic_share);

  // The grip's force, the rubber's tangential stiffness under it while nothing slides, the load.
  void step(double seconds, double force_N, double stiffness_N_mm, double load_N);

  double way_mm() const { return way_mm_; }
  double speed_mm_s() const { return speed_mm_s_; }
  double tangential_N() const { return tangential_N_; } // Q, over the last step
  double friction() const;                              // mu, now
  bool slips() const { return slips_; }                 // all slides

  // What the load's work has become, mJ: balances while force and stiffness stay.
  struct Energy {
    double work = 0.0, kinetic = 0.0, elastic = 0.0;
    double damped = 0.0, rubbed = 0.0; // lost in the rubber, in friction
  };
  Energy energy() const;

private:
  static constexpr int ELEMENTS = 32;
  struct Element {
    double stiffness_share, friction_share; // of the bundle's
    double spring_N;
  };
  std::array<Element, ELEMENTS> elements_;
  double mass_kg_, static_, kinetic_;
  double rested_ = 1.0; // h
  double way_mm_ = 0.0, speed_mm_s_ = 0.0, tangential_N_ = 0.0, stiffness_N_mm_ = 1.0;
  bool slips_ = false;
  double work_mJ_ = 0.0, damped_mJ_ = 0.0, rubbed_mJ_ = 0.0;
};

} // namespace fingertip::twin
