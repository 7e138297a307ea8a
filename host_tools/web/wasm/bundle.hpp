// One contact of a held object, along the rubber: two displacements and a turn.
//
// The model of simulation/twin/held_object.hpp in three directions: a bundle of elements side by side, each a spring with a damper that
// ends in a slider (Iwan, J. Appl. Mech. 34, 1967), such that a growing pull meets what Cattaneo and Mindlin's contact does. A turn counts
// by the way LEVER contact radii out make of it, so that what friction holds is an ellipsoid,
//   Qx^2 + Qy^2 + (T / (LEVER a))^2 <= (mu F)^2,   LEVER a mu F: torque that spins a Hertz contact
// (Howe and Cutkosky, "Practical force-motion models for sliding manipulation", Int. J. Robotics
// Research 15, 1996; the torque: Lubkin, J. Appl. Mech. 18, 1951). Sliding is along the
// ellipsoid's normal. So an object that spins carries less, and one that slides is turned easily.
//
// Friction falls with gross slip and heals at rest by the twin's law and constants. A turn is TURN_STIFFNESS as stiff as a pull, as on a
// half-space of nu = 0.5; its damping is the same, so a swing rings on for longer than on real rubber.
//
// Left out: the rubber's mass, its tangential relaxation, friction that grows with speed, rolling.
#pragma once

#include <array>

namespace fingertip::web {

// Along x and y of the hand's frame and about the grasp's axis.
struct Wrench {
  double x_N = 0.0, y_N = 0.0, turn_Nmm = 0.0;
};
struct Motion {
  double x_mm_s = 0.0, y_mm_s = 0.0, turn_rad_s = 0.0;
};

class Bundle {
public:
  static constexpr double LEVER = 0.589; // 3 pi / 16
  static constexpr double TURN_STIFFNESS = 2.9;

  // kinetic_share: kinetic friction per static one.
  Bundle(double friction, double kinetic_share);

  // The normal force, the rubber's tangential stiffness under it while nothing slides, the radius of the contact. Gives
  // what the rubber does to the object. Up to 0.2 ms while nothing slides, 0.05 ms while all does.
  Wrench step(double seconds, double force_N, double stiffness_N_mm, double radius_mm, const Motion &motion);

  // Static friction falls or rises to this; kinetic goes along.
  void set_friction(double friction) { static_ = friction; }
  double friction() const { return static_ * (kinetic_share_ + (1.0 - kinetic_share_) * rested_); }
  bool slips() const { return slips_; }           // all slides
  double slip_mm_s() const { return slip_mm_s_; } // and how fast; 0 unless it does
  double pull_x_N() const { return pull_x_N_; }   // of the object on the rubber, last step
  double pull_y_N() const { return pull_y_N_; }
  double lost_mJ() const { return lost_mJ_; } // in friction and the rubber's damping
  double elastic_mJ(double stiffness_N_mm) const;

private:
  static constexpr std::size_t ELEMENTS = 12;
  // [element]; springs along x and y and, per LEVER a, about the axis.
  std::array<double, ELEMENTS> stiffness_share_, friction_share_;
  std::array<double, ELEMENTS> x_N_{}, y_N_{}, t_N_{};
  double static_, kinetic_share_;
  double rested_ = 1.0;
  bool slips_ = false;
  double slip_mm_s_ = 0.0, pull_x_N_ = 0.0, pull_y_N_ = 0.0, lost_mJ_ = 0.0;
};

} // namespace fingertip::web
