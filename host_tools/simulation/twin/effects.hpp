// What rubber and sensors do to the pressure on the base before a sensor reports it. Each effect is
// switched on by its name and has one value; effects() is the list of them, with sources.
//
// README.md describes each, in the order in which they act on the pressure p of one sensor, V its value. Formulas:
//   dip          from p goes V of the pressure in the contact's middle times exp(-r^2 / (2 (2.5 s)^2)), s its width
//   hysteresis   rate-independent. Loading to a new maximum m, p stays; unloading from m it is lower by
//                3 V p (1 - p / m): the loop is V of the area below the loading curve. Loading again leads straight
//                back to m. Nothing remains at p = 0.
//   memory       less m z: z follows p with the sensor's own time constant of 1 to 4 s. m is drawn, of either sign,
//                so that a hold of 8 s changes by V (sd), for one sensor of eight by 4.6 V. What a hold took off remains
//                off after it.
//   aftereffect  plus a share of the peak that each sensor remembers and p has left: a (m - p). m is p while p rises
//                above it, and otherwise returns to p with its time constant. a is 0.5 to 1.25 V, for one sensor of
//                three -0.75 to -2.25 V.
//   creep        plus V of what follows p with the time constant CREEP_s
//   relaxation   changes the force, not on a sensor: relaxed_share().
//   temperature  by V with the slowest time constant 4 h^2 / (pi^2 a) of a layer h warmed from above
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace fingertip::twin {

constexpr double ROOM_degC = 25.0;
constexpr double CREEP_s = 3.0;

struct Effect {
  std::string name;
  std::string unit;
  double usual, lowest, highest; // values
  std::string description;
  std::string source;
};

const std::vector<Effect> &effects();

// Name to value, of those that are switched on.
using EffectValues = std::map<std::string, double>;

// "drift,relaxation=20": a list of names, each with a value or its usual one. "" and "none" are no
// effects, "all" is all of them, "all,clip=5" with that value. Throws Error.
EffectValues parse_effects(const std::string &text);

// One pad: the same seed draws the same pad, and the same draws at any value of an effect.
class Pad {
public:
  static constexpr std::array<double, 2> TIMES_s{1.0, 10.0}; // of `relaxation`
  static constexpr double WARMING_K_s = 0.1;                 // of `branch`

  Pad(const EffectValues &effects, std::size_t sensors, double layer_mm, double ambient_Pa, std::uint64_t seed);

  // The pressure that each sensor reports above ambient at this time, given the pressure on the base. Times must increase; between them the
  // pressure on the base is linear. The first time is the beginning: the pad is at rest until then.
  void report(double t_s, const std::vector<double> &base_Pa, std::vector<double> &reported_Pa);
  double temperature_degC(double t_s) const;

  // Where travel is held the force falls: a linear viscoelastic layer, a Prony series. What is left of a force, in
  // shares of what the travel asks for at first. Call it once at each time of a contact, and with 0 before and after
  // it: each contact is of fresh rubber. 1 without the effect.
  double relaxed_share(double t_s, double travel_N);

  double dip_share() const { return dip_share_; }
  // How a sensor sits: its offset from its place, and the width of its response over the usual one.
  struct Seat {
    double dx_mm = 0.0, dy_mm = 0.0, width = 1.0;
  };
  const std::vector<Seat> &seats() const { return seats_; } // [sensor], drawn

  // Drawn, [sensor]; empty where the effect is off.
  const std::vector<double> &gain_errors() const { return gain_errors_; }
  const std::vector<double> &drifts_Pa_s() const { return drifts_Pa_s_; }
  struct Memory {
    double share, time_s; // share lost in a hold of 8 s, below 0 gained
  };
  const std::vector<Memory> &memories() const { return memories_; }
  struct Aftereffect {
    double share, time_s; // share of the peak, below 0 an undershoot
  };
  const std::vector<Aftereffect> &aftereffects() const { return aftereffects_; }
  struct Branch {
    double edge_degC;      // compensated temperature where it changes
    double step_Pa, slope; // at ambient pressure, and of the pressure above it
  };
  const std::vector<Branch> &branches() const { return branches_; }

private:
  struct Rubber { // of one sensor
    // Memory: after the hysteresis at the last time, what follows it, its decay over a step, its share of that.
    double elastic_Pa = 0.0, follows_Pa = 0.0, decay = 1.0, strength = 0.0;
    // Hysteresis: the last pressure and what it lacks, whether it falls, where it turned last, and the largest since the pressure was none.
    double pressure_Pa = 0.0, lacks_Pa = 0.0;
    bool falls = false;
    double turn_Pa = 0.0, turn_lacks_Pa = 0.0, largest_Pa = 0.0;
    double base_Pa = 0.0, crept_Pa = 0.0; // creep: the pressure at the last time, what follows it
    // After-effect: the pressure at the last time, what is remembered, its decay over a step.
    double sensed_Pa = 0.0, remembered_Pa = 0.0, forgetting = 1.0;
  };
  double with_hysteresis(Rubber &rubber, double pressure_Pa) const;
  double lost(Rubber &rubber, double time_s, double pressure_Pa) const;
  double left_behind(Rubber &rubber, const Aftereffect &effect, double base_Pa) const;
  double crept(Rubber &rubber, double base_Pa) const;

  double ambient_Pa_;
  double dip_share_ = 0.0, creep_ = 0.0, creep_decay_ = 1.0;
  double hysteresis_ = 0.0; // share of the loop
  double bias_ = 0.0, clip_Pa_ = 0.0, warming_K_ = 0.0, warming_s_ = 0.0;
  double start_degC_ = ROOM_degC;
  std::array<double, TIMES_s.size()> strength_{}, follows_N_{};
  double relaxes_s_ = 0.0, travel_N_ = 0.0;
  std::vector<double> gain_errors_, drifts_Pa_s_;
  std::vector<Memory> memories_;
  std::vector<Aftereffect> aftereffects_;
  std::vector<Branch> branches_;
  std::vector<Seat> seats_;
  std::vector<Rubber> rubber_;
  double t_s_ = 0.0, step_s_ = 0.0, begin_s_ = 0.0;
  bool begun_ = false;
};

// g of the Prony series that makes a hold of 8 s after a press of 1.3 s lose this share of its peak.
std::array<double, Pad::TIMES_s.size()> relaxation_strengths(double share);

} // namespace fingertip::twin
