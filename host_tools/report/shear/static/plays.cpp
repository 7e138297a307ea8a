#include "libfingertip/in_parallel.hpp"
#include "shear/static/tables.hpp"
#include "simulation/twin/effects.hpp"
#include "simulation/twin/scenarios.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <nlohmann/json.hpp>

namespace fingertip::shear {

using nlohmann::ordered_json;

// The rubber's own time: a press, a load that comes and goes, read at some moments. Gains are
// equal, or, where rubber relaxes, also those that placements read from 0.5 to 1 s after find.
void judge_rubber(Bench &bench, ordered_json &out) {
  struct Moment {
    const char *name;
    double t_s;
  };
  const Moment moments[] = {{"0.6 s after the touch, no load yet", 0.9},
                            {"0.2 s after the load", 1.5},
                            {"1.7 s after the load", 3.0},
                            {"10 s after the load", 11.2},
                            {"0.2 s after the load has gone", 11.8}};
  constexpr double PRESS_END_s = 0.3, LOAD_s = 1.0, LOAD_END_s = 1.3, UNLOAD_s = 11.3, UNLOAD_END_s = 11.6,
                   STEP_s = 0.03;
  const auto rises = [](double t_s, double from_s, double to_s) {
    return std::clamp((t_s - from_s) / (to_s - from_s), 0.0, 1.0);
  };
  struct Rubber {
    const char *effects;
    bool calibrated;
  };
  const Case c = bench.usual();
  const std::size_t touches = std::max<std::size_t>(20, bench.options.pads);
  for (const Rubber &kind :
       {Rubber{"none", false}, Rubber{"relaxation", false}, Rubber{"relaxation", true}, Rubber{"hysteresis", false},
        Rubber{"aftereffect", false}, Rubber{"relaxation,hysteresis,aftereffect", true}}) {
    const twin::EffectValues values = twin::parse_effects(kind.effects);
    std::vector<std::array<Judged, std::size(moments)>> judged(touches);
    twin::in_parallel(touches, [&](std::size_t i) {
      Random random(bench.options.seed, truth::stream_of("rubber"), i);
      Fingertip fingertip(bench.profile);
      KnownPad pad{truth::perfect_pad(), {}};
      const twin::Touch full = bench.draw(c, fingertip.array(), random);
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
      out["by_rubber"].push_back(row);
    }
  }
  bench.progress("creep and relaxation");
}

// A torque alone: what is read while the object spins, and what that is more than before.
void judge_screws(Bench &bench, ordered_json &out) {
  const double seconds = std::max(60.0, static_cast<double>(bench.options.pads));
  for (const char *name : {"sphere15", "sphere6", "cylinder6", "ping_pong", "lime", "cube12"}) {
    const Object &object = bench.objects.on(LAYER_mm, name);
    twin::ScenarioOptions scenario;
    scenario.kind = "screw";
    scenario.indenter = name;
    scenario.seconds = seconds;
    scenario.seed = bench.options.seed;
    const twin::Scenario screws = twin::make_scenario(scenario, object.pressure);
    std::vector<double> read, change;
    Fingertip fingertip(bench.profile);
    Random random(bench.options.seed, truth::stream_of("screws"), 0);
    for (std::size_t a = 0; a < screws.acts.size(); a++) {
      const twin::Act &act = screws.acts[a];
      const KnownPad pad = bench.calibrated(a);
      Said before{};
      for (const twin::Phase &phase : act.phases) {
        if (phase.name != "hold" && phase.name != "spin") {
          continue;
        }
        const twin::Touch now = act.tracks[0].at(0.5 * (phase.begin_s + phase.end_s) - act.begin_s);
        Said said{};
        fingertip.feel(base_Pa(fingertip.array(), object, now, nullptr, pad.cast), pad, noise_Pa(1024), ALL_SENSORS,
                       random, said);
        if (phase.name == "hold") {
          before = said;
        } else if (said.valid && before.valid) {
          read.push_back(std::hypot(said.qx, said.qy));
          change.push_back(std::hypot(said.qx - before.qx, said.qy - before.qy));
        }
      }
    }
    out["screws"].push_back({{"object", name},
                             {"screws", screws.acts.size()},
                             {"spins_with_an_estimate", read.size()},
                             {"read_p50", truth::quantile(read, 0.5)},
                             {"read_p95", truth::quantile(read, 0.95)},
                             {"change_p50", truth::quantile(change, 0.5)},
                             {"change_p95", truth::quantile(change, 0.95)}});
  }
  const ordered_json usual = out["screws"][0];
  out["screw_ratio"] = usual["read_p50"];
  out["screw_change_p95"] = usual["change_p95"];
  bench.progress("screws");
}

// The taps of the paper's table II, as the twin plays them, read at 20 Hz from 1 N on.
void judge_taps(Bench &bench, ordered_json &out) {
  constexpr double RATE_Hz = 20.0, LEAST_N = 1.0;
  constexpr std::size_t PADS = 8;
  const double seconds = std::clamp(static_cast<double>(bench.options.pads), 40.0, 600.0) / PADS;
  const char *const names[] = {"sphere6", "sphere15", "cylinder6", "cube6"};
  struct Kind {
    const char *name;
    const PadOf &pad;
  };
  for (const Kind &kind : {Kind{"equal gains", bench.equal}, Kind{"10 %, calibrated", bench.calibrated},
                           Kind{"10 %, not calibrated", bench.raw10}}) {
    for (const double share : {0.0, 0.1, 0.3}) {
      std::vector<std::vector<Judged>> found(std::size(names) * PADS);
      for (std::size_t i = 0; i < found.size(); i++) {
        const Object &object = bench.objects.on(LAYER_mm, names[i / PADS]);
        twin::ScenarioOptions scenario;
        scenario.kind = "taps";
        scenario.indenter = object.name;
        scenario.seconds = std::max(40.0, seconds);
        scenario.margin_mm = 0.0;
        scenario.seed = bench.options.seed + i % PADS;
        if (share > 0.0) {
          scenario.tangential = std::to_string(share);
        }
        const twin::Scenario taps = twin::make_scenario(scenario, object.pressure);
        Fingertip fingertip(bench.profile);
        Random random(bench.options.seed, truth::stream_of("taps"), i);
        const KnownPad pad = kind.pad(i % PADS);
        for (const twin::Act &act : taps.acts) {
          for (double t_s = 0.0; t_s < act.end_s - act.begin_s; t_s += 1.0 / RATE_Hz) {
            Judged j{act.tracks[0].at(t_s), i / PADS, {}};
            if (j.truth.force_N >= LEAST_N &&
                fingertip.feel(base_Pa(fingertip.array(), object, j.truth, nullptr, pad.cast), pad, noise_Pa(1024),
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
      scaled([](const Judged &j) { return j.said.gaussian_force_N; }, "force_scaled_without_p50_percent", row);
      out["taps"].push_back(row);
    }
  }
  bench.progress("taps of table II");
}

} // namespace fingertip::shear
