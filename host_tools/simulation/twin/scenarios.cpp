#include "simulation/twin/scenarios.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/text.hpp"
#include "simulation/twin/episodes.hpp"

extern "C" {
#include "config/geometry.h"
}

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace fingertip::twin {

constexpr double SLIP_WAY_mm = 24.0, SLIP_SPAN_mm = 28.0;

constexpr std::array<double, 5> SLIP_SPEEDS_mm_s{20, 50, 100, 150, 200}; // the paper: 5 of them
constexpr std::array<double, 3> ROLL_SPEEDS_mm_s{10, 25, 50};
constexpr std::array<double, 7> DISTANCES_mm{6, 9, 12, 15, 18, 24, 30};

static std::string number(double value) { return shortest(static_cast<float>(value)); }

// Press, hold and let go at one place.
static Episode press(const std::string &name, Place place, double force_N, double ramp_s, double hold_s) {
  Episode episode;
  episode.press = name;
  Track track = track_at(place);
  touch_and_hold(episode, track, force_N, hold_s, ramp_s);
  release(episode, track, ramp_s);
  return episode;
}

double outermost_mm(const float *places_mm) {
  double most = 0.0;
  for (std::size_t k = 0; k < geometry.sensor_count; k++) {
    most = std::max(most, std::abs(static_cast<double>(places_mm[k])));
  }
  return most;
}

PaperGrid grid_of_pad() {
  const double step_mm = 0.5 * static_cast<double>(geometry.pitch_mm);
  return {step_mm, std::max(outermost_mm(geometry.x_mm) - step_mm, 0.0), std::max(outermost_mm(geometry.y_mm) - step_mm, 0.0)};
}

// The functions below make the nth episode of a kind.

static Episode grid(const ScenarioBuilder &builder, std::size_t n) {
  struct Way {
    const char *name;
    double ramp_s, hold_s;
  };
  constexpr std::array<Way, 3> ways{{{"tap", 0.1, 0.1}, {"press", 0.8, 0.3}, {"hold", 0.25, 3.0}}};
  const PaperGrid grid = grid_of_pad();
  const int across = 1 + static_cast<int>(std::lround(2.0 * grid.half_x_mm / grid.step_mm));
  const int along = 1 + static_cast<int>(std::lround(2.0 * grid.half_y_mm / grid.step_mm));
  std::vector<int> order(static_cast<std::size_t>(across * along));
  std::iota(order.begin(), order.end(), 0);
  const std::size_t way = n % ways.size(), nth_place = n / ways.size() % order.size();
  const std::size_t pass = n / (ways.size() * order.size());
  Random random(builder.options.seed, GRID_ORDER, pass);
  for (std::size_t i = order.size() - 1; i > 0; i--) {
    std::swap(order[i], order[random.next() % (i + 1)]);
  }
  const int at = order[nth_place];
  const int row = at / across, column = at % across;
  Random strength(builder.options.seed, GRID, n);
  // Forces in turn: after some passes every place has had all of them in every way.
  const std::size_t turn = static_cast<std::size_t>(at) + pass + 2 * way;
  const Place place{grid.step_mm * (column - across / 2), grid.step_mm * (row - along / 2)};
  Episode episode = press(ways[way].name, place, builder.forces.pick(turn, strength.uniform(0.0, 1.0)), ways[way].ramp_s, ways[way].hold_s);
  episode.sensors_near = (column % 2 == 0 ? 2 : 1) * (row % 2 == 0 ? 2 : 1);
  return episode;
}

static Episode random_press(const ScenarioBuilder &builder, std::size_t n, const std::string &name, double ramp_s, double hold_s) {
  Random random(builder.options.seed, TAPS, n);
  const Place place = builder.random_place(random);
  const double force_N = builder.forces.pick(n, random.uniform(0.0, 1.0));
  const double ramps_s = milliseconds(ramp_s * random.uniform(0.7, 1.3));
  return press(name, place, force_N, ramps_s, hold_s);
}

static Episode tap(const ScenarioBuilder &builder, std::size_t n) { return random_press(builder, n, "tap", 0.12, 0.3); }

static Episode hold(const ScenarioBuilder &builder, std::size_t n) {
  Random random(builder.options.seed, HOLD, n);
  return random_press(builder, n, "hold", 0.2, milliseconds(random.log_uniform(0.2, 10.0)));
}

static Episode high(const ScenarioBuilder &builder, std::size_t n) { return random_press(builder, n, "hold", 0.5, 0.6); }

// A weight is set down by hand, rests by itself and is lifted.
static Episode placement(const ScenarioBuilder &builder, std::size_t n) {
  constexpr double RESTS_s = 2.0;
  Random random(builder.options.seed, PLACEMENTS, n);
  const Place place = builder.random_place(random);
  const double force_N = builder.forces.pick(n, random.uniform(0.0, 1.0));
  return press("placement", place, force_N, milliseconds(random.uniform(0.2, 0.5)), RESTS_s);
}

// A poke by hand: never at rest, and not quite at one place.
static Episode poke(const ScenarioBuilder &builder, std::size_t n) {
  constexpr double WANDER_mm = 1.5;
  Random random(builder.options.seed, POKES, n);
  Episode episode;
  episode.press = "poke";
  Track track = track_at(builder.random_place(random));
  const double direction = random.uniform(0.0, 2.0 * M_PI);
  track.along_x = std::cos(direction);
  track.along_y = std::sin(direction);
  const int changes = 3 + static_cast<int>(random.next() % 5);
  for (int i = 0; i < changes; i++) {
    const double seconds = random.uniform(0.15, 0.6);
    track.force_N.ease(seconds, builder.forces.pick(n, random.uniform(0.0, 1.0)));
    track.pusher_mm.ease(seconds, random.uniform(0.0, WANDER_mm));
    if (i == 0) {
      phase(episode, "touch", track.force_N.end_s());
    }
  }
  phase(episode, "poke", track.force_N.end_s());
  track.force_N.ease(random.uniform(0.15, 0.4), 0.0);
  phase(episode, "release", track.force_N.end_s());
  episode.tracks.push_back(track);
  return episode;
}

// Slow enough that only what does not depend on the rate makes a loop, save relaxation.
static Episode cycle(const ScenarioBuilder &builder, std::size_t n) {
  constexpr double RAMP_s = 15.0;
  Random random(builder.options.seed, CYCLE, n);
  const Place place = n == 0 ? Place{0.0, 0.0} : builder.random_place(random);
  Episode episode;
  episode.press = "cycle";
  Track track = track_at(place);
  track.force_N.line(RAMP_s, builder.forces.pick(n, random.uniform(0.0, 1.0)));
  phase(episode, "load", track.force_N.end_s());
  track.force_N.line(RAMP_s, 0.0);
  phase(episode, "unload", track.force_N.end_s());
  episode.tracks.push_back(track);
  return episode;
}

// When the pusher's way, which never falls, first is this long; whole milliseconds.
static double time_of(const Profile &way, double length_mm, double begin_s, double end_s) {
  double low = begin_s, high = end_s;
  while (high - low > 1e-4) {
    const double middle = 0.5 * (low + high);
    (way.at(middle) < length_mm ? low : high) = middle;
  }
  return milliseconds(high);
}

static Episode slip(const ScenarioBuilder &builder, std::size_t n) {
  Random random(builder.options.seed, SLIP, n);
  const bool upward = random.uniform(0.0, 1.0) < 0.5;
  const double slack_mm = 0.5 * (SLIP_SPAN_mm - SLIP_WAY_mm);
  const double x_mm = random.uniform(-grid_of_pad().half_x_mm, grid_of_pad().half_x_mm);
  const double y_mm = -0.5 * SLIP_WAY_mm + random.uniform(-slack_mm, slack_mm);
  Episode episode;
  episode.press = "grip";
  episode.speed_mm_s = builder.speed_mm_s(n, SLIP_SPEEDS_mm_s);
  Track track = track_at({x_mm, upward ? y_mm : -y_mm});
  track.along_y = upward ? 1.0 : -1.0;
  track.grip = {builder.options.dead_travel_mm, builder.options.creep_share, builder.options.stick_slip_mm};
  track.angle_rad = Profile(random.uniform(-15.0, 15.0) * DEGREE);
  const double force_N = builder.forces.pick(n, random.uniform(0.0, 1.0));

  const double push_s = touch_and_hold(episode, track, force_N, random.uniform(0.8, 1.2));
  track.pusher_mm.hold(push_s);
  track.pusher_mm.travel(track.grip.pusher_mm(SLIP_WAY_mm), episode.speed_mm_s, SPEED_UP_s);
  const double stop_s = track.pusher_mm.end_s();
  if (track.grip.dead_travel_mm > 0.0) {
    phase(episode, "dead_travel", time_of(track.pusher_mm, track.grip.dead_travel_mm, push_s, stop_s), true);
  }
  phase(episode, "slip", stop_s, true);
  rest_and_release(episode, track, stop_s - push_s + 0.5);
  return episode;
}

static Episode twist(const ScenarioBuilder &builder, std::size_t n) {
  constexpr double TURN_deg = 90.0;
  Random random(builder.options.seed, TWIST, n);
  Episode episode;
  episode.press = "grip";
  Track track = track_at(builder.random_place(random));
  const double from = random.uniform(-45.0, 45.0) * DEGREE;
  track.angle_rad = Profile(from);
  const double force_N = builder.forces.pick(n, random.uniform(0.0, 1.0));
  const double begin_s = touch_and_hold(episode, track, force_N, random.uniform(0.5, 0.7));
  track.angle_rad.hold(begin_s);
  const double rate = TWIST_RATES_deg_s[n % TWIST_RATES_deg_s.size()] * DEGREE;
  track.angle_rad.travel(TURN_deg * DEGREE, rate, SPEED_UP_s);
  const double end_s = track.angle_rad.end_s();
  phase(episode, "twist", end_s);
  rest_and_release(episode, track, end_s - begin_s + 0.5);
  return episode;
}

static double half_width_mm(const ScenarioOptions &options) {
  return outermost_mm(geometry.x_mm) + options.overhang_mm.value_or(PAD_OVERHANG_mm);
}

// The contact rolls across the pad's long edge, until nothing of it is left on the pad.
static Episode rolloff(const ScenarioBuilder &builder, std::size_t n) {
  Random random(builder.options.seed, ROLLOFF, n);
  Episode episode;
  episode.press = "roll";
  episode.speed_mm_s = builder.speed_mm_s(n, ROLL_SPEEDS_mm_s);
  Track track = track_at({random.uniform(-2.0, 2.0), random.uniform(-grid_of_pad().half_y_mm, grid_of_pad().half_y_mm)});
  track.along_x = 1.0;
  track.along_y = 0.0;
  const double force_N = builder.forces.pick(n, random.uniform(0.0, 1.0));
  track.edge_x_mm = half_width_mm(builder.options);
  track.radius_mm = builder.table.contact_radius_mm(force_N);
  track.pusher_mm.hold(touch_and_hold(episode, track, force_N, random.uniform(0.4, 0.6)));
  track.pusher_mm.travel(track.edge_x_mm + track.radius_mm - track.x_mm, episode.speed_mm_s, SPEED_UP_s);
  track.force_N.hold(track.pusher_mm.end_s() - track.force_N.end_s());
  phase(episode, "roll", track.force_N.end_s());
  episode.tracks.push_back(track);
  return episode;
}

static Episode two(const ScenarioBuilder &builder, std::size_t n) {
  Random random(builder.options.seed, TWO, n);
  const double distance = DISTANCES_mm[n % DISTANCES_mm.size()];
  // The far ones lie along the pad, which is too narrow for them.
  const double direction = distance > 2.0 * grid_of_pad().half_x_mm ? random.uniform(60.0, 120.0) : random.uniform(0.0, 180.0);
  const double half_x = 0.5 * distance * std::cos(direction * DEGREE);
  const double half_y = 0.5 * distance * std::sin(direction * DEGREE);
  const double x_mm = random.uniform(-2.0, 2.0), y_mm = random.uniform(-2.0, 2.0);
  const double one_N = builder.forces.pick(n, random.uniform(0.0, 1.0));
  const double other_N = builder.forces.pick(n + 1, random.uniform(0.0, 1.0));
  Episode episode = press("two", {x_mm - half_x, y_mm - half_y}, one_N, 0.25, 0.5);
  episode.tracks.push_back(press("two", {x_mm + half_x, y_mm + half_y}, other_N, 0.25, 0.5).tracks.front());
  return episode;
}

constexpr const char *USUAL_MASS_kg = "0.1..0.5"; // assumed

static void check(const char *option, double value, double lowest, double highest) {
  if (!(value >= lowest && value <= highest)) {
    throw Error(std::string(option) + " " + number(value) + " is out of range; give " + number(lowest) + " to " + number(highest));
  }
}

static void check_slide(const ScenarioOptions &options, double friction) {
  const Range mass_kg("--mass", options.mass_kg);
  for (double end : {mass_kg.lowest, mass_kg.highest}) {
    check("--mass", end, 0.01, 5.0);
  }
  const double grip_N = slide_force_N(mass_kg.highest, friction, options.kinetic_share);
  if (grip_N > ContactTable::FORCE_MAX_N) {
    throw Error("--mass " + number(mass_kg.highest) + " needs a grip of up to " + number(grip_N) + " N at --friction " + number(friction) +
                ", above " + number(ContactTable::FORCE_MAX_N) + "; give less mass or more friction");
  }
}

// What shows all that differs but the seeds, the length and the kind's own settings.
static std::string name_of(const ScenarioOptions &options) {
  std::string name = options.kind + "-" + options.indenter;
  name += "-h" + number(options.layer_mm);
  if (options.overhang_mm) {
    name += "-overhang" + number(*options.overhang_mm);
  }
  const auto gain = options.effects.find("gain");
  name += "-gain" + number(gain == options.effects.end() ? 0.0 : gain->second);
  for (const Effect &effect : effects()) {
    const auto chosen = options.effects.find(effect.name);
    if (chosen != options.effects.end() && effect.name != "gain") {
      name += "-" + effect.name + (chosen->second == effect.usual ? "" : number(chosen->second));
    }
  }
  const Range share = Tangential(options.tangential).share;
  if (share.highest > 0.0) {
    name += "-tangential" + number(share.lowest);
    if (share.highest > share.lowest) {
      name += ".." + number(share.highest);
    }
  }
  return name;
}

const std::vector<ScenarioKind> &scenario_kinds() {
  static const std::vector<ScenarioKind> all{
      {"grid", 200, "1,2.5,5,10,15", "tap, press and 3 s hold on each place of a grid of half a pitch (the paper: 21, 4.5 mm apart)", grid},
      {"taps", 120, "1..15", "short taps at random places", tap},
      {"hold", 200, "1..15", "presses at random places, held for 0.2 to 10 s", hold},
      {"high", 120, "25..50", "strong presses at random places", high},
      {"pokes", 120, "0.5..25", "as if by hand: changing force, wandering place", poke},
      {"cycle", 120, "20", "slow loading and unloading, 15 s each; the first above a sensor", cycle},
      {"slip", 120, "6", "a gripped object is pushed 24 mm along y at 20, 50, 100, 150, 200 mm/s", slip},
      {"twist", 60, "6", "a gripped object turns by 90 degrees about its contact", twist},
      {"rolloff", 60, "6", "an object rolls over the pad's edge at 10, 25, 50 mm/s", rolloff},
      {"placements", 150, "3", "one weight set down at random places for 2 s each, to calibrate from", placement, "sphere15",
       1.0}, // to the outer sensors
      {"lift", 120, "6", "a gripped object's weight, 0.3 of the grip's force, is taken over in 0.1, 0.3 and 1 s", lift, "sphere6", 0.5,
       "0.3", "0.5", true},
      {"drag", 120, "3", "a weight on the pad is pulled along by a string: by 0.3 of it, then by what slides", drag, "sphere15", 0.5, "0.3",
       "0.5", true},
      {"slide", 240, "6", "a gripped object of 0.1 to 0.5 kg slips where friction gives way: pulled, too heavy, let loose, or carried",
       slide, "sphere6", 0.5, "0", "0.3..0.8", true},
      {"screw", 60, "6", "a gripped object is turned by a torque until it spins, to either side", screw, "sphere6", 0.5, "0", "0.5", true},
      {"two", 60, "4..10", "two contacts at once, 6 to 30 mm apart", two},
  };
  return all;
}

const ScenarioKind &scenario_kind(const std::string &name) {
  if (const ScenarioKind *found = find_in(scenario_kinds(), [&](const auto &one) { return one.name == name; })) {
    return *found;
  }
  throw Error("there is no kind of scenario \"" + printable(name) +
              "\"; give one of: " + joined(scenario_kinds(), ", ", [](const ScenarioKind &one) { return one.name; }));
}

Forces::Forces(const std::string &text) {
  const std::size_t dots = text.find("..");
  std::vector<std::string_view> parts;
  if (dots != std::string::npos) {
    range_ = true;
    parts = {std::string_view(text).substr(0, dots), std::string_view(text).substr(dots + 2)};
  } else {
    parts = split(text, ',');
  }
  bool good = true;
  for (std::string_view part : parts) {
    const auto force_N = to_double(trim(part));
    good = good && force_N && *force_N >= ContactTable::FORCE_MIN_N && *force_N <= ContactTable::FORCE_MAX_N;
    values_.push_back(force_N.value_or(0.0));
  }
  if (!good || (range_ && values_[1] < values_[0])) {
    throw Error("--force \"" + printable(text) + "\" is not possible; give newtons from " + number(ContactTable::FORCE_MIN_N) + " to " +
                number(ContactTable::FORCE_MAX_N) + ": 5, or in turn 1,2,5, or any of 1..15");
  }
}

double Forces::pick(std::size_t turn, double random_share) const {
  return range_ ? values_[0] + random_share * (values_[1] - values_[0]) : values_[turn % values_.size()];
}

Range::Range(const std::string &option, const std::string &text) {
  const std::size_t dots = text.find("..");
  const auto low = to_double(trim(std::string_view(text).substr(0, dots)));
  const auto high = dots == std::string::npos ? low : to_double(trim(std::string_view(text).substr(dots + 2)));
  if (!low || !high || !(*low <= *high)) {
    throw Error(option + " \"" + printable(text) + "\" is not possible; give a number, or any of a range as 0.1..0.4");
  }
  lowest = *low;
  highest = *high;
}

Tangential::Tangential(const std::string &text) : share("--tangential", text.substr(0, text.find(','))) {
  const std::size_t comma = text.find(',');
  if (comma != std::string::npos) {
    angle_deg = to_double(trim(std::string_view(text).substr(comma + 1)));
    if (!angle_deg || !(std::abs(*angle_deg) <= 360.0)) {
      throw Error("--tangential \"" + printable(text) + "\" has no direction; after the comma give degrees from -360 to 360, as 0.3,90");
    }
  }
}

bool Episode::slips(double t_s) const {
  constexpr double ROUNDING_s = 1e-7;
  bool slips = false;
  for (std::size_t i = 0; i < phases.size(); i++) {
    const bool goes_on = i + 1 < phases.size() && phases[i + 1].slip;
    slips =
        slips || (phases[i].slip && t_s > phases[i].begin_s + ROUNDING_s && t_s < phases[i].end_s + (goes_on ? ROUNDING_s : -ROUNDING_s));
  }
  return slips;
}

Block block_around(const Layer &layer, double overhang_mm) {
  return {layer, outermost_mm(geometry.x_mm) + overhang_mm, outermost_mm(geometry.y_mm) + overhang_mm};
}

std::vector<Place> sensor_places() {
  std::vector<Place> places;
  for (std::size_t k = 0; k < geometry.sensor_count; k++) {
    places.push_back({static_cast<double>(geometry.x_mm[k]), static_cast<double>(geometry.y_mm[k])});
  }
  return places;
}

ScenarioOptions complete(const ScenarioOptions &options) {
  const ScenarioKind &kind = scenario_kind(options.kind);
  ScenarioOptions chosen = options;
  chosen.seconds = milliseconds(options.seconds.value_or(kind.usual_seconds));
  chosen.indenter = options.indenter.empty() ? kind.usual_indenter : options.indenter;
  chosen.margin_mm = options.margin_mm.value_or(kind.usual_margin_steps * grid_of_pad().step_mm);
  chosen.pad_seed = options.pad_seed.value_or(options.seed);
  chosen.forces = options.forces.empty() ? kind.usual_forces : options.forces;
  check("--seconds", *chosen.seconds, 1.0, 7200.0);
  if (chosen.overhang_mm) {
    check("--overhang", *chosen.overhang_mm, 3.0, 20.0);
    check("--layer of a pad that ends", chosen.layer_mm, 4.0, 20.0);
  }
  check("--margin", *chosen.margin_mm, 0.0, 10.0);
  check("--quiet", chosen.quiet_s, 0.1, 60.0);
  check("--dead-travel", chosen.dead_travel_mm, 0.0, 10.0);
  check("--creep", chosen.creep_share, 0.0, 1.0);
  check("--kinetic", chosen.kinetic_share, 0.5, 1.0);
  check("--stick-slip", chosen.stick_slip_mm, 0.0, 5.0);
  for (double speed_mm_s : chosen.speeds_mm_s) {
    check("--speed", speed_mm_s, 1.0, chosen.kind == "slide" ? SLIDE_SPEED_MAX_mm_s : 1000.0);
  }
  const auto is = [&](std::initializer_list<const char *> names) {
    return std::find(names.begin(), names.end(), chosen.kind) != names.end();
  };
  const auto no_effect = [&](const char *option, const char *others) {
    throw Error(std::string(option) + " has no effect in a scenario of \"" + chosen.kind + "\"; leave it out, or choose " + others);
  };
  if (!chosen.speeds_mm_s.empty() && !is({"slip", "rolloff", "drag", "slide"})) {
    no_effect("--speed", "slip, rolloff, drag or slide");
  }
  chosen.tangential = options.tangential.empty() ? kind.usual_tangential : options.tangential;
  chosen.friction = options.friction.empty() ? kind.usual_friction : options.friction;
  if (is({"slide"})) {
    chosen.mass_kg = options.mass_kg.empty() ? USUAL_MASS_kg : options.mass_kg;
  } else if (!options.mass_kg.empty()) {
    no_effect("--mass", "slide");
  }
  const Range share = Tangential(chosen.tangential).share;
  const Range friction("--friction", chosen.friction);
  for (double end : {friction.lowest, friction.highest}) {
    check("--friction", end, 0.05, 5.0);
  }
  if (share.highest > 0.0 && is({"slip", "rolloff", "slide"})) {
    no_effect("--tangential", "another");
  }
  if (!(share.lowest >= 0.0 && share.highest <= friction.lowest)) {
    throw Error("--tangential " + number(share.lowest < 0.0 ? share.lowest : share.highest) + " does not hold; give 0 to " +
                number(friction.lowest) + ", or another --friction");
  }
  if (is({"slide"})) {
    check("--dead-travel", chosen.dead_travel_mm, 0.1, 4.0);
    check_slide(chosen, friction.lowest);
  }
  static_cast<void>(Forces(chosen.forces));
  return chosen;
}

Scenario make_scenario(const ScenarioOptions &options, const ContactTable &table) {
  const ScenarioKind &kind = scenario_kind(options.kind);
  Scenario scenario;
  scenario.options = complete(options);
  const ScenarioOptions &chosen = scenario.options;
  const bool pulled_by_share = Tangential(chosen.tangential).share.highest > 0.0;
  scenario.pulls = pulled_by_share || chosen.kind == "drag" || chosen.kind == "slide";
  ScenarioBuilder builder(chosen, table);
  for (std::size_t n = 0;; n++) {
    Episode episode = kind.episode(builder, n);
    if (pulled_by_share && !kind.pulls_itself) {
      add_tangential_load(episode, builder, n);
    }
    if (!builder.add(std::move(episode))) {
      break;
    }
  }
  if (builder.episodes.empty()) {
    throw Error("--seconds " + number(*chosen.seconds) + " is too short for one contact of \"" + chosen.kind + "\"; leave it out for " +
                number(kind.usual_seconds));
  }
  scenario.episodes = std::move(builder.episodes);
  scenario.name = name_of(chosen);
  return scenario;
}

} // namespace fingertip::twin
