#include "library/pad/thickness.hpp"
#include "shear/static/tables.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <nlohmann/json.hpp>

namespace fingertip::shear {

using nlohmann::ordered_json;
using namespace std::string_literals;

namespace {

const std::vector<std::string> SMALL{"sphere6", "sphere15", "cylinder6"};

// Where the errors of the usual case lie.
void judge_places(const Results &usual, ordered_json &out) {
  constexpr double CELL_mm = 3.0;
  for (const char *place : {"inner", "border", "corner"}) {
    const auto here = [=](const Judged &j) { return place == std::string(place_of(j.truth)); };
    out["by_place"].push_back(usual.where(here).row(place));
    for (std::size_t o = 0; o < SEVEN.size(); o++) {
      const Results some = usual.where([=](const Judged &j) { return here(j) && j.object == o; });
      ordered_json row = some.row(SEVEN[o] + ", " + place);
      const Results valid = some.where([](const Judged &j) { return j.said.valid; });
      row["off_by_0_05_percent"] = valid.share([](const Judged &j) { return j.vector_error() > 0.05; });
      row["off_by_5_deg_percent"] = valid.share([](const Judged &j) { return j.direction_error_deg() > 5.0; });
      out["where_misses_lie"].push_back(row);
    }
  }
  const Results rounder =
      usual.where([](const Judged &j) { return SEVEN[j.object] != "lime" && place_of(j.truth) != "corner"s; });
  const ordered_json row = rounder.row("without the lime and the corners");
  for (const char *key : {"ratio_error_p95", "vector_error_p95", "direction_p90_deg"}) {
    out["no_lime_no_corner_" + std::string(key)] = row[key];
  }
  for (double force_N = 1.0; force_N < 10.0; force_N *= 2.0) {
    const double to_N = force_N < 8.0 ? 2.0 * force_N : 10.0;
    const Results some =
        usual.where([=](const Judged &j) { return j.truth.force_N >= force_N && j.truth.force_N < to_N; });
    out["by_force"].push_back(
        some.row(std::to_string(static_cast<int>(force_N)) + " to " + std::to_string(static_cast<int>(to_N)) + " N"));
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
      out["map"].push_back({{"x_mm", x_mm + 0.5 * CELL_mm},
                            {"y_mm", y_mm + 0.5 * CELL_mm},
                            {"touches", cell.all().size()},
                            {"vector_error_p50", vector_error(0.5)},
                            {"vector_error_p95", vector_error(0.95)}});
    }
  }
}

} // namespace

// Pads by how much is known of their gains, loads from none to sliding.
void judge_pads(Bench &bench, ordered_json &out) {
  struct Kind {
    const char *name;
    const PadOf &pad;
  };
  const Kind kinds[] = {{"equal gains", bench.equal},
                        {"10 %, calibrated", bench.calibrated},
                        {"5 %, not calibrated", bench.raw5},
                        {"10 %, not calibrated", bench.raw10}};
  for (const Kind &kind : kinds) {
    for (const Load &load : LOADS) {
      Case c = bench.usual();
      c.pad = kind.pad;
      c.share = load.share;
      c.history = load.history;
      const Results results = bench.run("pads", c);
      ordered_json row = results.row(std::string(kind.name) + ", Q/F " + load.name);
      row["pad"] = kind.name;
      row["load"] = load.share;
      out["by_pad_and_load"].push_back(row);
      const bool equal = kind.name == kinds[0].name, calibrated = kind.name == kinds[1].name;
      const bool loaded = load.share == SHARE && load.history == History::held;
      if ((equal || calibrated) && loaded) {
        const std::string prefix = equal ? "equal_" : "";
        for (const char *key :
             {"ratio_error_p50", "ratio_error_p95", "vector_error_p50", "vector_error_p95", "direction_p90_deg"}) {
          out[prefix + key] = row[key];
        }
        out[equal ? "equal_location_loaded_mm" : "location_loaded_median_mm"] = row["location_p50_mm"];
        out[prefix + "location_loaded_without_mm"] = row["location_without_p50_mm"];
      }
      if (calibrated && loaded) {
        for (const char *key : {"valid_percent", "q_cover_1sd", "q_cover_2sd", "location_cover_1sd",
                                "location_cover_2sd", "force_p50_percent", "force_without_p50_percent"}) {
          out[key] = row[key];
        }
        judge_places(results, out);
      }
      if (kind.name == kinds[3].name && load.share == 0.0) {
        out["raw_beyond_2sd_percent"] = results.beyond_percent(2.0);
      }
      if (calibrated && load.share == 0.0) {
        out["location_unloaded_mm"] = row["location_p50_mm"];
        out["location_unloaded_without_mm"] = row["location_without_p50_mm"];
        out["location_price_mm"] = row["location_p50_mm"].get<double>() - row["location_without_p50_mm"].get<double>();
      }
      if (calibrated && (loaded || load.share == 0.0)) {
        ordered_json &curve = out["location_quantiles"];
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
  bench.progress("pads and loads");
}

void judge_thickness(Bench &bench, ordered_json &out) {
  const std::vector<double> layers_mm =
      bench.options.few ? std::vector<double>{LAYER_mm} : std::vector<double>{5.0, 6.0, 9.0, LAYER_mm, 15.0, 20.0};
  for (const double layer_mm : layers_mm) {
    const PadOf pads = bench.calibrated_on(layer_mm);
    for (const double told : {1.0, 1.1, 0.9}) {
      const double told_mm = told * layer_mm;
      if (told_mm < static_cast<double>(PAD_THICKNESS_MIN_mm) || told_mm > static_cast<double>(PAD_THICKNESS_MAX_mm)) {
        continue;
      }
      const pad_profile profile = profile_of(told_mm);
      Case c = bench.usual();
      c.objects = bench.on(layer_mm, SMALL);
      c.pad = pads;
      c.fewer = 0.1;
      char name[64];
      std::snprintf(name, sizeof name, "%g mm, told %g mm", layer_mm, told_mm);
      for (const double share : {0.0, SHARE}) {
        c.share = share;
        ordered_json row =
            bench.run("thickness", c, &profile).row(std::string(name) + (share > 0.0 ? ", Q/F 0.3" : ", Q/F 0"));
        row["layer_mm"] = layer_mm;
        row["told_mm"] = told_mm;
        row["load"] = share;
        out["by_thickness"].push_back(row);
      }
    }
  }
  bench.progress("thicknesses");
}

// The profile that follows from a calibration's width, and a thickness that is set 15 % wrong.
void judge_learned(Bench &bench, ordered_json &out) {
  constexpr std::size_t SESSIONS = 20;
  constexpr double WRONG = 0.15;
  const truth::Feet feet(LAYER_mm, bench.options.cache);
  const truth::PadOptions kinds[] = {{10.0, 0.0, 0.0}, {10.0, 17.5, 0.1}};
  std::vector<Judged> judged;
  double wrong_said = 0.0, right_said = 0.0;
  std::vector<double> off_percent;
  for (std::size_t i = 0; i < SESSIONS; i++) {
    const std::uint64_t seed = Random(bench.options.seed, truth::stream_of("learned thickness"), i).next();
    truth::SessionPad pad(kinds[i % std::size(kinds)], LAYER_mm, seed);
    truth::Session session(feet, truth::SessionKind::good, seed, 24);
    std::vector<calibrating::Placement> placements;
    while (auto placement = session.next(pad)) {
      placements.push_back(std::move(*placement));
    }
    const auto solution = calibrating::solve(truth::session_array(), placements);
    const pad::Thickness found = pad::thickness_of(solution.sigma_mm, solution.sigma_sd_mm);
    off_percent.push_back(100.0 * std::abs(found.mm / LAYER_mm - 1.0));
    right_said += !found.agrees_with(LAYER_mm);
    wrong_said += !found.agrees_with((1.0 - WRONG) * LAYER_mm);
    wrong_said += !found.agrees_with((1.0 + WRONG) * LAYER_mm);
    const pad_profile told = profile_of(found.shown_mm());
    Case c = bench.usual();
    c.fewer = 1.0 / SESSIONS;
    const Results results = bench.run("learned " + std::to_string(i), c, &told);
    judged.insert(judged.end(), results.all().begin(), results.all().end());
  }
  const ordered_json row = Results(std::move(judged)).row("12 mm, learned, Q/F 0.3");
  out["learned"].push_back(row);
  for (const char *key : {"valid_percent", "ratio_error_p50", "ratio_error_p95"}) {
    out[std::string("learned_") + key] = row[key];
  }
  out["learned_thickness_off_p95_percent"] = truth::quantile(off_percent, 0.95);
  out["told_wrong_said_percent"] = truth::percent(wrong_said, 2.0 * SESSIONS);
  out["told_right_said_percent"] = truth::percent(right_said, 1.0 * SESSIONS);
  bench.progress("learned thickness");
}

} // namespace fingertip::shear
