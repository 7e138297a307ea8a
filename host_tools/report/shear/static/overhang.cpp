#include "libfingertip/in_parallel.hpp"
#include "library/pad/edges.hpp"
#include "library/pad/profile.hpp"
#include "shear/static/tables.hpp"
#include "simulation/twin/scenarios.hpp"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace fingertip::shear {

using nlohmann::ordered_json;
using namespace std::string_literals;

namespace {

struct Ended {
  Results zero, loaded, increment;
};

Ended touch_twice(const Bench &bench, const Case &c, const pad_profile &profile) {
  constexpr double FIRST_MIN_N = 0.5, FIRST_MAX_N = 2.0;
  std::vector<Judged> zero(bench.units(c) * TOUCHES), loaded(zero.size()), increment(zero.size());
  twin::in_parallel(bench.units(c), [&](std::size_t unit) {
    Random random(bench.options.seed, truth::stream_of("overhang"), unit);
    Fingertip fingertip(profile);
    const KnownPad pad = c.pad(unit / UNITS_PER_PAD);
    for (std::size_t t = 0; t < TOUCHES; t++) {
      const std::size_t at = unit * TOUCHES + t;
      const twin::Touch full = bench.draw(c, fingertip.array(), random);
      const Object &object = *c.objects[random.next() % c.objects.size()];
      twin::Touch unloaded = full;
      unloaded.pull_x_N = unloaded.pull_y_N = 0.0;
      unloaded.stuck_N = full.force_N;
      twin::Touch first = unloaded;
      first.force_N = first.stuck_N = random.uniform(FIRST_MIN_N, FIRST_MAX_N);
      const auto feel = [&](const twin::Touch &touch) {
        Judged j{touch, 0, {}};
        fingertip.feel(base_Pa(fingertip.array(), object, touch, c.block, pad.cast), pad, noise_Pa(c.osr), ALL_SENSORS,
                       random, j.said);
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

} // namespace

// Pads that end, by the fingertip's profile: the thickness alone, or the effect of the ends on the
// estimate as well (pad/edges.hpp). The zero is what is read without a load; the increment what is
// read with it, less what the same touch reads at its beginning.
void judge_overhang(Bench &bench, ordered_json &out) {
  double worst_zero = 0.0;
  for (const double overhang_mm : {13.0, 9.0, 6.0, 4.5}) {
    const twin::BlockTable block = twin::BlockTable::load_or_build(
        twin::block_around(twin::silicone(LAYER_mm), overhang_mm), twin::sensor_places(), bench.options.cache);
    pad_profile told = bench.profile;
    told.overhang_mm = static_cast<float>(overhang_mm);
    told.edges = pad::edges_of(told, pad::own_sensors(), bench.options.cache);
    char mm[16];
    std::snprintf(mm, sizeof mm, "_%gmm", overhang_mm);
    for (const bool knows_ends : {false, true}) {
      Case c = bench.usual();
      c.block = &block;
      c.fewer = 0.2;
      const Ended ended = touch_twice(bench, c, knows_ends ? told : bench.profile);
      for (const char *place : {"anywhere", "inner", "border", "corner"}) {
        const auto here = [=](const Judged &j) {
          return place == "anywhere"s || place == std::string(place_of(j.truth));
        };
        const Results zero = ended.zero.where(here), loaded = ended.loaded.where(here);
        const Results increment = ended.increment.where(here);
        const auto vector = [](const Judged &j) { return j.vector_error(); };
        const auto located = [](const Judged &j) { return j.location_error_mm(); };
        const auto gaussian = [](const Judged &j) { return j.gaussian_location_error_mm(); };
        out["by_overhang"].push_back({{"overhang_mm", overhang_mm},
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
      const ordered_json anywhere = out["by_overhang"][out["by_overhang"].size() - 4];
      const std::string told_ends = knows_ends ? "_own_tables" : "";
      out["zero_error_p50" + told_ends + mm] = anywhere["zero_error_p50"];
      out["increment_error_p50" + told_ends + mm] = anywhere["increment_error_p50"];
      if (knows_ends && overhang_mm >= 9.0) {
        worst_zero = std::max(worst_zero, anywhere["zero_error_p50"].get<double>());
      }
    }
  }
  out["zero_error_p50_own_tables"] = worst_zero;
  bench.progress("pads that end");
}

} // namespace fingertip::shear
