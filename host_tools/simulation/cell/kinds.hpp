// Grasps as they differ from each other: rubber, object, lift, what happens then, and the line.
//
// A kind is a set of ranges (kinds.cpp; CONTROL.md has a table). The n-th grasp of a kind and seed is always the same.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace fingertip::cell {

constexpr double GRAVITY_m_s2 = 9.81;

struct Vector {
  double x = 0.0, y = 0.0;
};

// Of the object: what touches the pads is a point (ball, egg), a line (upright, lying, cup) or an area.
enum class Shape {
  ball,
  egg, // upright
  box,
  plate,   // a box, thin along the grip's axis
  upright, // cylinder
  lying,   // cylinder, its axis level and along the pads
  cup,     // an upright cylinder: its cone is left out
};
constexpr std::array<Shape, 7> SHAPES = {Shape::ball, Shape::egg, Shape::box, Shape::plate, Shape::upright, Shape::lying, Shape::cup};
const char *name_of(Shape shape);

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
    lower,   // back onto the table, minimum jerk, in amount seconds; no kind draws it
  };
  Kind kind;
  double begin_s, seconds, amount;
  double angle_rad = 0.0;                // from upwards
  double rate_Hz = 0.0, beyond_mm = 0.0; // of vibrate; of lower, below where the hand began
};
const char *name_of(Event::Kind kind);

struct PadProperties {
  double at_1_mm_N = 3.0;    // force at 1 mm of indentation
  double relaxation = 0.175; // share of the force lost in 8 s; real pads: 0.04 to 0.14
  double friction = 0.5;     // static
  double gain = 1.0;         // of the force that it reports, over the true one
  double delay_s = 0.0;      // of its frames, beyond the conversion, the processing and the line
};

struct GraspScenario {
  std::optional<Kind> kind; // none: it was not drawn
  std::string object;       // of kind fragile
  Shape shape = Shape::ball;
  double height_mm = 40.0, depth_mm = 40.0; // of box, plate and egg; of a cylinder its length
  Vector com_mm;                            // centre of mass from the middle
  Vector place_mm;                          // of the middle on fingertip 0, in its own x and y
  double down_rad = -M_PI_2;                // gravity there, from x towards y
  std::array<PadProperties, 2> pads;
  double exponent = 1.6;                                           // of force over indentation
  double shear_N_mm = 3.5;                                         // tangential stiffness of a pad at 4 N
  double rubber_N_s_mm = 0.008;                                    // damping of it, with the loss at the contact's edge
  double kinetic_share = 0.8;                                      // of static friction, at speed
  double stribeck_mm_s = 3.0;                                      // at which friction has fallen by 63 % of the way there
  double width_mm = 40.0, mass_kg = 0.3;                           // width: along the grip's axis
  double stiffness_N_mm = std::numeric_limits<double>::infinity(); // of the object, when squeezed
  double off_mm = 0.0;                                             // from the middle between the fingers
  double table_friction = 0.4;
  double crushes_N = std::numeric_limits<double>::infinity();
  double opens_mm = 4.0;               // how much wider than the object the gripper is at first
  double waits_s = 0.2;                // from HOLDING to the lift
  double lift_mm = 10.0, lift_s = 0.5; // minimum jerk; then the table is gone
  std::vector<Event> events;
  double steady_s = 0.0, ends_s = 0.0; // nothing happens any more from steady_s on
  double jitter_s = 2e-4;              // of frames
  double lost_share = 0.0;             // of frames
  int gone = -1;                       // this fingertip goes silent, -1: none
  double gone_s = 0.0;                 // since the lift began
  double poll_factor = 1.0;            // how much slower the gripper's line is than its traits

  struct Inputs { // external inputs
    double lifted_mm = 0.0;
    Vector hand_m_s2; // y is upwards
    Vector push_N;
    double mass_kg = 0.0, friction_share = 1.0;
    bool table = true;
  };
  Inputs inputs(double since_lift_s) const;
  // Grip of one fingertip that holds what is carried then, by static friction.
  double least_N(double since_lift_s) const;
};

// The pads' stiffness and exponent under another shape than a ball: lines and areas are stiffer.
void stiffen(GraspScenario &grasp);

GraspScenario draw_grasp(Kind kind, std::uint64_t seed, std::uint64_t n);

} // namespace fingertip::cell
