// Scenarios: what happens to a pad over time, each composed from a kind, an indenter, a layer and the errors of a pad. kinds() lists the
// kinds; De Clercq et al., RA-L 2022 ("the paper"), section IV, is what they follow. scenario_file.hpp writes them down.
//
// Nothing touches the pad for the first START_QUIET_s, nor for quiet_s after each contact: time for the 16 frames of
// the firmware's tare at 20 frames a second; the paper, too, sets its readings to zero between contacts.
//
// README.md describes where things are, what the truth calls slip, what a tangential force is of, and what is left out.
#pragma once

#include "library/pad/block.hpp"
#include "simulation/twin/contact_table.hpp"
#include "simulation/twin/effects.hpp"
#include "simulation/twin/trajectory.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace fingertip::twin {

constexpr double START_QUIET_s = 1.5;
constexpr double AMBIENT_Pa = 101325.0;
// Without overhang_mm; the paper's box is 30 mm by 50 mm.
constexpr double PAD_OVERHANG_mm = 6.0;

class ScenarioBuilder;
struct Episode;
struct ScenarioKind {
  std::string name;
  double usual_seconds;
  std::string usual_forces;
  std::string description;
  Episode (*episode)(const ScenarioBuilder &builder, std::size_t n); // the nth
  const char *usual_indenter = "sphere6";
  double usual_margin_steps = 0.5; // of the paper's grid
  const char *usual_tangential = "0", *usual_friction = "0.5";
  bool pulls_itself = false;
};
const std::vector<ScenarioKind> &scenario_kinds();
// Throws Error: there is none of this name.
const ScenarioKind &scenario_kind(const std::string &name);

// "5": always that; "1,2,5": one after the other; "1..15": anywhere between, uniform. In N.
class Forces {
public:
  // Throws Error unless all are from 0.02 N to the tables' end.
  explicit Forces(const std::string &text);
  double pick(std::size_t turn, double random_share) const;

private:
  std::vector<double> values_;
  bool range_ = false;
};

// "0.3": always that; "0.1..0.4": anywhere between, uniform.
struct Range {
  // Throws Error, which names the option, unless it is one of these.
  Range(const std::string &option, const std::string &text);
  double at(double random_share) const { return lowest + random_share * (highest - lowest); }
  double lowest, highest;
};

// "0.3" or "0.1..0.4": such a share of the normal force, in a direction drawn for each contact;
// "0.3,90": in that one, degrees from x towards y.
struct Tangential {
  // Throws Error unless these are numbers.
  explicit Tangential(const std::string &text);
  Range share;
  std::optional<double> angle_deg;
};

struct ScenarioOptions {
  std::string kind = "taps";
  std::string indenter; // empty: the kind's usual one
  double layer_mm = 12.0;
  std::optional<double> overhang_mm; // rubber beyond the outer sensors; else no end
  EffectValues effects;
  std::uint64_t seed = 1;
  std::optional<std::uint64_t> pad_seed;         // of the pad's errors; else seed
  std::optional<double> seconds;                 // else usual_seconds
  std::string forces;                            // empty: usual_forces
  std::string tangential, friction;              // Range; empty: the kind's usual ones
  std::string mass_kg;                           // Range, kind "slide"; empty: usual
  double kinetic_share = 0.8;                    // kind "slide": kinetic friction per static one
  std::vector<double> speeds_mm_s;               // of what moves by a speed; empty: usual ones
  double dead_travel_mm = 1.0;                   // Grip; TangentialLoad; of a slide at 6 N, friction 0.5
  double creep_share = 0.5, stick_slip_mm = 0.0; // Grip, kind "slip"
  std::optional<double> margin_mm;               // else the kind's usual one
  double quiet_s = 1.2;
};

// A stretch of one episode in which one thing goes on.
struct Phase {
  std::string name;
  double begin_s, end_s; // in the scenario
  bool slip = false;
};

// From touch to loss.
struct Episode {
  std::string press;
  double begin_s = 0.0, end_s = 0.0;
  std::vector<Track> tracks; // one or two; their time 0 is begin_s
  std::vector<Phase> phases;
  int sensors_near = 0; // grid: as many sensors are nearest to the place, 1, 2 or 4; else 0
  double speed_mm_s = 0.0;
  double friction = 0.0, mass_kg = 0.0; // static, of what is pulled; of the object; 0: none

  bool slips(double t_s) const;
};

struct Scenario {
  ScenarioOptions options; // complete
  std::string name;
  bool pulls = false;            // something tangential may be in it
  std::vector<Episode> episodes; // in order of time, none overlap
};

// The block that reaches this far beyond the outer sensors, and these.
Block block_around(const Layer &layer, double overhang_mm);
std::vector<Place> sensor_places();
// Of one coordinate of the sensors' places.
double outermost_mm(const float *places_mm);

// With all that was left open filled in. Throws Error for an unknown kind or what is out of range.
ScenarioOptions complete(const ScenarioOptions &options);

// The tables are those of the indenters on the layer: creep and rolling need the contact's size.
// Throws Error as complete does, and if the scenario is too short for one contact.
Scenario make_scenario(const ScenarioOptions &options, const ContactTable &table);

} // namespace fingertip::twin
