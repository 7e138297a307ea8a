// shear_motion: what tells a slide from a lift, and how soon.
//
// Lifts and slides of the twin (twin/README.md) go frame by frame through the firmware's fit and
// estimate of tangential load into eq. (7), the velocity and SLIDING. One JSON object on the
// standard output: the keys that are judged, of the usual case; under "motion_cases" the same for
// other pads, rates and rubber; under "motion_series" one lift and one slide. The constants of
// motion.c were chosen with seeds 201 to 224 of the twin on pads of 12 mm.
#include "libfingertip/in_parallel.hpp"
#include "report/reference/options.hpp"
#include "shear/motion/watch.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace {

using namespace fingertip;
using namespace fingertip::shear;
using nlohmann::ordered_json;

constexpr char HELP[] = "usage: shear_motion [--seed S] [--pads N] [--usual] [--cache DIR]\n"
                        "  --seed S     of acts, pads and noise, 31000 by default\n"
                        "  --pads N     of each case, for as many lifts of each duration and slides; 200 by default\n"
                        "  --usual      the usual case alone\n"
                        "  --cache DIR  folder of the contact tables\n";

struct Options {
  std::string cache = FINGERTIP_TABLES_DIR;
  std::uint64_t seed = 31000, pads = 200;
  bool usual = false;
};

const std::vector<std::string> SMALL{"sphere6", "sphere15", "cylinder6", "cube6"};

struct Case {
  std::string name;
  std::string pad = "cal";
  Sensing sensing{};
  double layer_mm = 12.0;
  double dead_travel_mm = 1.0, kinetic_share = 0.8;
  std::string forces = "1..10", lift_tangential = "0.1..0.4", lift_friction = "0.5";
  std::vector<std::string> objects = SMALL;
};

std::vector<Case> cases() {
  std::vector<Case> all{{"usual: cal, 12 mm, OSR 1024 at 410 Hz"}};
  const auto with = [&](const std::string &name, const std::function<void(Case &)> &change) {
    Case other = all.front();
    other.name = name;
    change(other);
    all.push_back(other);
  };
  for (const char *pad : {"equal", "raw5", "raw10"}) {
    with(pad, [&](Case &c) { c.pad = pad; });
  }
  with("OSR 256 at 1308 Hz", [](Case &c) { c.sensing = {256, 1308.0}; });
  with("raw10, OSR 256 at 1308 Hz", [](Case &c) {
    c.pad = "raw10";
    c.sensing = {256, 1308.0};
  });
  with("200 Hz", [](Case &c) { c.sensing.rate_Hz = 200.0; });
  with("100 Hz", [](Case &c) { c.sensing.rate_Hz = 100.0; });
  with("20 Hz", [](Case &c) { c.sensing.rate_Hz = 20.0; });
  with("9 mm", [](Case &c) { c.layer_mm = 9.0; });
  with("15 mm", [](Case &c) { c.layer_mm = 15.0; });
  with("dead travel 2 mm", [](Case &c) { c.dead_travel_mm = 2.0; });
  with("dead travel 0.2 mm", [](Case &c) { c.dead_travel_mm = 0.2; });
  with("friction that does not fall", [](Case &c) { c.kinetic_share = 1.0; });
  with("lifts of 0.45 at a friction of 0.5", [](Case &c) { c.lift_tangential = "0.45"; });
  with("lifts of 0.1 to 0.25 at a friction of 0.3", [](Case &c) {
    c.lift_tangential = "0.1..0.25";
    c.lift_friction = "0.3";
  });
  return all;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) {
    return std::nan("");
  }
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

ordered_json rounded(double value) {
  return std::isnan(value) ? ordered_json(nullptr) : ordered_json(std::round(10.0 * value) / 10.0);
}

twin::Scenario scenario_of(const Case &c, const std::string &kind, const Object &object, std::uint64_t seed,
                           std::size_t acts) {
  constexpr double LONGEST_LIFT_s = 6.5, LONGEST_SLIDE_s = 14.0;
  twin::ScenarioOptions options;
  options.kind = kind;
  options.indenter = object.indenter;
  options.layer_mm = c.layer_mm;
  options.seed = seed;
  options.forces = c.forces;
  options.dead_travel_mm = c.dead_travel_mm;
  options.seconds = twin::START_QUIET_s + static_cast<double>(acts) * LONGEST_LIFT_s;
  if (kind == "lift") {
    options.tangential = c.lift_tangential;
    options.friction = c.lift_friction;
  } else {
    options.kinetic_share = c.kinetic_share;
    options.seconds = twin::START_QUIET_s + static_cast<double>(acts) * LONGEST_SLIDE_s;
  }
  twin::Scenario scenario = twin::make_scenario(twin::complete(options), object.table());
  if (scenario.acts.size() < acts) {
    throw std::runtime_error("a scenario is too short for its acts");
  }
  scenario.acts.resize(acts);
  return scenario;
}

// What became of the acts of one kind on all objects of a case.
std::vector<Judged> play(const Case &c, const std::string &kind, const Pads &pads, const Options &options,
                         std::size_t acts) {
  std::vector<Judged> all;
  for (std::size_t o = 0; o < c.objects.size(); o++) {
    const std::size_t share = acts / c.objects.size() + (o < acts % c.objects.size() ? 1 : 0);
    if (share == 0) {
      continue;
    }
    const Object object(c.objects[o], c.layer_mm, options.cache);
    const std::uint64_t seed = options.seed + 100 * o;
    const twin::Scenario scenario = scenario_of(c, kind, object, seed, share);
    std::vector<Judged> judged(share);
    twin::in_parallel(share, [&](std::size_t i) {
      Player player(object, pads.pad(c.pad, share * o + i), c.sensing, seed);
      judged[i] = judge(player, scenario.acts[i], i);
    });
    all.insert(all.end(), judged.begin(), judged.end());
  }
  return all;
}

struct Duration {
  const char *name;
  double seconds;
};
constexpr Duration DURATIONS[] = {{"100ms", 0.1}, {"300ms", 0.3}, {"1s", 1.0}};
// A slip that is one to the user, and one that the velocity's threshold leaves out.
constexpr double WAY_MIN_mm = 0.5, FAST_mm_s = 8.0;

void judge_lifts(const std::vector<Judged> &lifts, ordered_json &out) {
  for (const Duration &duration : DURATIONS) {
    std::size_t played = 0;
    std::array<std::size_t, DETECTORS> falsely{};
    for (const Judged &lift : lifts) {
      if (std::abs(lift.lift_s - duration.seconds) < 1e-3) {
        played++;
        for (std::size_t d = 0; d < DETECTORS; d++) {
          falsely[d] += lift.falsely[d] ? 1 : 0;
        }
      }
    }
    out[std::string("lifts_") + duration.name] = played;
    for (std::size_t d = 0; d < DETECTORS; d++) {
      out[std::string(DETECTOR_NAMES[d]) + "_false_" + duration.name] = falsely[d];
    }
  }
}

void judge_slides(const std::vector<Judged> &slides, ordered_json &out) {
  for (const bool fast : {true, false}) {
    const std::string which = fast ? "" : "slow_";
    std::size_t slips = 0;
    for (const Judged &act : slides) {
      for (const Judged::Found &found : act.slips) {
        slips += found.slip.way_mm >= WAY_MIN_mm && (found.slip.speed_mm_s >= FAST_mm_s) == fast;
      }
    }
    out[which + "slips"] = slips;
    for (std::size_t d = 0; d < DETECTORS; d++) {
      std::vector<double> latency_ms, since_shown_ms, lasts_ms;
      int gaps = 0;
      for (const Judged &act : slides) {
        for (const Judged::Found &found : act.slips) {
          if (found.slip.way_mm < WAY_MIN_mm || (found.slip.speed_mm_s >= FAST_mm_s) != fast || !found.latency_s[d]) {
            continue;
          }
          latency_ms.push_back(1e3 * *found.latency_s[d]);
          since_shown_ms.push_back(latency_ms.back() - 1e3 * (found.slip.shows_s - found.slip.begin_s));
          lasts_ms.push_back(1e3 * found.lasts_s[d]);
          gaps += found.gaps[d];
        }
      }
      const std::string name = DETECTOR_NAMES[d] + std::string("_") + which;
      out[name + "found_percent"] = rounded(
          slips > 0 ? 100.0 * static_cast<double>(latency_ms.size()) / static_cast<double>(slips) : std::nan(""));
      out[name + "latency_p50_ms"] = rounded(quantile(latency_ms, 0.5));
      out[name + "latency_p95_ms"] = rounded(quantile(latency_ms, 0.95));
      out[name + "since_shown_p95_ms"] = rounded(quantile(since_shown_ms, 0.95));
      out[name + "lasts_p95_ms"] = rounded(quantile(lasts_ms, 0.95));
      out[name + "gaps"] = gaps;
    }
  }
  for (std::size_t d = 0; d < DETECTORS; d++) {
    std::size_t falsely = 0;
    for (const Judged &act : slides) {
      falsely += act.falsely[d] ? 1 : 0;
    }
    out[std::string(DETECTOR_NAMES[d]) + "_false_in_slides"] = falsely;
  }
}

// What came of each frame of one act.
ordered_json series_of(const Case &c, const std::string &kind, std::size_t act, const Pads &pads,
                       const Options &options) {
  const Object object(c.objects.front(), c.layer_mm, options.cache);
  const twin::Scenario scenario = scenario_of(c, kind, object, options.seed, act + 1);
  Player player(object, pads.pad(c.pad, act), c.sensing, options.seed);
  Watch watch;
  ordered_json series;
  for (const Slip &slip : slips_of(scenario.acts[act])) {
    series["slips_s"].push_back({slip.begin_s, slip.end_s});
  }
  player.play(scenario.acts[act], act, [&](const Felt &felt) {
    const Said said = watch.look(felt);
    if (!felt.tangential.valid) {
      return;
    }
    const auto add = [&](const char *name, double value) { series[name].push_back(std::round(1e4 * value) / 1e4); };
    add("t_s", 1e-6 * static_cast<double>(felt.t_us));
    add("true_x_mm", felt.truth.x_mm);
    add("true_y_mm", felt.truth.y_mm);
    add("x_mm", static_cast<double>(felt.tangential.x_mm));
    add("y_mm", static_cast<double>(felt.tangential.y_mm));
    add("gaussian_x_mm", static_cast<double>(felt.fit.x_mm));
    add("gaussian_y_mm", static_cast<double>(felt.fit.y_mm));
    add("true_force_N", felt.truth.force_N);
    add("true_qx_N", felt.truth.pull_x_N);
    add("true_qy_N", felt.truth.pull_y_N);
    add("force_N", static_cast<double>(felt.tangential.force_N));
    add("qx_N", static_cast<double>(felt.tangential.qx_N));
    add("qy_N", static_cast<double>(felt.tangential.qy_N));
    add("velocity_x_mm_s", static_cast<double>(said.velocity_x_mm_s));
    add("velocity_y_mm_s", static_cast<double>(said.velocity_y_mm_s));
    for (std::size_t d = 0; d < DETECTORS; d++) {
      series[DETECTOR_NAMES[d]].push_back(said.flags[d] ? 1 : 0);
    }
  });
  return series;
}

ordered_json measure(const Options &options) {
  constexpr std::size_t CALIBRATIONS = 40;
  constexpr std::size_t SERIES_ACT = 1; // of lifts one of 0.3 s, of slides one too heavy
  if (options.pads == 0) {
    throw std::runtime_error("--pads needs at least one pad");
  }
  const Pads pads(CALIBRATIONS, options.seed, options.cache);
  ordered_json out;
  out["motion_seed"] = options.seed;
  out["motion_pads"] = options.pads;
  const std::vector<Case> all = cases();
  for (const Case &c : all) {
    ordered_json row;
    row["case"] = c.name;
    judge_lifts(play(c, "lift", pads, options, 3 * options.pads), row);
    judge_slides(play(c, "slide", pads, options, options.pads), row);
    if (out.count("motion_cases") == 0) {
      for (const Duration &duration : DURATIONS) {
        out[std::string("lift_false_slides_") + duration.name] = row[std::string("sliding_false_") + duration.name];
      }
      out["slide_found_percent"] = row["sliding_found_percent"];
      out["slide_latency_p50_ms"] = row["sliding_latency_p50_ms"];
      out["slide_latency_p95_ms"] = row["sliding_latency_p95_ms"];
      out["slide_since_shown_p95_ms"] = row["sliding_since_shown_p95_ms"];
    }
    out["motion_cases"].push_back(row);
    if (options.usual) {
      break;
    }
  }
  out["motion_series"]["lift"] = series_of(all.front(), "lift", SERIES_ACT, pads, options);
  out["motion_series"]["slide"] = series_of(all.front(), "slide", SERIES_ACT, pads, options);
  return out;
}

} // namespace

int main(int argc, char **argv) {
  Options options;
  return reference::print_found("shear_motion", argc, argv,
                                {{"--cache", &options.cache},
                                 {"--seed", nullptr, &options.seed},
                                 {"--pads", nullptr, &options.pads},
                                 {"--usual", nullptr, nullptr, &options.usual}},
                                HELP, [&] { return measure(options); });
}
