// What happens to one grasped object, drawn from a seed: the object, how it is grasped, how it is
// lifted, and what disturbs it then.
//
// Drawn so that the grip that just holds it, at the worst of it but for knocks, needs at most
// FORCE_MOST_N: an object that no gripper with a usual cap can hold is no test of a controller. Ranges
// are assumptions about a household, no measurements.
#pragma once

#include "simulation/cell/cell.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace fingertip::cell {

struct Disturbance {
  enum class Kind {
    pour,  // amount: mass that comes, of the object's own; 0.3..1.5 over 0.5..2 s
    jerk,  // amount: the hand's acceleration, m/s2, a period of a sine; 2..9 over 0.15..0.5 s
    knock, // amount: speed that the object would get, m/s, half a sine; 0.03..0.12 over 10..30 ms
    slick, // amount: share of friction that goes; 0.2..0.45 over 0.1..0.5 s
  };
  Kind kind;
  double begin_s, seconds; // since the lift began
  double amount;
  double angle_rad; // of a jerk's or knock's way from upwards
};
const char *name_of(Disturbance::Kind kind);

struct Scene {
  std::string face;
  Object object;
  Grasp grasp;
  double opens_mm = 4.0;              // how much wider than the object the gripper is at first
  double waits_s = 0.2;               // from the controller's HOLDING to the lift
  double lift_mm = 0.0, lift_s = 0.0; // minimum jerk; then the table is gone
  std::vector<Disturbance> disturbances;
  double ends_s = 0.0; // since the lift began

  // Since the lift began; before it, below 0. All but the gripper's width.
  Drive drive(double t_s) const;
  // The grip of one fingertip that just holds the object then, by static friction.
  double least_N(double t_s) const;
};

constexpr double FORCE_MOST_N = 15.0;

// Faces (face.hpp) of objects: balls; cylinders that lie across the pad; both, which are `round`;
// `faces`, flat ones within the pad; `flats`, larger than it. Throws std::runtime_error for others.
std::vector<std::string> faces_of(const std::string &objects);

// The n-th of a set. Another seed is another set.
Scene draw_scene(const std::vector<std::string> &faces, std::uint64_t seed, std::uint64_t n);

} // namespace fingertip::cell
