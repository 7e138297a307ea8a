// shear_static: what the firmware says of touches that pull along the rubber, beside the truth.
//
// Touches of the twin's objects (pulled.hpp) go through the firmware's fit and its estimate of
// tangential load. One JSON object on the standard output: the keys that are judged, and the tables
// and samples behind them. If nothing else is said: calibrated pads of 10 % gain spread, 12 mm of
// rubber without end, the noise of OSR 1024, 1 to 10 N, seven objects at any angle, anywhere on the
// array (|x| <= 9 mm, |y| <= 18 mm), the load risen under a constant normal force at a friction of
// 0.5, in any direction.
#include "libfingertip/in_parallel.hpp"
#include "library/pad/edges.hpp"
#include "library/pad/profile.hpp"
#include "report/reference/options.hpp"
#include "shear/static/bounds.hpp"
#include "shear/static/results.hpp"
#include "simulation/twin/effects.hpp"
#include "simulation/twin/scenarios.hpp"

extern "C" {
#include "config/defaults.h"
#include "ms58xx/ms58xx.h"
}

#include <cmath>
#include <cstdio>
#include <exception>
#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace {

using namespace fingertip;
using namespace fingertip::shear;
using nlohmann::ordered_json;
using namespace std::string_literals;

constexpr char HELP[] = "usage: shear_static [--seed S] [--pads N] [--cache DIR]\n"
                        "  --seed S     of pads and touches, 20221015 by default\n"
                        "  --pads N     pads of each case, 1500 by default; a fifth for some\n"
                        "  --cache DIR  folder of the contact tables\n";

struct Options {
  std::string cache = FINGERTIP_TABLES_DIR;
  std::uint64_t seed = 20221015, pads = 1500;
};

constexpr double LAYER_mm = 12.0, FRICTION = 0.5, SHARE = 0.3;
constexpr std::size_t TOUCHES = 10, UNITS_PER_PAD = 5; // 50 of each pad
// As truth_fit has them: round or nearly so, the lime with 45 by 55 mm the least.
const std::vector<std::string> SEVEN{"sphere6",   "sphere15",    "cylinder6", "cube6",
                                     "ping_pong", "rubber_duck", "lime"};
// Every lying cylinder of the twin, a shorter one, and an edge.
const std::vector<std::string> LONG{"cylinder6x12", "edge20",     "ball_bearing",
                                    "cylinder12",   "cylinder18", "cylinder24"};
const std::vector<std::string> SMALL{"sphere6", "sphere15", "cylinder6"};

// How the load came: under a constant normal force, together with it, or until all slides.
enum class History { held, together, slides };

using PadOf = std::function<KnownPad(std::size_t)>;

struct Case {
  std::vector<const Object *> objects;
  PadOf pad;
  double share = SHARE;
  History history = History::held;
  double force_min_N = 1.0, force_max_N = 10.0;
  std::uint16_t osr = 1024;
  std::size_t sensors = SENSORS; // in use, chosen for each touch
  double beyond_mm = 0.0;        // places up to so far outside the array, and only there
  const twin::BlockTable *block = nullptr;
  double fewer = 1.0; // pads, as a share
};

double noise_Pa(std::uint16_t osr) {
  return ms58xx_find_osr(osr)->noise_Pa_q10 / 1024.0;
}

bool is_on_array(double x_mm, double y_mm) {
  return std::abs(x_mm) <= 9.0 && std::abs(y_mm) <= 18.0;
}

// Half a pitch inside the outer sensors is where the paper presses; within half a pitch of one row
// of them, or of two.
const char *place_of(const twin::Touch &touch) {
  const bool at_x = std::abs(touch.x_mm) > 4.5, at_y = std::abs(touch.y_mm) > 13.5;
  return at_x && at_y ? "corner" : at_x || at_y ? "border" : "inner";
}

class Judge {
public:
  explicit Judge(const Options &options)
      : options_(options), objects_(options.cache), profile_(profile_of(LAYER_mm)) {}
  ordered_json judge();

private:
  std::vector<const Object *> on(double layer_mm, const std::vector<std::string> &names) {
    std::vector<const Object *> objects;
    for (const std::string &name : names) {
      objects.push_back(&objects_.on(layer_mm, name));
    }
    return objects;
  }
  Case usual() {
    Case c;
    c.objects = on(LAYER_mm, SEVEN);
    c.pad = calibrated_;
    return c;
  }
  // Calibrated pads under rubber of this thickness.
  PadOf calibrated_on(double layer_mm) {
    const Object &sphere15 = objects_.on(layer_mm, "sphere15");
    Fingertip fingertip(profile_of(layer_mm));
    const auto known = std::make_shared<std::vector<KnownPad>>();
    for (const truth::Pad &pad : calibrations_) {
      known->push_back(fingertip.weighed(pad, sphere15));
    }
    return [known](std::size_t pad) { return (*known)[pad % known->size()]; };
  }
  std::size_t units(const Case &c) const {
    const double pads = std::ceil(c.fewer * static_cast<double>(options_.pads));
    return static_cast<std::size_t>(pads) * UNITS_PER_PAD;
  }
  twin::Touch draw(const Case &c, const fit_array &array, Random &random) const;
  Results run(const std::string &table, const Case &c, const pad_profile *profile = nullptr) const;
  void progress(const char *what) const { std::fprintf(stderr, "shear_static: %s\n", what); }

  struct Ended {
    Results zero, loaded, increment;
  };
  Ended touch_twice(const Case &c, const pad_profile &profile) const;

  void judge_pads();
  void judge_places(const Results &usual);
  void judge_objects();
  void judge_elongated();
  void judge_limits();
  void judge_thickness();
  void judge_bounds();
  void judge_rubber();
  void judge_screws();
  void judge_taps();
  void judge_overhang();
  void draw_arrows();

  Options options_;
  Objects objects_;
  pad_profile profile_;
  truth::CalibratedPads calibrations_;
  PadOf equal_, calibrated_, raw5_, raw10_;
  ordered_json out_;
};

twin::Touch Judge::draw(const Case &c, const fit_array &array, Random &random) const {
  twin::Touch touch;
  do {
    const truth::Touch drawn = truth::draw_touch(array, random);
    touch.x_mm = drawn.x_mm * (1.0 + c.beyond_mm / 9.0);
    touch.y_mm = drawn.y_mm * (1.0 + c.beyond_mm / 18.0);
    touch.angle_rad = drawn.angle_rad;
  } while (c.beyond_mm > 0.0 && is_on_array(touch.x_mm, touch.y_mm));
  touch.force_N = random.uniform(c.force_min_N, c.force_max_N);
  const double share = c.history == History::slides ? FRICTION : c.share;
  const double direction = random.uniform(0.0, 2.0 * M_PI), load_N = share * touch.force_N;
  touch.pull_x_N = load_N * std::cos(direction);
  touch.pull_y_N = load_N * std::sin(direction);
  touch.stuck_N =
      c.history == History::held ? twin::stuck_force_N(touch.force_N, load_N, FRICTION) : 0.0;
  return touch;
}

// Cases of one table draw the same touches.
Results Judge::run(const std::string &table, const Case &c, const pad_profile *profile) const {
  std::vector<Judged> judged(units(c) * TOUCHES);
  const std::uint64_t stream = truth::stream_of(table);
  twin::in_parallel(units(c), [&](std::size_t unit) {
    Random random(options_.seed, stream, unit), errors(options_.seed, stream + 1, unit);
    Fingertip fingertip(profile ? *profile : profile_);
    const KnownPad pad = c.pad(unit / UNITS_PER_PAD);
    for (std::size_t t = 0; t < TOUCHES;) {
      Judged &j = judged[unit * TOUCHES + t];
      j.truth = draw(c, fingertip.array(), random);
      j.object = random.next() % c.objects.size();
      const Readings base = base_Pa(fingertip.array(), *c.objects[j.object], j.truth, c.block);
      const std::uint32_t usable = truth::choose_sensors(c.sensors, errors);
      // Without a positive reading among the sensors in use there is nothing to judge.
      t += fingertip.feel(base, pad, noise_Pa(c.osr), usable, errors, j.said);
    }
  });
  return Results(std::move(judged));
}

// Pads by how much is known of their gains, loads from none to sliding.
void Judge::judge_pads() {
  struct Kind {
    const char *name;
    const PadOf &pad;
  };
  const Kind kinds[] = {{"equal gains", equal_},
                        {"10 %, calibrated", calibrated_},
                        {"5 %, not calibrated", raw5_},
                        {"10 %, not calibrated", raw10_}};
  struct Load {
    const char *name;
    double share;
    History history;
  };
  const Load loads[] = {
      {"0", 0.0, History::held},     {"0.1", 0.1, History::held},
      {"0.3", 0.3, History::held},   {"0.3, risen with the force", 0.3, History::together},
      {"0.45", 0.45, History::held}, {"0.5, sliding", FRICTION, History::slides}};
  for (const Kind &kind : kinds) {
    for (const Load &load : loads) {
      Case c = usual();
      c.pad = kind.pad;
      c.share = load.share;
      c.history = load.history;
      const Results results = run("pads", c);
      ordered_json row = results.row(std::string(kind.name) + ", Q/F " + load.name);
      row["pad"] = kind.name;
      row["load"] = load.share;
      out_["by_pad_and_load"].push_back(row);
      const bool equal = kind.name == kinds[0].name, calibrated = kind.name == kinds[1].name;
      const bool loaded = load.share == SHARE && load.history == History::held;
      if ((equal || calibrated) && loaded) {
        const std::string prefix = equal ? "equal_" : "";
        for (const char *key : {"ratio_error_p50", "ratio_error_p95", "vector_error_p50",
                                "vector_error_p95", "direction_p90_deg"}) {
          out_[prefix + key] = row[key];
        }
        out_[equal ? "equal_location_loaded_mm" : "location_loaded_median_mm"] =
            row["location_p50_mm"];
        out_[prefix + "location_loaded_without_mm"] = row["location_without_p50_mm"];
      }
      if (calibrated && loaded) {
        for (const char *key :
             {"valid_percent", "q_cover_1sd", "q_cover_2sd", "location_cover_1sd",
              "location_cover_2sd", "force_p50_percent", "force_without_p50_percent"}) {
          out_[key] = row[key];
        }
        judge_places(results);
      }
      if (calibrated && load.share == 0.0) {
        out_["location_unloaded_mm"] = row["location_p50_mm"];
        out_["location_unloaded_without_mm"] = row["location_without_p50_mm"];
        out_["location_price_mm"] =
            row["location_p50_mm"].get<double>() - row["location_without_p50_mm"].get<double>();
      }
      if (calibrated && (loaded || load.share == 0.0)) {
        ordered_json &curve = out_["location_quantiles"];
        for (int percent = 0; percent <= 100; percent += 2) {
          const auto with = [](const Judged &j) { return j.location_error_mm(); };
          const auto without = [](const Judged &j) { return j.gaussian_location_error_mm(); };
          curve.push_back({{"load", load.share},
                           {"percent", percent},
                           {"with_mm", results.at(with, 0.01 * percent)},
                           {"without_mm", results.at(without, 0.01 * percent)}});
        }
      }
    }
  }
  progress("pads and loads");
}

// Where the errors of the usual case lie.
void Judge::judge_places(const Results &usual) {
  constexpr double CELL_mm = 3.0;
  for (const char *place : {"inner", "border", "corner"}) {
    const auto here = [=](const Judged &j) { return place == std::string(place_of(j.truth)); };
    out_["by_place"].push_back(usual.where(here).row(place));
    for (std::size_t o = 0; o < SEVEN.size(); o++) {
      const Results some = usual.where([=](const Judged &j) { return here(j) && j.object == o; });
      ordered_json row = some.row(SEVEN[o] + ", " + place);
      const Results valid = some.where([](const Judged &j) { return j.said.valid; });
      row["off_by_0_05_percent"] =
          valid.share([](const Judged &j) { return j.vector_error() > 0.05; });
      row["off_by_5_deg_percent"] =
          valid.share([](const Judged &j) { return j.direction_error_deg() > 5.0; });
      out_["where_misses_lie"].push_back(row);
    }
  }
  const Results rounder = usual.where(
      [](const Judged &j) { return SEVEN[j.object] != "lime" && place_of(j.truth) != "corner"s; });
  const ordered_json row = rounder.row("without the lime and the corners");
  for (const char *key : {"ratio_error_p95", "vector_error_p95", "direction_p90_deg"}) {
    out_["no_lime_no_corner_" + std::string(key)] = row[key];
  }
  for (double force_N = 1.0; force_N < 10.0; force_N *= 2.0) {
    const double to_N = force_N < 8.0 ? 2.0 * force_N : 10.0;
    const Results some = usual.where(
        [=](const Judged &j) { return j.truth.force_N >= force_N && j.truth.force_N < to_N; });
    out_["by_force"].push_back(some.row(std::to_string(static_cast<int>(force_N)) + " to " +
                                        std::to_string(static_cast<int>(to_N)) + " N"));
  }
  for (double x_mm = -9.0; x_mm < 9.0; x_mm += CELL_mm) {
    for (double y_mm = -18.0; y_mm < 18.0; y_mm += CELL_mm) {
      const Results cell = usual.where([=](const Judged &j) {
        return j.truth.x_mm >= x_mm && j.truth.x_mm < x_mm + CELL_mm && j.truth.y_mm >= y_mm &&
               j.truth.y_mm < y_mm + CELL_mm;
      });
      const bool empty = cell.valid_percent() == 0.0;
      const auto vector_error = [&](double quantile) {
        const auto vector = [](const Judged &j) { return j.vector_error(); };
        return empty ? ordered_json() : ordered_json(cell.valid_at(vector, quantile));
      };
      out_["map"].push_back({{"x_mm", x_mm + 0.5 * CELL_mm},
                             {"y_mm", y_mm + 0.5 * CELL_mm},
                             {"touches", cell.all().size()},
                             {"vector_error_p50", vector_error(0.5)},
                             {"vector_error_p95", vector_error(0.95)}});
    }
  }
}

void Judge::judge_objects() {
  std::vector<std::string> names;
  for (const twin::Indenter &one : twin::indenters()) {
    names.push_back(one.name);
  }
  names.insert(names.end(), {"cube15", "cylinder6x12", "edge20"});
  for (const std::string &name : names) {
    for (const double share : {0.0, SHARE}) {
      Case c = usual();
      c.objects = on(LAYER_mm, {name});
      c.share = share;
      c.fewer = 0.1;
      ordered_json row = run("objects", c).row(name + (share > 0.0 ? ", Q/F 0.3" : ", Q/F 0"));
      row["object"] = name;
      row["load"] = share;
      out_["by_object"].push_back(row);
    }
  }
  progress("objects");
}

void Judge::judge_elongated() {
  Case c = usual();
  c.objects = on(LAYER_mm, LONG);
  c.share = 0.0;
  const Results results = run("elongated", c);
  out_["elongated_false_percent"] = results.claimed_percent();
  out_["elongated_false_surely_percent"] = results.claimed_surely_percent();
  out_["elongated_false_unflagged_percent"] = results.claimed_unflagged_percent();
  out_["elongated_valid_percent"] = results.valid_percent();
  for (std::size_t o = 0; o < LONG.size(); o++) {
    out_["elongated"].push_back(
        results.where([=](const Judged &j) { return j.object == o; }).row(LONG[o] + ", any angle"));
  }
  constexpr int BINS = 6;
  for (int bin = 0; bin < BINS; bin++) {
    const Results some = results.where([=](const Judged &j) {
      const double half_turns = j.truth.angle_rad / M_PI;
      return static_cast<int>(BINS * (half_turns - std::floor(half_turns))) == bin;
    });
    const int from = 180 / BINS * bin;
    out_["elongated"].push_back(some.row("any of them, " + std::to_string(from) + " to " +
                                         std::to_string(from + 180 / BINS) + " degrees"));
  }
  progress("elongated objects");
}

// Light touches, oversampling, sensors missing, places beyond the array.
void Judge::judge_limits() {
  struct Light {
    const char *name;
    double least_N, most_N;
  };
  for (const Light &light : {Light{"0.1 to 0.2 N", 0.1, 0.2}, Light{"0.2 to 0.5 N", 0.2, 0.5},
                             Light{"0.5 to 1 N", 0.5, 1.0}}) {
    for (const double share : {0.0, SHARE}) {
      Case c = usual();
      c.share = share;
      c.force_min_N = light.least_N;
      c.force_max_N = light.most_N;
      c.fewer = 0.2;
      out_["light_touches"].push_back(
          run("light", c).row(std::string(light.name) + (share > 0.0 ? ", Q/F 0.3" : ", Q/F 0")));
    }
  }
  for (std::uint16_t osr = 256; osr <= 8192; osr = static_cast<std::uint16_t>(2 * osr)) {
    Case c = usual();
    c.osr = osr;
    c.fewer = 0.2;
    ordered_json row = run("osr", c).row("OSR " + std::to_string(osr));
    row["noise_Pa"] = noise_Pa(osr);
    out_["by_osr"].push_back(row);
  }
  for (const std::size_t sensors : {15u, 14u, 13u, 12u, 10u, 8u}) {
    Case c = usual();
    c.sensors = sensors;
    c.fewer = 0.2;
    out_["by_sensors"].push_back(run("sensors", c).row(std::to_string(sensors) + " sensors"));
  }
  Case c = usual();
  c.beyond_mm = 4.5;
  c.fewer = 0.2;
  out_["by_place"].push_back(run("beyond", c).row("up to 4.5 mm outside the array"));
  progress("light touches, OSR, missing sensors");
}

void Judge::judge_thickness() {
  for (const double layer_mm : {5.0, 6.0, 9.0, 12.0, 15.0, 20.0}) {
    const PadOf pads = calibrated_on(layer_mm);
    for (const double told : {1.0, 1.1, 0.9}) {
      const double told_mm = told * layer_mm;
      if (told_mm < static_cast<double>(PAD_THICKNESS_MIN_mm) ||
          told_mm > static_cast<double>(PAD_THICKNESS_MAX_mm)) {
        continue;
      }
      const pad_profile profile = profile_of(told_mm);
      Case c = usual();
      c.objects = on(layer_mm, SMALL);
      c.pad = pads;
      c.fewer = 0.1;
      char name[64];
      std::snprintf(name, sizeof name, "%g mm, told %g mm", layer_mm, told_mm);
      for (const double share : {0.0, SHARE}) {
        c.share = share;
        ordered_json row = run("thickness", c, &profile)
                               .row(std::string(name) + (share > 0.0 ? ", Q/F 0.3" : ", Q/F 0"));
        row["layer_mm"] = layer_mm;
        row["told_mm"] = told_mm;
        row["load"] = share;
        out_["by_thickness"].push_back(row);
      }
    }
  }
  progress("thicknesses");
}

// What errors of these covariances would be found as.
void Judge::judge_bounds() {
  struct Limit {
    const char *name;
    Told told;
    bool gains;
    double model_share;
  };
  const Limit limits[] = {
      {"noise", Told::nothing, false, 0.0},
      {"noise, gains", Told::nothing, true, 0.0},
      {"noise, model 0.1 %", Told::nothing, false, 0.001},
      {"noise, model 0.3 %", Told::nothing, false, 0.003},
      {"noise, model 1 %", Told::nothing, false, 0.01},
      {"noise; priors", Told::priors, false, 0.0},
      {"noise, gains; priors", Told::priors, true, 0.0},
      {"noise, model 0.1 %; priors", Told::priors, false, 0.001},
      {"noise, model 0.3 %; priors", Told::priors, false, 0.003},
      {"noise, model 1 %; priors", Told::priors, false, 0.01},
      {"noise, gains, model 0.1 %; priors", Told::priors, true, 0.001},
      {"noise, gains, model 0.1 %; told round", Told::round, true, 0.001},
  };
  constexpr std::size_t TOUCHES_MAX = 4000;
  const Case c = usual();
  const fit_array array = truth::firmware_array();
  const std::size_t touches = std::min(TOUCHES_MAX, units(c) * TOUCHES);
  for (const Limit &limit : limits) {
    std::vector<Judged> judged(touches);
    twin::in_parallel(touches, [&](std::size_t i) {
      Random random(options_.seed, truth::stream_of("bounds"), i);
      const KnownPad pad = c.pad(i);
      Judged &j = judged[i];
      j.truth = draw(c, array, random);
      const Errors errors{noise_Pa(c.osr), limit.gains ? &pad.pad.gain_sd : nullptr,
                          limit.model_share};
      const Bound bound = bound_of(array, profile_, j.truth, errors, limit.told);
      const auto drawn = [&](const Eigen::Matrix2d &covariance) -> Eigen::Vector2d {
        const double first = random.normal(), second = random.normal();
        return covariance.llt().matrixL() * Eigen::Vector2d(first, second);
      };
      const Eigen::Vector2d ratio = drawn(bound.ratio), place_mm = drawn(bound.place_mm2);
      j.said = {};
      j.said.valid = true;
      j.said.qx = j.truth.pull_x_N / j.truth.force_N + ratio[0];
      j.said.qy = j.truth.pull_y_N / j.truth.force_N + ratio[1];
      j.said.x_mm = j.truth.x_mm + place_mm[0];
      j.said.y_mm = j.truth.y_mm + place_mm[1];
    });
    const ordered_json row = Results(std::move(judged)).row(limit.name);
    ordered_json bound;
    for (const char *key :
         {"case", "touches", "ratio_error_p50", "ratio_error_p95", "vector_error_p50",
          "vector_error_p95", "direction_p90_deg", "location_p50_mm", "location_p95_mm"}) {
      bound[key] = row[key];
    }
    out_["bounds"].push_back(bound);
  }
  progress("bounds");
}

// The rubber's own time: a press, a load that comes and goes, read at some moments. Gains are
// equal, or, where rubber relaxes, also those that placements read from 0.5 to 1 s after find.
void Judge::judge_rubber() {
  struct Moment {
    const char *name;
    double t_s;
  };
  const Moment moments[] = {{"0.6 s after the touch, no load yet", 0.9},
                            {"0.2 s after the load", 1.5},
                            {"1.7 s after the load", 3.0},
                            {"10 s after the load", 11.2},
                            {"0.2 s after the load has gone", 11.8}};
  constexpr double PRESS_END_s = 0.3, LOAD_s = 1.0, LOAD_END_s = 1.3, UNLOAD_s = 11.3,
                   UNLOAD_END_s = 11.6, STEP_s = 0.03;
  const auto rises = [](double t_s, double from_s, double to_s) {
    return std::clamp((t_s - from_s) / (to_s - from_s), 0.0, 1.0);
  };
  struct Rubber {
    const char *effects;
    bool calibrated;
  };
  const Case c = usual();
  const std::size_t touches = std::max<std::size_t>(20, options_.pads);
  for (const Rubber &kind :
       {Rubber{"none", false}, Rubber{"relaxation", false}, Rubber{"relaxation", true},
        Rubber{"hysteresis", false}, Rubber{"aftereffect", false},
        Rubber{"relaxation,hysteresis,aftereffect", true}}) {
    const twin::EffectValues values = twin::parse_effects(kind.effects);
    std::vector<std::array<Judged, std::size(moments)>> judged(touches);
    twin::in_parallel(touches, [&](std::size_t i) {
      Random random(options_.seed, truth::stream_of("rubber"), i);
      Fingertip fingertip(profile_);
      KnownPad pad{truth::perfect_pad(), {}};
      const twin::Touch full = draw(c, fingertip.array(), random);
      const Object &object = *c.objects[random.next() % c.objects.size()];
      const std::uint64_t rubber_seed = random.next();
      twin::Pad rubber(values, SENSORS, LAYER_mm, twin::AMBIENT_Pa, rubber_seed);
      std::vector<double> reported(SENSORS);
      if (kind.calibrated) {
        constexpr double PLACED_Pa = 1e4, READ_s = 0.75;
        twin::Pad placed(values, SENSORS, LAYER_mm, twin::AMBIENT_Pa, rubber_seed);
        placed.report(0.0, std::vector<double>(SENSORS, 0.0), reported);
        placed.report(0.01, std::vector<double>(SENSORS, PLACED_Pa), reported);
        placed.report(READ_s, std::vector<double>(SENSORS, PLACED_Pa), reported);
        for (std::size_t k = 0; k < SENSORS; k++) {
          pad.pad.gain[k] = PLACED_Pa / reported[k];
        }
      }
      std::size_t moment = 0;
      for (int step = 0; moment < std::size(moments); step++) {
        const double t_s = STEP_s * step;
        const double pressed = rises(t_s, 0.0, PRESS_END_s);
        const double loaded = rises(t_s, LOAD_s, LOAD_END_s) - rises(t_s, UNLOAD_s, UNLOAD_END_s);
        twin::Touch now = full;
        now.force_N = pressed * full.force_N;
        now.pull_x_N = loaded * full.pull_x_N;
        now.pull_y_N = loaded * full.pull_y_N;
        const double load_N = std::hypot(now.pull_x_N, now.pull_y_N);
        now.stuck_N = twin::stuck_force_N(now.force_N, load_N, FRICTION);
        const Readings base = base_Pa(fingertip.array(), object, now);
        rubber.report(t_s, std::vector<double>(base.begin(), base.end()), reported);
        if (t_s >= moments[moment].t_s) {
          Readings felt;
          std::copy(reported.begin(), reported.end(), felt.begin());
          Judged &j = judged[i][moment++];
          j.truth = now;
          j.object = 0;
          fingertip.feel(felt, pad, noise_Pa(c.osr), ALL_SENSORS, random, j.said);
        }
      }
    });
    for (std::size_t m = 0; m < std::size(moments); m++) {
      std::vector<Judged> at;
      for (const auto &touch : judged) {
        at.push_back(touch[m]);
      }
      const std::string name = std::string(kind.effects) + (kind.calibrated ? ", calibrated" : "");
      ordered_json row = Results(std::move(at)).row(name + ", " + moments[m].name);
      row["effects"] = name;
      row["t_s"] = moments[m].t_s;
      out_["by_rubber"].push_back(row);
    }
  }
  progress("creep and relaxation");
}

// A torque alone: what is read while the object spins, and what that is more than before.
void Judge::judge_screws() {
  const double seconds = std::max(60.0, static_cast<double>(options_.pads));
  for (const char *name : {"sphere15", "sphere6", "cylinder6", "ping_pong", "lime", "cube12"}) {
    const Object &object = objects_.on(LAYER_mm, name);
    twin::ScenarioOptions scenario;
    scenario.kind = "screw";
    scenario.indenter = name;
    scenario.seconds = seconds;
    scenario.seed = options_.seed;
    const twin::Scenario screws = twin::make_scenario(scenario, object.pressure);
    std::vector<double> read, change;
    Fingertip fingertip(profile_);
    Random random(options_.seed, truth::stream_of("screws"), 0);
    for (std::size_t a = 0; a < screws.acts.size(); a++) {
      const twin::Act &act = screws.acts[a];
      const KnownPad pad = calibrated_(a);
      Said before{};
      for (const twin::Phase &phase : act.phases) {
        if (phase.name != "hold" && phase.name != "spin") {
          continue;
        }
        const twin::Touch now = act.tracks[0].at(0.5 * (phase.begin_s + phase.end_s) - act.begin_s);
        Said said{};
        fingertip.feel(base_Pa(fingertip.array(), object, now), pad, noise_Pa(1024), ALL_SENSORS,
                       random, said);
        if (phase.name == "hold") {
          before = said;
        } else if (said.valid && before.valid) {
          read.push_back(std::hypot(said.qx, said.qy));
          change.push_back(std::hypot(said.qx - before.qx, said.qy - before.qy));
        }
      }
    }
    out_["screws"].push_back({{"object", name},
                              {"screws", screws.acts.size()},
                              {"spins_with_an_estimate", read.size()},
                              {"read_p50", truth::quantile(read, 0.5)},
                              {"read_p95", truth::quantile(read, 0.95)},
                              {"change_p50", truth::quantile(change, 0.5)},
                              {"change_p95", truth::quantile(change, 0.95)}});
  }
  const ordered_json usual = out_["screws"][0];
  out_["screw_ratio"] = usual["read_p50"];
  out_["screw_change_p95"] = usual["change_p95"];
  progress("screws");
}

// The taps of the paper's table II, as the twin plays them, read at 20 Hz from 1 N on.
void Judge::judge_taps() {
  constexpr double RATE_Hz = 20.0, LEAST_N = 1.0;
  constexpr std::size_t PADS = 8;
  const double seconds = std::clamp(static_cast<double>(options_.pads), 40.0, 600.0) / PADS;
  const char *const names[] = {"sphere6", "sphere15", "cylinder6", "cube6"};
  struct Kind {
    const char *name;
    const PadOf &pad;
  };
  for (const Kind &kind : {Kind{"equal gains", equal_}, Kind{"10 %, calibrated", calibrated_},
                           Kind{"10 %, not calibrated", raw10_}}) {
    for (const double share : {0.0, 0.1, 0.3}) {
      std::vector<std::vector<Judged>> found(std::size(names) * PADS);
      for (std::size_t i = 0; i < found.size(); i++) {
        const Object &object = objects_.on(LAYER_mm, names[i / PADS]);
        twin::ScenarioOptions scenario;
        scenario.kind = "taps";
        scenario.indenter = object.name;
        scenario.seconds = std::max(40.0, seconds);
        scenario.margin_mm = 0.0;
        scenario.seed = options_.seed + i % PADS;
        if (share > 0.0) {
          scenario.tangential = std::to_string(share);
        }
        const twin::Scenario taps = twin::make_scenario(scenario, object.pressure);
        Fingertip fingertip(profile_);
        Random random(options_.seed, truth::stream_of("taps"), i);
        const KnownPad pad = kind.pad(i % PADS);
        for (const twin::Act &act : taps.acts) {
          for (double t_s = 0.0; t_s < act.end_s - act.begin_s; t_s += 1.0 / RATE_Hz) {
            Judged j{act.tracks[0].at(t_s), i / PADS, {}};
            if (j.truth.force_N >= LEAST_N &&
                fingertip.feel(base_Pa(fingertip.array(), object, j.truth), pad, noise_Pa(1024),
                               ALL_SENSORS, random, j.said)) {
              found[i].push_back(j);
            }
          }
        }
      }
      // Each pad has a factor of its own, which one known weight tells.
      std::vector<Judged> all;
      for (std::vector<Judged> &of_pad : found) {
        all.insert(all.end(), of_pad.begin(), of_pad.end());
      }
      const Results results(std::move(all));
      const auto scaled = [&](const Results::Value &said_N, const char *key, ordered_json &row) {
        std::vector<double> errors;
        for (std::size_t pad = 0; pad < PADS; pad++) {
          std::vector<double> scales;
          for (std::size_t i = pad; i < found.size(); i += PADS) {
            for (const Judged &j : found[i]) {
              scales.push_back(j.truth.force_N / said_N(j));
            }
          }
          const double scale = truth::quantile(scales, 0.5);
          for (std::size_t i = pad; i < found.size(); i += PADS) {
            for (const Judged &j : found[i]) {
              errors.push_back(100.0 * std::abs(scale * said_N(j) / j.truth.force_N - 1.0));
            }
          }
        }
        row[key] = truth::quantile(errors, 0.5);
      };
      char name[64];
      std::snprintf(name, sizeof name, "%s, Q/F %g", kind.name, share);
      ordered_json row = results.row(name);
      row["pad"] = kind.name;
      row["load"] = share;
      scaled([](const Judged &j) { return j.said.force_N; }, "force_scaled_p50_percent", row);
      scaled([](const Judged &j) { return j.said.gaussian_force_N; },
             "force_scaled_without_p50_percent", row);
      out_["taps"].push_back(row);
    }
  }
  progress("taps of table II");
}

// Pads that end, by what the fingertip is told: the thickness alone, or what the ends do to the
// estimate as well (pad/edges.hpp). The zero is what is read without a load; the increment what is
// read with it, less what the same touch reads at its beginning.
void Judge::judge_overhang() {
  double worst_zero = 0.0;
  for (const double overhang_mm : {13.0, 9.0, 6.0, 4.5}) {
    const twin::BlockTable block =
        twin::BlockTable::load_or_build(twin::block_around(twin::silicone(LAYER_mm), overhang_mm),
                                        twin::sensor_places(), options_.cache);
    pad_profile told = profile_;
    told.overhang_mm = static_cast<float>(overhang_mm);
    told.edges = pad::edges_of(told, pad::own_sensors(), options_.cache);
    char mm[16];
    std::snprintf(mm, sizeof mm, "_%gmm", overhang_mm);
    for (const bool knows_ends : {false, true}) {
      Case c = usual();
      c.block = &block;
      c.fewer = 0.2;
      const Ended ended = touch_twice(c, knows_ends ? told : profile_);
      for (const char *place : {"anywhere", "inner", "border", "corner"}) {
        const auto here = [=](const Judged &j) {
          return place == "anywhere"s || place == std::string(place_of(j.truth));
        };
        const Results zero = ended.zero.where(here), loaded = ended.loaded.where(here);
        const Results increment = ended.increment.where(here);
        const auto vector = [](const Judged &j) { return j.vector_error(); };
        const auto located = [](const Judged &j) { return j.location_error_mm(); };
        const auto gaussian = [](const Judged &j) { return j.gaussian_location_error_mm(); };
        out_["by_overhang"].push_back(
            {{"overhang_mm", overhang_mm},
             {"told", knows_ends ? "thickness and ends" : "thickness"},
             {"place", place},
             {"touches", zero.all().size()},
             {"valid_percent", increment.valid_percent()},
             {"zero_error_p50", zero.valid_at(vector, 0.5)},
             {"zero_error_p95", zero.valid_at(vector, 0.95)},
             {"loaded_error_p50", loaded.valid_at(vector, 0.5)},
             {"loaded_error_p95", loaded.valid_at(vector, 0.95)},
             {"increment_error_p50", increment.valid_at(vector, 0.5)},
             {"increment_error_p95", increment.valid_at(vector, 0.95)},
             {"location_p50_mm", zero.at(located, 0.5)},
             {"location_without_p50_mm", zero.at(gaussian, 0.5)},
             {"location_loaded_p50_mm", loaded.at(located, 0.5)},
             {"location_loaded_without_p50_mm", loaded.at(gaussian, 0.5)}});
      }
      const ordered_json anywhere = out_["by_overhang"][out_["by_overhang"].size() - 4];
      const std::string told_ends = knows_ends ? "_own_tables" : "";
      out_["zero_error_p50" + told_ends + mm] = anywhere["zero_error_p50"];
      out_["increment_error_p50" + told_ends + mm] = anywhere["increment_error_p50"];
      if (knows_ends && overhang_mm >= 9.0) {
        worst_zero = std::max(worst_zero, anywhere["zero_error_p50"].get<double>());
      }
    }
  }
  out_["zero_error_p50_own_tables"] = worst_zero;
  progress("pads that end");
}

Judge::Ended Judge::touch_twice(const Case &c, const pad_profile &profile) const {
  constexpr double FIRST_MIN_N = 0.5, FIRST_MAX_N = 2.0;
  std::vector<Judged> zero(units(c) * TOUCHES), loaded(zero.size()), increment(zero.size());
  twin::in_parallel(units(c), [&](std::size_t unit) {
    Random random(options_.seed, truth::stream_of("overhang"), unit);
    Fingertip fingertip(profile);
    const KnownPad pad = c.pad(unit / UNITS_PER_PAD);
    for (std::size_t t = 0; t < TOUCHES; t++) {
      const std::size_t at = unit * TOUCHES + t;
      const twin::Touch full = draw(c, fingertip.array(), random);
      const Object &object = *c.objects[random.next() % c.objects.size()];
      twin::Touch unloaded = full;
      unloaded.pull_x_N = unloaded.pull_y_N = 0.0;
      unloaded.stuck_N = full.force_N;
      twin::Touch first = unloaded;
      first.force_N = first.stuck_N = random.uniform(FIRST_MIN_N, FIRST_MAX_N);
      const auto feel = [&](const twin::Touch &touch) {
        Judged j{touch, 0, {}};
        fingertip.feel(base_Pa(fingertip.array(), object, touch, c.block), pad, noise_Pa(c.osr),
                       ALL_SENSORS, random, j.said);
        return j;
      };
      const Judged begun = feel(first);
      zero[at] = feel(unloaded);
      loaded[at] = feel(full);
      increment[at] = loaded[at];
      increment[at].said.valid = loaded[at].said.valid && begun.said.valid;
      increment[at].said.qx -= begun.said.qx;
      increment[at].said.qy -= begun.said.qy;
    }
  });
  return {Results(std::move(zero)), Results(std::move(loaded)), Results(std::move(increment))};
}

// A handful to look at.
void Judge::draw_arrows() {
  constexpr double FORCE_N = 5.0;
  const Object &object = objects_.on(LAYER_mm, "sphere15");
  Fingertip fingertip(profile_);
  Random random(options_.seed, truth::stream_of("arrows"), 0);
  const KnownPad pad = calibrated_(0);
  for (int column = -1; column <= 1; column++) {
    for (int row = -2; row <= 2; row++) {
      const double direction = random.uniform(0.0, 2.0 * M_PI);
      twin::Touch touch;
      touch.x_mm = 6.0 * column + random.uniform(-1.5, 1.5);
      touch.y_mm = 7.5 * row + random.uniform(-1.5, 1.5);
      touch.force_N = FORCE_N;
      touch.pull_x_N = SHARE * FORCE_N * std::cos(direction);
      touch.pull_y_N = SHARE * FORCE_N * std::sin(direction);
      touch.stuck_N = twin::stuck_force_N(FORCE_N, SHARE * FORCE_N, FRICTION);
      Said said{};
      fingertip.feel(base_Pa(fingertip.array(), object, touch), pad, noise_Pa(1024), ALL_SENSORS,
                     random, said);
      out_["arrows"].push_back({{"x_mm", touch.x_mm},
                                {"y_mm", touch.y_mm},
                                {"qx", touch.pull_x_N / FORCE_N},
                                {"qy", touch.pull_y_N / FORCE_N},
                                {"said_x_mm", said.x_mm},
                                {"said_y_mm", said.y_mm},
                                {"said_qx", said.qx},
                                {"said_qy", said.qy},
                                {"without_x_mm", said.gaussian_x_mm},
                                {"without_y_mm", said.gaussian_y_mm}});
    }
  }
}

ordered_json Judge::judge() {
  if (options_.pads == 0) {
    throw std::runtime_error("--pads needs at least one pad");
  }
  out_["shear_seed"] = options_.seed;
  out_["shear_pads"] = options_.pads;
  calibrations_ = truth::calibrated_pads(options_.pads, options_.seed, options_.cache);
  progress("calibrations");
  calibrated_ = calibrated_on(LAYER_mm);
  equal_ = [](std::size_t) { return KnownPad{truth::perfect_pad(), {}}; };
  const auto spread = [this](double sd, double told) {
    return [this, sd, told](std::size_t pad) {
      Random random(options_.seed, truth::stream_of("raw pads"), pad);
      return KnownPad{truth::raw_pad(sd, told, random), {}};
    };
  };
  raw5_ = spread(0.05, 0.05);
  raw10_ = spread(0.10, static_cast<double>(DEFAULT_GAIN_SD));
  judge_pads();
  judge_objects();
  judge_elongated();
  judge_limits();
  judge_thickness();
  judge_bounds();
  judge_rubber();
  judge_screws();
  judge_taps();
  judge_overhang();
  draw_arrows();
  return out_;
}

} // namespace

int main(int argc, char **argv) {
  try {
    Options options;
    reference::parse_options(argc, argv,
                             {{"--cache", &options.cache},
                              {"--seed", nullptr, &options.seed},
                              {"--pads", nullptr, &options.pads}},
                             HELP);
    std::cout << Judge(options).judge().dump(1) << '\n';
    std::cout.flush();
    return std::cout ? 0 : 1;
  } catch (const std::exception &error) {
    std::fprintf(stderr, "shear_static: %s\n", error.what());
    return 1;
  }
}
