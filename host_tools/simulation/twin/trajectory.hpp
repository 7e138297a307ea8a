// How contacts move over the pad and how hard they press: smooth functions of time.
//
// All of it is kinematic: what slips when is set here, or was found before by held_object.hpp. Of
// the elastic dead travel and of stick-slip only the motions are modelled (Grip).
#pragma once

#include <limits>
#include <vector>

namespace fingertip::twin {

// A value over time, put together from cubic pieces; continuous. Times are whole milliseconds, so that rows fall on the joints.
class Profile {
public:
  explicit Profile(double value = 0.0) : value_(value) {}

  Profile &hold(double seconds);
  // From rest to rest.
  Profile &ease(double seconds, double to);
  // At constant rate.
  Profile &line(double seconds, double to);
  // Moves by `distance`, at this speed except for a constant acceleration at either end. Throws
  // std::invalid_argument if the accelerations alone would take the distance.
  Profile &travel(double distance, double speed, double accelerate_s);
  // Through these values, one for each millisecond to come, but for less than the tolerance.
  Profile &trace(const std::vector<double> &values, double tolerance);

  double at(double t_s) const; // before its beginning and after its end it stays
  double end_s() const { return 1e-3 * static_cast<double>(end_ms_); }
  double end_value() const { return value_; }

private:
  struct Piece {
    double begin_s, end_s;
    double from, to, rate_from, rate_to; // Hermite
  };
  void add(double seconds, double to, double rate_from, double rate_to);
  std::vector<Piece> pieces_;
  long long end_ms_ = 0;
  double value_;
};

// What a held object does on the pad while something pushes it: the way of the contact, given that
// of the pusher. Both in mm, 0 at rest; the way never falls.
//
// At first the object is held, and the pusher's way goes into the rubber and all else that gives: the dead travel (README.md has its amount
// and sources). The part of it at the base creeps along as 1 - (1 - s / dead travel)^(3/2) (Mindlin, J. Appl. Mech. 16, 1949). In
// stick-slip the object rests for 4/5 of each period of the pusher's way and catches up in the last fifth.
struct Grip {
  double dead_travel_mm = 0.0;
  double creep_share = 0.5;   // of the dead travel
  double stick_slip_mm = 0.0; // way of one jump; 0: steady

  double way_mm(double pusher_mm) const;
  // The pusher's way that moves the contact by this much, at the latest.
  double pusher_mm(double way_mm) const;
};

// The tangential force of an object on the rubber, along one direction: a share of the normal force that rises and falls with it, as in an
// oblique push, or a load that comes while the normal force stays, as a weight does. Under a load the object and its contact move along: by
// travel_mm when all slides and by 1 - (1 - Q / (friction F))^(2/3) of it before (Mindlin, as in Grip), and back the same way. Where a
// HeldObject moves, its way is the pusher's, and travel_mm is 0.
struct TangentialLoad {
  double along_x = 1.0, along_y = 0.0; // unit vector
  double share = 0.0;
  Profile load_N; // at most friction times the normal force, 0 as long as share is not
  Profile friction{1.0};
  double travel_mm = 0.0;
};

struct Touch {
  double force_N = 0.0;
  double x_mm = 0.0, y_mm = 0.0, angle_rad = 0.0; // the object is turned by the angle
  double pull_x_N = 0.0, pull_y_N = 0.0;
  double stuck_N = 0.0; // TractionTable::Load
  bool operator==(const Touch &other) const {
    return force_N == other.force_N && x_mm == other.x_mm && y_mm == other.y_mm && angle_rad == other.angle_rad &&
           pull_x_N == other.pull_x_N && pull_y_N == other.pull_y_N && stuck_N == other.stuck_N;
  }
};

// One contact from touch to loss, or one of two that touch together. Time 0 is the beginning.
struct Track {
  Profile force_N;
  double x_mm = 0.0, y_mm = 0.0;       // where it touches
  double along_x = 0.0, along_y = 1.0; // unit vector of its way
  Profile pusher_mm;
  Grip grip;
  Profile angle_rad;
  TangentialLoad tangential;
  // Where the pad ends in x, and the radius of the contact then: what is beyond carries nothing.
  // The disc's part on the pad is applied at that part's centre, with its share of the force.
  double edge_x_mm = std::numeric_limits<double>::infinity();
  double radius_mm = 0.0;

  Touch at(double t_s) const;
};

// How far, in radians, a torque turns a sphere of this contact radius on rubber of this shear modulus, a half-space,
// before it spins: the closed form of Deresiewicz, "Contact of elastic spheres under an oscillating torsional couple",
// J. Appl. Mech. 21, 1954. torque_share is that of the torque at which all slides, (3 pi / 16) mu F a; -1..1. It is
// less than Lubkin's integrals ("The torsion of elastic spheres in contact", J. Appl. Mech. 18, 1951) by 3 % at half of
// that, by 14 % at 0.8; theirs grows beyond any bound at the end, as a logarithm, where this spins.
double wind_up_rad(double torque_share, double friction_N, double shear_modulus_MPa, double radius_mm);

// Share of a disc's area that lies before a straight edge, and how far the centre of that part lies
// before the disc's, both for an edge `ahead` radii ahead of the centre (-1..1).
struct DiscPart {
  double share, back; // back in radii
};
DiscPart disc_before_edge(double ahead);

} // namespace fingertip::twin
