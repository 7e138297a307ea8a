// One contact of a held object, along the rubber in two directions.
//
// The model of simulation/twin/held_object.hpp in two directions: a bundle of elements side by side, each a spring with a damper that
// ends in a slider (Iwan, J. Appl. Mech. 34, 1967), such that a growing pull meets what Cattaneo and Mindlin's contact does. Sliding is
// against the pull. Friction falls with gross slip and heals at rest by the twin's law and constants.
//
// Left out: the rubber's mass, its tangential relaxation, friction that grows with speed, rolling, turning.
#pragma once

#include <array>

namespace fingertip::web {

struct Motion {
  double x_mm_s = 0.0, y_mm_s = 0.0;
};

class Bundle {
public:
  // kinetic_share: kinetic friction per static one.
  Bundle(double friction, double kinetic_share);

  // The normal force, and the rubber's tangential stiffness under it while nothing slides. Up to 0.2 ms while nothing
  // slides, 0.05 ms while all does.
  void step(double seconds, double force_N, double stiffness_N_mm, const Motion &motion);

  // Static friction falls or rises to this; kinetic goes along.
  void set_friction(double friction) { static_ = friction; }
  double friction() const { return static_ * (kinetic_share_ + (1.0 - kinetic_share_) * rested_); }
  bool slips() const { return slips_; }           // all slides
  double slip_mm_s() const { return slip_mm_s_; } // and how fast; 0 unless it does
  double pull_x_N() const { return pull_x_N_; }   // of the object on the rubber, last step
  double pull_y_N() const { return pull_y_N_; }

private:
  static constexpr std::size_t ELEMENTS = 12;
  std::array<double, ELEMENTS> stiffness_share_, friction_share_; // [element]
  std::array<double, ELEMENTS> x_N_{}, y_N_{};                    // of its spring
  double static_, kinetic_share_;
  double rested_ = 1.0;
  bool slips_ = false;
  double slip_mm_s_ = 0.0, pull_x_N_ = 0.0, pull_y_N_ = 0.0;
};

} // namespace fingertip::web
