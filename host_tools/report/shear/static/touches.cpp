#include "libfingertip/in_parallel.hpp"
#include "shear/static/bounds.hpp"
#include "shear/static/tables.hpp"
#include "simulation/twin/scenarios.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace fingertip::shear {

using nlohmann::ordered_json;

namespace {

// Every lying cylinder of the twin, a shorter one, and an edge.
const std::vector<std::string> LONG{"cylinder6x12", "edge20", "ball_bearing", "cylinder12", "cylinder18", "cylinder24"};

} // namespace

void judge_objects(Bench &bench, ordered_json &out) {
  std::vector<std::string> names;
  for (const twin::Indenter &one : twin::indenters()) {
    names.push_back(one.name);
  }
  names.insert(names.end(), {"cube15", "cylinder6x12", "edge20"});
  double price_mm = -HUGE_VAL;
  for (const std::string &name : names) {
    for (const double share : {0.0, SHARE}) {
      Case c = bench.usual();
      c.objects = bench.on(LAYER_mm, {name});
      c.share = share;
      c.fewer = 0.1;
      ordered_json row = bench.run("objects", c).row(name + (share > 0.0 ? ", Q/F 0.3" : ", Q/F 0"));
      row["object"] = name;
      row["load"] = share;
      out["by_object"].push_back(row);
      const double with_mm = row["location_p50_mm"], without_mm = row["location_without_p50_mm"];
      price_mm = share > 0.0 ? price_mm : std::max(price_mm, with_mm - without_mm);
    }
  }
  out["location_price_worst_mm"] = price_mm;
  bench.progress("objects");
}

void judge_elongated(Bench &bench, ordered_json &out) {
  Case c = bench.usual();
  c.objects = bench.on(LAYER_mm, LONG);
  c.share = 0.0;
  const Results results = bench.run("elongated", c);
  out["elongated_false_percent"] = results.claimed_percent();
  out["elongated_false_surely_percent"] = results.claimed_surely_percent();
  out["elongated_false_unflagged_percent"] = results.claimed_unflagged_percent();
  out["elongated_valid_percent"] = results.valid_percent();
  for (std::size_t o = 0; o < LONG.size(); o++) {
    out["elongated"].push_back(
        results.where([=](const Judged &j) { return j.object == o; }).row(LONG[o] + ", any angle"));
  }
  constexpr int BINS = 6;
  for (int bin = 0; bin < BINS; bin++) {
    const Results some = results.where([=](const Judged &j) {
      const double half_turns = j.truth.angle_rad / M_PI;
      return static_cast<int>(BINS * (half_turns - std::floor(half_turns))) == bin;
    });
    const int from = 180 / BINS * bin;
    out["elongated"].push_back(
        some.row("any of them, " + std::to_string(from) + " to " + std::to_string(from + 180 / BINS) + " degrees"));
  }
  bench.progress("elongated objects");
}

// Light touches, oversampling, sensors missing, places beyond the array.
void judge_limits(Bench &bench, ordered_json &out) {
  struct Light {
    const char *name;
    double least_N, most_N;
  };
  for (const Light &light :
       {Light{"0.1 to 0.2 N", 0.1, 0.2}, Light{"0.2 to 0.5 N", 0.2, 0.5}, Light{"0.5 to 1 N", 0.5, 1.0}}) {
    for (const double share : {0.0, SHARE}) {
      Case c = bench.usual();
      c.share = share;
      c.force_min_N = light.least_N;
      c.force_max_N = light.most_N;
      c.fewer = 0.2;
      out["light_touches"].push_back(
          bench.run("light", c).row(std::string(light.name) + (share > 0.0 ? ", Q/F 0.3" : ", Q/F 0")));
    }
  }
  for (std::uint16_t osr = 256; osr <= 8192; osr = static_cast<std::uint16_t>(2 * osr)) {
    Case c = bench.usual();
    c.osr = osr;
    c.fewer = 0.2;
    ordered_json row = bench.run("osr", c).row("OSR " + std::to_string(osr));
    row["noise_Pa"] = noise_Pa(osr);
    out["by_osr"].push_back(row);
  }
  for (const std::size_t sensors : {15u, 14u, 13u, 12u, 10u, 8u}) {
    Case c = bench.usual();
    c.sensors = sensors;
    c.fewer = 0.2;
    out["by_sensors"].push_back(bench.run("sensors", c).row(std::to_string(sensors) + " sensors"));
  }
  Case c = bench.usual();
  c.beyond_mm = 4.5;
  c.fewer = 0.2;
  out["by_place"].push_back(bench.run("beyond", c).row("up to 4.5 mm outside the array"));
  bench.progress("light touches, OSR, missing sensors");
}

// What errors of these covariances would be found as.
void judge_bounds(Bench &bench, ordered_json &out) {
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
  const Case c = bench.usual();
  const fit_array array = truth::firmware_array();
  const std::size_t touches = std::min(TOUCHES_MAX, bench.units(c) * TOUCHES);
  for (const Limit &limit : limits) {
    std::vector<Judged> judged(touches);
    twin::in_parallel(touches, [&](std::size_t i) {
      Random random(bench.options.seed, truth::stream_of("bounds"), i);
      const KnownPad pad = c.pad(i);
      Judged &j = judged[i];
      j.truth = bench.draw(c, array, random);
      const Errors errors{noise_Pa(c.osr), limit.gains ? &pad.pad.gain_sd : nullptr, limit.model_share};
      const Bound bound = bound_of(array, bench.profile, j.truth, errors, limit.told);
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
    for (const char *key : {"case", "touches", "ratio_error_p50", "ratio_error_p95", "vector_error_p50",
                            "vector_error_p95", "direction_p90_deg", "location_p50_mm", "location_p95_mm"}) {
      bound[key] = row[key];
    }
    out["bounds"].push_back(bound);
  }
  bench.progress("bounds");
}

} // namespace fingertip::shear
