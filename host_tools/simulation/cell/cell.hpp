// The simulated cell: two fingertips' rubber face each other, an object is between them, and a
// table under it until the hand lifts. How hard the grip presses follows from the gripper's width,
// how the object moves from its equations of motion.
//
// The hand's frame: the grasp's axis is normal to x and y, which are fingertip 0's; fingertip 1
// faces it, so its x is -x. Gravity lies in that plane.
//
// Grip. Both pads and whatever else gives are springs in a row, so both carry the same force F:
//   2 indentation(F) + F / compliance = object's width - gripper's width
// less what the rubber relaxes: the Prony series of simulation/twin/effects.hpp applies to the force, since a
// gripper holds its position. The rubber's width is that between its faces when nothing presses.
//
// Object. A rigid body in the plane, gravity and what the hand's acceleration adds at its centre of
// mass, which need not lie on the grasp's axis: then it turns there against both contacts
// (bundle.hpp). On the table it has two feet, each a stiff spring with a damper that only
// pushes. Contacts go along with the object over the pads.
//
// Checked by tests: static force against width, slip at mu, free fall, torque against closed forms,
// the balance of energy, shorter steps.
//
// Left out: pads that end, tilting out of the plane, different loads on the two sides but by their
// friction, rolling, inertia of what is poured, contact with the table's friction.
#pragma once

#include "simulation/cell/bundle.hpp"
#include "simulation/cell/face.hpp"

#include <array>
#include <limits>
#include <vector>

namespace fingertip::cell {

constexpr double GRAVITY_m_s2 = 9.81;

struct Vector {
  double x = 0.0, y = 0.0;
  double dot(const Vector &other) const { return x * other.x + y * other.y; }
};

struct Object {
  double width_mm = 40.0, mass_kg = 0.3;
  double friction = 0.5, kinetic_share = 0.8;
  double uneven_friction = 0.0;                                    // fingertip 0 has 1 + this of it, the other 1 - this
  Vector com_mm;                                                   // centre of mass from the grasp's axis, on the table
  double gyration_mm = 25.0;                                       // radius of gyration about it
  double base_mm = 40.0;                                           // between its feet
  double stiffness_N_mm = std::numeric_limits<double>::infinity(); // when squeezed
  double crushes_N = std::numeric_limits<double>::infinity();      // and then it is broken
};

struct Grasp {
  Vector place_mm;           // where it touches, fingertip 0
  double angle_rad = 0.0;    // fingertip 0: its face is turned by
  double down_rad = 0.0;     // direction of gravity from x towards y
  double relaxation = 0.175; // share of the force lost in 8 s; real pads: 0.04 to 0.14 (simulation/twin/README.md)
  // The rubber's tangential stiffness per radius of contact: 8 G / (2 - nu), as on a half-space of
  // Shore 15 A (Mindlin, J. Appl. Mech. 16, 1949). A sphere of 15 mm then goes 1 mm before it slips
  // at 6 N and a friction of 0.5.
  double shear_N_mm2 = 1.0;
  double fingers_N_mm = 50.0; // both fingers' own stiffness in a row; assumed
};

// External inputs, in the hand's frame.
struct Drive {
  double width_mm = 100.0; // of the gripper
  Vector hand_m_s2;        // acceleration of the hand
  double lifted_mm = 0.0, lift_mm_s = 0.0;
  bool table = true;
  double mass_kg = 0.0;        // now
  double friction_share = 1.0; // of the object's
  Vector knock_N;              // at the centre of mass
};

class Cell {
public:
  // The longest that a step may be, while the object rests and while it slips.
  static constexpr double REST_s = 2e-4, SLIP_s = 5e-5;

  // face must outlive it.
  Cell(const Face &face, const Object &object, const Grasp &grasp);

  // Advances by this time, in steps of its own.
  void run(double seconds, const Drive &drive);

  double force_N() const { return force_N_; }
  // What the gripper at this width would have to press against now.
  double force_at_N(double width_mm) const;
  // The touch of fingertip 0 or 1, in its own x and y.
  twin::Touch touch(std::size_t finger) const;

  Vector way_mm() const; // of the grasped point, from where it was touched
  double turned_rad() const { return turn_rad_; }
  Vector speed_mm_s() const { return speed_; } // of the grasped point
  double turning_rad_s() const { return turning_; }
  // The object slips: all of both contacts does.
  bool slips() const { return bundles_[0].slips() && bundles_[1].slips(); }
  double slid_mm() const { return slid_mm_; } // in all; a turn is none
  double friction(std::size_t finger) const { return bundles_[finger].friction(); }
  double table_N() const { return table_N_; }
  Vector down() const { return down_; }

  // mJ since the beginning: work of weight, hand and knocks; what has become of it. Balances while
  // the width stays.
  struct Energy {
    double work = 0.0, kinetic = 0.0, elastic = 0.0, lost = 0.0;
  };
  Energy energy() const;

private:
  void step(double seconds, const Drive &drive);
  void press(double seconds, double width_mm);
  double elastic_N(double squeezed_mm) const;
  Wrench table(const Drive &drive);
  Vector arm() const; // from the grasped point to the centre of mass

  const Face &face_;
  Object object_;
  Grasp grasp_;
  Vector down_;
  std::vector<float> force_by_squeeze_; // each SQUEEZE_STEP_mm
  std::array<Bundle, 2> bundles_;

  // Relaxation
  std::array<double, 2> strength_{}, follows_N_{};
  double elastic_N_ = 0.0, force_N_ = 0.0;

  // The centre of mass, from where the grasped point was.
  Vector com_mm_, com_mm_s_;
  Vector speed_; // of the grasped point
  double turn_rad_ = 0.0, turning_ = 0.0;
  double mass_kg_;
  double table_mm_; // depth of the feet in the table under its weight
  double table_N_ = 0.0;
  double slid_mm_ = 0.0, work_mJ_ = 0.0, table_lost_mJ_ = 0.0;
};

} // namespace fingertip::cell
