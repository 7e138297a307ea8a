#include "grasp/summary.hpp"

#include "grasp/figures.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace fingertip::grasp {

using namespace cell;
using nlohmann::ordered_json;

namespace {

ordered_json summary(const std::vector<const Done *> &all, bool still) {
  std::size_t drops = 0, never = 0, unanswered = 0, cycles = 0, unsettled = 0;
  std::vector<double> margin, reported, taken, reaction_ms, later_ms, slid_mm, disturbed_mm, peak_N, holding_s,
      settle_s, rms, rms_of_steps;
  for (const Done *one : all) {
    const Outcome &o = one->outcome;
    drops += o.dropped ? 1 : 0;
    never += o.never_held ? 1 : 0;
    peak_N.push_back(o.peak_N);
    if (still) {
      cycles += o.reversals >= 4 ? 1 : 0;
      unsettled += o.settle_s ? 0 : 1;
      settle_s.push_back(o.settle_s.value_or(std::numeric_limits<double>::infinity()));
      if (o.settle_s) {
        rms.push_back(100.0 * o.rms);
        rms_of_steps.push_back(100.0 * o.rms_of_steps);
      }
      continue;
    }
    holding_s.push_back(o.holding_s);
    for (const Slip &slip : o.slips) {
      unanswered += slip.reaction_s ? 0 : 1;
      const double ms = 1e3 * slip.reaction_s.value_or(std::numeric_limits<double>::infinity());
      reaction_ms.push_back(ms);
      if (slip.begin_s > one->scene.lift_s) {
        later_ms.push_back(ms);
      }
    }
    if (o.held) {
      margin.push_back(o.margin);
      reported.push_back(o.force_reported);
      taken.push_back(o.force_taken);
      slid_mm.push_back(o.slid_mm);
      if (!one->scene.disturbances.empty()) {
        disturbed_mm.push_back(o.disturbance_slip_mm);
      }
    }
  }
  ordered_json out;
  out["grasps"] = all.size();
  out["peak_p50_N"] = quantile(peak_N, 0.5);
  out["peak_p95_N"] = quantile(peak_N, 0.95);
  if (still) {
    out["settle_p50_s"] = quantile(settle_s, 0.5);
    out["settle_p95_s"] = quantile(settle_s, 0.95);
    out["never_settled_percent"] = percent(double(unsettled), double(all.size()));
    out["rms_p50_percent"] = quantile(rms, 0.5);
    out["rms_of_steps_p50_percent"] = quantile(rms_of_steps, 0.5);
    out["limit_cycles"] = cycles;
    return out;
  }
  out["drops_percent"] = percent(double(drops + never), double(all.size()));
  out["never_held"] = never;
  out["margin_p50"] = quantile(margin, 0.5);
  out["margin_p5"] = quantile(margin, 0.05);
  out["margin_p95"] = quantile(margin, 0.95);
  out["force_told_p50"] = quantile(reported, 0.5);
  out["force_taken_p50"] = quantile(taken, 0.5);
  out["slips"] = reaction_ms.size();
  out["unanswered"] = unanswered;
  out["reaction_p50_ms"] = quantile(reaction_ms, 0.5);
  out["reaction_p95_ms"] = quantile(reaction_ms, 0.95);
  out["slips_after_lift"] = later_ms.size();
  out["reaction_after_lift_p50_ms"] = quantile(later_ms, 0.5);
  out["slid_p50_mm"] = quantile(slid_mm, 0.5);
  out["slid_p95_mm"] = quantile(slid_mm, 0.95);
  out["disturbance_slip_p95_mm"] = quantile(disturbed_mm, 0.95);
  out["holding_p50_s"] = quantile(holding_s, 0.5);
  return out;
}

std::string friction_band(double friction) {
  const int tenth = std::min(static_cast<int>((friction - 0.25) / 0.15), 4);
  char text[32];
  std::snprintf(text, sizeof text, "%.2f to %.2f", 0.25 + 0.15 * tenth, 0.4 + 0.15 * tenth);
  return text;
}

std::string mass_band(double mass_kg) {
  return mass_kg < 0.2 ? "0.1 to 0.2 kg" : mass_kg < 0.45 ? "0.2 to 0.45 kg" : "0.45 to 1 kg";
}

std::string set_band(double set_N) { return set_N < 4.0 ? "below 4 N" : set_N < 8.0 ? "4 to 8 N" : "8 N and more"; }

ordered_json by(const std::vector<Done> &done, bool still,
                const std::function<std::vector<std::string>(const Done &)> &names) {
  std::map<std::string, std::vector<const Done *>> groups;
  for (const Done &one : done) {
    for (const std::string &name : names(one)) {
      groups[name].push_back(&one);
    }
  }
  ordered_json out;
  for (const auto &[name, group] : groups) {
    out[name] = summary(group, still);
  }
  return out;
}

} // namespace

ordered_json summary_of(const std::vector<Done> &done, bool still) {
  std::vector<const Done *> all;
  for (const Done &one : done) {
    all.push_back(&one);
  }
  ordered_json out = summary(all, still);
  out["by_object"] = by(done, still, [](const Done &one) { return std::vector<std::string>{one.scene.face}; });
  if (still) {
    out["by_set"] = by(done, still, [](const Done &one) { return std::vector<std::string>{set_band(one.set_N)}; });
  } else {
    out["by_friction"] = by(done, still, [](const Done &one) {
      return std::vector<std::string>{friction_band(one.scene.object.friction)};
    });
    out["by_mass"] =
        by(done, still, [](const Done &one) { return std::vector<std::string>{mass_band(one.scene.object.mass_kg)}; });
    out["by_disturbance"] = by(done, still, [](const Done &one) {
      std::vector<std::string> names;
      for (const Disturbance &disturbance : one.scene.disturbances) {
        if (std::find(names.begin(), names.end(), name_of(disturbance.kind)) == names.end()) {
          names.emplace_back(name_of(disturbance.kind));
        }
      }
      if (names.empty()) {
        names.emplace_back("none");
      }
      return names;
    });
  }
  return out;
}

ordered_json line_of(std::uint64_t n, const Done &one) {
  const Outcome &o = one.outcome;
  ordered_json line;
  line["n"] = n;
  line["face"] = one.scene.face;
  line["mass_kg"] = rounded(one.scene.object.mass_kg);
  line["friction"] = rounded(one.scene.object.friction);
  line["lift_s"] = rounded(one.scene.lift_s);
  line["disturbances"] = ordered_json::array();
  for (const Disturbance &disturbance : one.scene.disturbances) {
    line["disturbances"].push_back(name_of(disturbance.kind));
  }
  line["dropped"] = o.dropped;
  line["never_held"] = o.never_held;
  line["margin"] = rounded(o.margin);
  line["slid_mm"] = rounded(o.slid_mm);
  line["lift_slip_mm"] = rounded(o.lift_slip_mm);
  line["disturbance_slip_mm"] = rounded(o.disturbance_slip_mm);
  line["turned_deg"] = rounded(o.turned_rad * 180.0 / M_PI);
  line["peak_N"] = rounded(o.peak_N);
  line["slips"] = ordered_json::array();
  for (const Slip &slip : o.slips) {
    line["slips"].push_back(
        {{"begin_s", rounded(slip.begin_s)},
         {"way_mm", rounded(slip.way_mm)},
         {"reaction_ms", slip.reaction_s ? ordered_json(rounded(1e3 * *slip.reaction_s)) : ordered_json(nullptr)}});
  }
  line["settle_s"] = o.settle_s ? ordered_json(rounded(*o.settle_s)) : ordered_json(nullptr);
  line["rms_percent"] = rounded(100.0 * o.rms);
  line["reversals"] = o.reversals;
  line["trouble"] = o.trouble;
  return line;
}

ordered_json trace_of(const Set &set, std::uint64_t n) {
  ordered_json series;
  const auto add = [&](const char *name, double value) { series[name].push_back(rounded(value)); };
  const Outcome outcome = set.run(n, [&](const Moment &m) {
    add("t_s", m.t_s);
    add("lift_s", m.lift_s);
    add("width_mm", m.width_mm);
    add("force_N", m.force_N);
    add("least_N", m.least_N);
    add("load_N", m.load_N);
    add("way_mm", m.way_mm);
    add("slid_mm", m.slid_mm);
    add("turned_rad", m.turned_rad);
    add("friction", m.friction);
    add("slips", m.slips ? 1.0 : 0.0);
    add("felt_N", m.sensed_N);
    add("felt_load_N", m.sensed_load_N);
    add("wanted_N", m.wanted_N);
    add("state", m.state);
    add("trouble", m.trouble);
  });
  const Trial trial = set.trial(n);
  ordered_json out = line_of(n, {trial.scene, trial.set_N, outcome});
  out["series"] = series;
  return out;
}

} // namespace fingertip::grasp
