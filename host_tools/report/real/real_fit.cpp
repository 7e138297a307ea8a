// real_fit: what the firmware's fit and the tool's calibration make of readings that were recorded
// elsewhere. One JSON object on stdin, one on stdout.
//
//   {"x_mm": [sensor], "y_mm": [sensor], "pitch_mm": p, "jobs": [job]}  ->  {"results": [result]}
//
//   job {"kind": "fit", "presses": [[reading_Pa of each sensor, null: missing]], "noise_Pa",
//        "gain": [sensor], "gain_sd": [sensor], "prior_sigma_mm", "prior_width_mm", "dip_share",
//        "dip_sd_mm", "own": [[off_x_mm, off_y_mm, wider] of each sensor, or none], "iterations" and "cut_noises", by
//        default as the firmware is built}
//     -> {"x_mm", "y_mm", "sigma_mm", "force_N", "location_sd_mm", "flags": [press each]}, 0 without a fit
//   job {"kind": "pace", "fits": [jobs of the kind fit], "passes": n}
//     -> {"us": [job]}, of one press, in the quickest of n passes in which the jobs take turns
//   job {"kind": "calibrate", "presses": as above, "noise_Pa", "every_s": from one to the next}
//     -> {"state": "good" | "more" | "refused", "reason", "solved", "width_mm", "residual_share",
//         "stored": {"gain", "gain_sd", "prior_sigma_mm", "prior_width_mm", "dip_share",
//         "dip_sd_mm", "own"}}; stored: what the tool would leave in the fingertip were it good
//
// Exit status: 0 done; 1 something went wrong, said in one line.
#include "tool/calibration/judge.hpp"

extern "C" {
#include "config/defaults.h"
#include "fit/fit_doubt.h"
}

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace {

using nlohmann::json;
using namespace fingertip::calibrating;

std::uint32_t usable_of(const json &press) {
  std::uint32_t usable = 0;
  for (std::size_t k = 0; k < press.size(); k++) {
    usable |= press[k].is_null() ? 0u : 1u << k;
  }
  return usable;
}

std::uint8_t or_built(const json &job, const char *setting, int built) {
  return static_cast<std::uint8_t>(job.contains(setting) ? job.at(setting).get<int>() : built);
}

struct Prepared {
  fit_array array;
  fit_settings settings;
  std::vector<fit_own> own;                                              /* that of the settings */
  std::vector<std::array<std::int32_t, FT_MAX_SENSORS>> pressure_Pa_q10; /* [press] */
  std::vector<std::uint32_t> usable;                                     /* [press] */
};

Prepared prepare(const Array &layout, const json &job) {
  std::vector<float> x(layout.x_mm.begin(), layout.x_mm.end());
  std::vector<float> y(layout.y_mm.begin(), layout.y_mm.end());
  Prepared made{};
  if (fit_array_init(&made.array, static_cast<std::uint8_t>(layout.sensors()), x.data(), y.data(),
                     static_cast<float>(layout.pitch_mm)) != FT_OK) {
    throw std::runtime_error("the fit takes no such layout");
  }
  fit_settings &settings = made.settings;
  settings.iterations = or_built(job, "iterations", DEFAULT_FIT_ITERATIONS);
  settings.noise_Pa_q10 = static_cast<std::int32_t>(1024.0 * job.at("noise_Pa").get<double>());
  fit_set_errors(&settings, 0.0f, DEFAULT_MODEL_SD);
  settings.prior_sigma_mm = static_cast<float>(job.at("prior_sigma_mm").get<double>());
  settings.prior_width_mm = static_cast<float>(job.at("prior_width_mm").get<double>());
  settings.cut_noises = or_built(job, "cut_noises", DEFAULT_CUT_NOISES);
  settings.dip_share = static_cast<float>(job.at("dip_share").get<double>());
  settings.dip_sd_mm = static_cast<float>(job.at("dip_sd_mm").get<double>());
  Shape shape;
  for (const json &own : job.at("own")) {
    shape.own.push_back({own.at(0).get<double>(), own.at(1).get<double>(), own.at(2).get<double>()});
  }
  made.own = own_of(layout, shape);
  settings.own = made.own.empty() ? nullptr : made.own.data();
  const auto gain = job.at("gain").get<std::vector<double>>();
  const auto gain_sd = job.at("gain_sd").get<std::vector<double>>();
  for (std::size_t k = 0; k < layout.sensors(); k++) {
    settings.gain_sd_q16[k] = static_cast<std::uint16_t>(std::lround(65536.0 * gain_sd.at(k)));
  }
  for (const json &press : job.at("presses")) {
    auto &pressure = made.pressure_Pa_q10.emplace_back();
    for (std::size_t k = 0; k < layout.sensors(); k++) {
      if (!press.at(k).is_null()) {
        pressure[k] = static_cast<std::int32_t>(std::lround(1024.0 * press[k].get<double>() / gain.at(k)));
      }
    }
    made.usable.push_back(usable_of(press));
  }
  return made;
}

fit_result fit_press(const Prepared &prepared, std::size_t press) {
  fit_result result;
  fit_gaussian(&prepared.array, prepared.pressure_Pa_q10[press].data(), prepared.usable[press], &prepared.settings,
               &result);
  return result;
}

json fit(const Array &layout, const json &job) {
  const Prepared prepared = prepare(layout, job);
  std::vector<float> x_mm, y_mm, sigma_mm, force_N, location_sd_mm;
  std::vector<std::uint32_t> flags;
  for (std::size_t press = 0; press < prepared.usable.size(); press++) {
    fit_result result = fit_press(prepared, press);
    fit_doubt load{};
    for (int frame = 0; frame < FIT_DOUBT_PARTS; frame++) { // of a press that is held
      fit_doubt_follow(&load, &prepared.array, prepared.pressure_Pa_q10[press].data(), &prepared.settings, &result);
    }
    fit_doubt_widen(&load, &prepared.array, &prepared.settings, &result);
    x_mm.push_back(result.x_mm);
    y_mm.push_back(result.y_mm);
    sigma_mm.push_back(result.sigma_mm);
    force_N.push_back(result.force_N);
    location_sd_mm.push_back(result.location_sd_mm);
    flags.push_back(result.flags);
  }
  return {
      {"x_mm", x_mm},  {"y_mm", y_mm}, {"sigma_mm", sigma_mm}, {"force_N", force_N}, {"location_sd_mm", location_sd_mm},
      {"flags", flags}};
}

json pace(const Array &layout, const json &job) {
  using clock = std::chrono::steady_clock;
  std::vector<Prepared> fits;
  for (const json &each : job.at("fits")) {
    fits.push_back(prepare(layout, each));
  }
  std::vector<double> us(fits.size(), std::numeric_limits<double>::infinity());
  for (int pass = job.at("passes").get<int>(); pass > 0; pass--) {
    for (std::size_t i = 0; i < fits.size(); i++) {
      const auto begun = clock::now();
      for (std::size_t press = 0; press < fits[i].usable.size(); press++) {
        [[maybe_unused]] const volatile float done = fit_press(fits[i], press).x_mm;
      }
      const std::chrono::duration<double, std::micro> took = clock::now() - begun;
      us[i] = std::min(us[i], took.count() / double(fits[i].usable.size()));
    }
  }
  return {{"us", us}};
}

json calibrate(const Array &layout, const json &job) {
  std::vector<Placement> placements;
  for (const json &press : job.at("presses")) {
    Placement placement;
    placement.t_s = job.at("every_s").get<double>() * double(placements.size());
    placement.noise_Pa = job.at("noise_Pa").get<double>();
    placement.usable = usable_of(press);
    for (const json &reading : press) {
      placement.reading_Pa.push_back(reading.is_null() ? 0.0 : reading.get<double>());
    }
    placements.push_back(std::move(placement));
  }
  const Judgement judgement = judge(layout, placements, true);
  const Solution &solution = judgement.solution;
  const char *const states[] = {"more", "good", "refused"};
  json stored, said;
  stored["gain"] = solution.gain;
  stored["gain_sd"] = solution.reading_sd;
  const Shape shape = shape_of(solution);
  stored["prior_sigma_mm"] = shape.sigma_mm;
  stored["prior_width_mm"] = shape.sigma_sd_mm;
  stored["dip_share"] = shape.dip_share;
  stored["dip_sd_mm"] = shape.dip_sd_mm;
  stored["own"] = json::array();
  for (const Own &own : shape.own) {
    stored["own"].push_back({own.off_x_mm, own.off_y_mm, own.wider});
  }
  said["state"] = states[static_cast<int>(judgement.state)];
  said["reason"] = name_of(judgement.reason);
  said["solved"] = solution.solved;
  said["width_mm"] = solution.sigma_mm;
  said["residual_share"] = solution.residual_share;
  said["stored"] = stored;
  return said;
}

} // namespace

int main() {
  try {
    const json asked = json::parse(std::cin);
    Array layout;
    layout.pitch_mm = asked.at("pitch_mm").get<double>();
    layout.x_mm = asked.at("x_mm").get<std::vector<double>>();
    layout.y_mm = asked.at("y_mm").get<std::vector<double>>();
    json results = json::array();
    for (const json &job : asked.at("jobs")) {
      const auto kind = job.at("kind").get<std::string>();
      results.push_back(kind == "fit" ? fit(layout, job) : kind == "pace" ? pace(layout, job) : calibrate(layout, job));
    }
    std::cout << json{{"results", results}} << '\n';
    return 0;
  } catch (const std::exception &error) {
    std::fprintf(stderr, "real_fit: %s\n", error.what());
    return 1;
  }
}
