// Grasps as they differ from each other: rubber, object, lift, what happens then, and the line.
//
// All of it is drawn from ranges. A kind is a set of ranges; kinds.cpp has them. The n-th grasp of
// a kind and seed is always the same. host_tools/grasp/control/CONTROL.md has the table of kinds.
#pragma once

#include "simulation/cell/cell.hpp"

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace fingertip::cell {

enum class Kind { gentle, usual, rough, slick, fragile };
constexpr std::array<Kind, 5> KINDS = {Kind::gentle, Kind::usual, Kind::rough, Kind::slick, Kind::fragile};
const char *name_of(Kind kind);
// Throws std::runtime_error: there is none.
Kind kind_of(const std::string &name);

// Since the lift began.
struct Event {
  enum class Kind {
    knock,   // amount: speed that the object would get, m/s
    push,    // in weights of the object, for its duration
    vibrate, // the hand's acceleration, m/s2, at rate_Hz
    pour,    // mass that comes, of the object's own
    carry,   // the hand's largest acceleration, m/s2, on a way of minimum jerk
    slick,   // share of friction that goes
  };
  Kind kind;
  double begin_s, seconds, amount;
  double angle_rad; // from upwards
  double rate_Hz;
};
const char *name_of(Event::Kind kind);

struct KindOfPad {
  double at_1_mm_N;  // force at 1 mm of indentation
  double relaxation; // share of the force lost in 8 s
  double friction;   // static
  double gain;       // of the force that it reports, over the true one
  Vector ratio;      // error of tangential over normal force
  double crosstalk;  // mm that a load as large as the force moves the reported location
  double delay_s;    // of its frames, beyond SimulatedFingertip's
};

struct KindOfGrasp {
  Kind kind;
  std::string object; // of kind fragile
  std::array<KindOfPad, 2> pads;
  double exponent;                  // of force over indentation
  double shear_N_mm;                // tangential stiffness of a pad at 4 N
  double rubber_N_s_mm;             // damping of it, with the loss at the contact's edge
  double kinetic_share;             // of static friction, at speed
  double stribeck_mm_s;             // at which friction has fallen by 63 % of the way there
  double width_mm, mass_kg, off_mm; // off_mm: from the middle between the fingers
  double table_friction;
  double crushes_N;
  double opens_mm;
  double waits_s;         // from HOLDING to the lift
  double lift_mm, lift_s; // minimum jerk
  std::vector<Event> events;
  double steady_s, ends_s; // nothing happens any more from steady_s on
  double jitter_s;         // of frames
  double lost_share;       // of frames
  int gone;                // this fingertip goes silent, -1: none
  double gone_s;           // since the lift began
  double poll_factor;      // how much slower the gripper's line is than its traits

  struct Inputs { // external inputs
    double lifted_mm = 0.0, lift_mm_s = 0.0;
    Vector hand_m_s2; // y is upwards
    Vector push_N;
    double mass_kg = 0.0, friction_share = 1.0;
    bool table = true;
  };
  Inputs inputs(double since_lift_s) const;
  // Grip of one fingertip that holds what is carried then, by static friction.
  double least_N(double since_lift_s) const;
};

// No grasp needs more than this at its worst, by kinetic friction.
constexpr double NEEDS_MOST_N = 16.0;

KindOfGrasp draw_grasp(Kind kind, std::uint64_t seed, std::uint64_t n);

} // namespace fingertip::cell
