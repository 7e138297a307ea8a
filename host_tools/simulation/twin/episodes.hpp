// The parts of scenarios: the builder that puts episodes one after the other, and the episodes of each
// kind. pulled_episodes.cpp has those with a tangential force, scenarios.cpp the others.
#pragma once

#include "libfingertip/random.hpp"
#include "simulation/twin/scenarios.hpp"

#include <array>
#include <cmath>

namespace fingertip::twin {

// The paper's grid, on any pad: places half a pitch apart, which end half a pitch before the outer sensors.
struct PaperGrid {
  double step_mm, half_x_mm, half_y_mm;
};
PaperGrid grid_of_pad();

constexpr double SPEED_UP_s = 0.01;
constexpr double SLIDE_SPEED_MAX_mm_s = 200.0; // of the hand; a faster hand throws the object off the pad
constexpr double DEGREE = M_PI / 180.0;

constexpr std::array<double, 4> TWIST_RATES_deg_s{30, 60, 120, 180};

// One for each kind, so that kinds with the same seed have nothing in common.
enum Stream : std::uint64_t {
  GRID_ORDER = 1,
  GRID,
  TAPS,
  POKES,
  CYCLE,
  SLIP,
  TWIST,
  ROLLOFF,
  TWO,
  PLACEMENTS,
  LIFT,
  DIRECTION,
  DRAG,
  SLIDE,
  SCREW,
  HOLD
};

inline double milliseconds(double seconds) { return 1e-3 * std::round(1e3 * seconds); }

// Puts episodes one after the other: a scenario.
class ScenarioBuilder {
public:
  ScenarioBuilder(const ScenarioOptions &scenario_options, const ContactTable &contact_table);

  // The episode's times count from its beginning; false, and the scenario is full, if it does not fit.
  bool add(Episode episode);
  Place random_place(Random &random) const;
  // Half of where random places are.
  double half_x_mm() const { return grid_of_pad().half_x_mm + *options.margin_mm; }
  double half_y_mm() const { return grid_of_pad().half_y_mm + *options.margin_mm; }
  // The speed of what is pushed or pulled in the nth episode.
  template <std::size_t N> double speed_mm_s(std::size_t n, const std::array<double, N> &usual_mm_s) const {
    const std::vector<double> &given_mm_s = options.speeds_mm_s;
    return given_mm_s.empty() ? usual_mm_s[n % N] : given_mm_s[n % given_mm_s.size()];
  }

  const ScenarioOptions &options;
  const ContactTable &table;
  const Forces forces;
  const Tangential tangential;
  const Range friction, mass_kg;
  std::vector<Episode> episodes;

private:
  double t_s_ = START_QUIET_s;
};

// A phase of an episode that ends where its profiles' pieces do.
void phase(Episode &episode, const std::string &name, double end_s, bool slip = false);

Track track_at(Place place);

// What most episodes have in common: the phases touch and hold, whose end is returned; after; release, which puts
// the track into the episode. A press rises and falls within TOUCHES_s, from rest to rest.
constexpr double TOUCHES_s = 0.3;
double touch_and_hold(Episode &episode, Track &track, double force_N, double hold_s, double ramp_s = TOUCHES_s);
void release(Episode &episode, Track &track, double ramp_s = TOUCHES_s);
void rest_and_release(Episode &episode, Track &track, double rest_s);

// The functions below make the nth episode of a kind.
Episode lift(const ScenarioBuilder &builder, std::size_t n);
Episode drag(const ScenarioBuilder &builder, std::size_t n);
Episode slide(const ScenarioBuilder &builder, std::size_t n);
Episode screw(const ScenarioBuilder &builder, std::size_t n);
// The strongest grip of any slide of an object that is at most so heavy and at least so rough, but for --force itself.
double slide_force_N(double mass_kg, double friction, double kinetic_share);

// Gives the nth episode of a kind that is not about pulling the tangential force that the options ask for.
void add_tangential_load(Episode &episode, const ScenarioBuilder &builder, std::size_t n);

} // namespace fingertip::twin
