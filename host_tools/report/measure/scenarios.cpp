// Rubber over time, and rubber that ends: the twin's scenarios, effects and blocks, and what a thickness does.
#include "simulation/twin/scenarios.hpp"

#include "libfingertip/in_parallel.hpp"
#include "library/pad/edges.hpp"
#include "library/pad/profile.hpp"
#include "report/measure/tables.hpp"
#include "tool/arrays/entry.hpp"

#include <algorithm>
#include <cstring>
#include <map>

using namespace fingertip;
using namespace fingertip::measure;
using fingertip::twin::in_parallel;

// Adds to a profile the effect of the pad's ends on the estimate.
static void add_ends(double overhang_mm, std::string cache, Batch<pad_profile, 1> profile) {
  profile[0].overhang_mm = static_cast<float>(overhang_mm);
  profile[0].edges = pad::edges_of(profile[0], pad::own_sensors(), cache);
}
MEASURE_ENTRY(add_ends)

// Adds to the pressures on the base [touch][sensor] what the ends of a block with this overhang do.
static void add_block(std::string name, double layer_mm, double overhang_mm, std::string cache, Batch<const twin::Touch, 1> touches,
                      Batch<double, 2> base_Pa) {
  same_length(touches, base_Pa);
  const twin::BlockTable &block = block_table(layer_mm, overhang_mm, cache);
  const twin::ContactTable &table = contact_table(twin::indenter(name), layer_mm, cache);
  in_parallel(touches.size(), [&](std::size_t i) {
    const twin::Touch &touch = touches[i];
    const twin::BlockTable::Load load{touch.force_N, touch.pull_x_N, touch.pull_y_N, table.contact_radius_mm(touch.force_N)};
    for (std::size_t k = 0; k < base_Pa.size(1); k++) {
      base_Pa.row(i)[k] += block.added_Pa(k, load, touch.x_mm, touch.y_mm);
    }
  });
}
MEASURE_ENTRY(add_block)

// The thickness that the width of a response to a usual contact shows [response][mm, its standard deviation, rounded as the tool shows it].
static void thickness(Batch<const double, 1> width_mm, Batch<const double, 1> width_sd_mm, Batch<double, 2> figures) {
  same_length(width_mm, width_sd_mm, figures);
  require(figures.size(1) == 3, "another number of figures");
  for (std::size_t i = 0; i < figures.size(); i++) {
    const pad::Thickness found = pad::thickness_of(width_mm[i], width_sd_mm[i]);
    const double row[] = {found.mm, found.sd_mm, found.shown_mm()};
    std::copy_n(row, 3, figures.row(i));
  }
}
MEASURE_ENTRY(thickness)

// What pads with these effects (twin/effects.hpp), a seed for each, report of the pressures on their bases [pad][time][sensor].
static void rubber(std::string effects, double layer_mm, Batch<const std::int64_t, 1> seeds, Batch<const double, 1> t_s,
                   Batch<const double, 3> base_Pa, Batch<double, 3> reported_Pa) {
  same_length(seeds, base_Pa, reported_Pa);
  const std::size_t sensors = base_Pa.size(2);
  require(base_Pa.shape == reported_Pa.shape && t_s.size() == base_Pa.size(1), "other numbers of times or sensors");
  const twin::EffectValues values = twin::parse_effects(effects);
  in_parallel(seeds.size(), [&](std::size_t i) {
    twin::Pad pad(values, sensors, layer_mm, twin::AMBIENT_Pa, static_cast<std::uint64_t>(seeds[i]));
    std::vector<double> now, reports(sensors);
    for (std::size_t t = 0; t < t_s.size(); t++) {
      const double *base = base_Pa.row(i) + t * sensors;
      now.assign(base, base + sensors);
      pad.report(t_s[t], now, reports);
      std::copy(reports.begin(), reports.end(), reported_Pa.row(i) + t * sensors);
    }
  });
}
MEASURE_ENTRY(rubber)

struct scenario_options {
  char kind[16], contact_shape[16];
  double layer_mm, seconds;
  std::uint64_t seed;
  char forces[16], tangential[16], friction[16]; // empty: the kind's usual ones
  double kinetic_share, dead_travel_mm;
  double margin_mm; // below 0: the kind's usual one
};
MEASURE_RECORD(scenario_options, FIELD(kind), FIELD(contact_shape), FIELD(layer_mm), FIELD(seconds), FIELD(seed), FIELD(forces),
               FIELD(tangential), FIELD(friction), FIELD(kinetic_share), FIELD(dead_travel_mm), FIELD(margin_mm))

struct scenario_phase {
  std::int64_t act;
  char name[16];
  double begin_s, end_s; // from the beginning of the act
  bool slip;
};
MEASURE_RECORD(scenario_phase, FIELD(act), FIELD(name), FIELD(begin_s), FIELD(end_s), FIELD(slip))

static std::map<std::int64_t, twin::Scenario> &scenarios() {
  static std::map<std::int64_t, twin::Scenario> all;
  return all;
}

// facts: the number of the new scenario, the counts of its `act` and of its phases.
static void scenario_begin(Batch<const scenario_options, 1> options, std::string cache, Batch<std::int64_t, 1> facts) {
  const scenario_options &given = options[0];
  twin::ScenarioOptions chosen;
  chosen.kind = given.kind;
  chosen.indenter = given.contact_shape;
  chosen.layer_mm = given.layer_mm;
  chosen.seconds = given.seconds;
  chosen.seed = given.seed;
  chosen.forces = given.forces;
  chosen.tangential = given.tangential;
  chosen.friction = given.friction;
  chosen.kinetic_share = given.kinetic_share;
  chosen.dead_travel_mm = given.dead_travel_mm;
  if (given.margin_mm >= 0.0) {
    chosen.margin_mm = given.margin_mm;
  }
  const twin::Indenter &indenter = twin::indenter(given.contact_shape);
  twin::Scenario made = twin::make_scenario(chosen, contact_table(indenter, given.layer_mm, cache));
  facts[0] = scenarios().empty() ? 0 : scenarios().rbegin()->first + 1;
  facts[1] = facts[2] = 0;
  for (const twin::Episode &act : made.episodes) {
    facts[1]++;
    facts[2] += static_cast<std::int64_t>(act.phases.size());
  }
  scenarios().emplace(facts[0], std::move(made));
}
MEASURE_ENTRY(scenario_begin)

static void scenario_end(std::int64_t number) { scenarios().erase(number); }
MEASURE_ENTRY(scenario_end)

// last_s: how long each act takes.
static void scenario_phases(std::int64_t number, Batch<double, 1> last_s, Batch<scenario_phase, 1> phases) {
  std::size_t at = 0;
  std::int64_t i = 0;
  for (const twin::Episode &act : scenarios().at(number).episodes) {
    last_s[static_cast<std::size_t>(i)] = act.end_s - act.begin_s;
    for (const twin::Phase &phase : act.phases) {
      scenario_phase &found = phases[at++];
      found = {i, {}, phase.begin_s - act.begin_s, phase.end_s - act.begin_s, phase.slip};
      std::strncpy(found.name, phase.name.c_str(), sizeof found.name - 1);
    }
    i++;
  }
}
MEASURE_ENTRY(scenario_phases)

// The first contact of each act at the time from its beginning.
static void scenario_touches(std::int64_t number, Batch<const std::int64_t, 1> act, Batch<const double, 1> t_s,
                             Batch<twin::Touch, 1> touches) {
  same_length(act, t_s, touches);
  const twin::Scenario &scenario = scenarios().at(number);
  in_parallel(touches.size(),
              [&](std::size_t i) { touches[i] = scenario.episodes.at(static_cast<std::size_t>(act[i])).tracks[0].at(t_s[i]); });
}
MEASURE_ENTRY(scenario_touches)
