// real_fit: what the firmware's fit and the tool's calibration make of readings that were recorded
// elsewhere. One JSON object on stdin, one on stdout.
//
//   {"x_mm": [sensor], "y_mm": [sensor], "pitch_mm": p, "jobs": [job]}  ->  {"results": [result]}
//
//   job {"kind": "fit", "presses": [[reading_Pa of each sensor, null: missing]], "noise_Pa",
//        "gain": [sensor], "gain_sd": [sensor], "prior_sigma_mm", "prior_width_mm", "dip_share",
//        "dip_sd_mm"}
//     -> {"x_mm", "y_mm", "sigma_mm", "force_N", "location_sd_mm", "flags": [press each]}, 0 without a fit
//   job {"kind": "calibrate", "presses": as above, "noise_Pa", "every_s": from one to the next}
//     -> {"state": "good" | "more" | "refused", "reason", "solved", "width_mm", "residual_share",
//         "stored": {"gain", "gain_sd", "prior_sigma_mm", "prior_width_mm", "dip_share",
//         "dip_sd_mm"}}; stored: what the tool would leave in the fingertip were it good
//
// Exit status: 0 done; 1 something went wrong, said in one line.
#include "tool/calibration/judge.hpp"

extern "C" {
#include "config/defaults.h"
#include "fit/fit.h"
}

#include <cmath>
#include <cstdio>
#include <exception>
#include <iostream>
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

json fit(const Array &layout, const json &job) {
  std::vector<float> x(layout.x_mm.begin(), layout.x_mm.end());
  std::vector<float> y(layout.y_mm.begin(), layout.y_mm.end());
  fit_array array;
  if (fit_array_init(&array, static_cast<std::uint8_t>(layout.sensors()), x.data(), y.data(),
                     static_cast<float>(layout.pitch_mm)) != FT_OK) {
    throw std::runtime_error("the fit takes no such layout");
  }
  fit_settings settings{};
  settings.iterations = DEFAULT_FIT_ITERATIONS;
  settings.noise_Pa_q10 = static_cast<std::int32_t>(1024.0 * job.at("noise_Pa").get<double>());
  fit_set_errors(&settings, 0.0f, DEFAULT_MODEL_SD);
  settings.prior_sigma_mm = static_cast<float>(job.at("prior_sigma_mm").get<double>());
  settings.prior_width_mm = static_cast<float>(job.at("prior_width_mm").get<double>());
  settings.cut_noises = DEFAULT_CUT_NOISES;
  settings.dip_share = static_cast<float>(job.at("dip_share").get<double>());
  settings.dip_sd_mm = static_cast<float>(job.at("dip_sd_mm").get<double>());
  const auto gain = job.at("gain").get<std::vector<double>>();
  const auto gain_sd = job.at("gain_sd").get<std::vector<double>>();
  for (std::size_t k = 0; k < layout.sensors(); k++) {
    settings.gain_sd_q16[k] = static_cast<std::uint16_t>(std::lround(65536.0 * gain_sd.at(k)));
  }
  std::vector<float> x_mm, y_mm, sigma_mm, force_N, location_sd_mm;
  std::vector<std::uint32_t> flags;
  for (const json &press : job.at("presses")) {
    std::int32_t pressure[FT_MAX_SENSORS] = {};
    for (std::size_t k = 0; k < layout.sensors(); k++) {
      if (!press.at(k).is_null()) {
        pressure[k] =
            static_cast<std::int32_t>(std::lround(1024.0 * press[k].get<double>() / gain.at(k)));
      }
    }
    fit_result result;
    fit_gaussian(&array, pressure, usable_of(press), &settings, &result);
    x_mm.push_back(result.x_mm);
    y_mm.push_back(result.y_mm);
    sigma_mm.push_back(result.sigma_mm);
    force_N.push_back(result.force_N);
    location_sd_mm.push_back(result.location_sd_mm);
    flags.push_back(result.flags);
  }
  return {{"x_mm", x_mm},       {"y_mm", y_mm},
          {"sigma_mm", sigma_mm}, {"force_N", force_N},
          {"location_sd_mm", location_sd_mm}, {"flags", flags}};
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
  stored["gain_sd"] = solution.gain_sd;
  const Shape shape = shape_of(solution);
  stored["prior_sigma_mm"] = shape.sigma_mm;
  stored["prior_width_mm"] = shape.sigma_sd_mm;
  stored["dip_share"] = shape.dip_share;
  stored["dip_sd_mm"] = shape.dip_sd_mm;
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
      results.push_back(job.at("kind") == "fit" ? fit(layout, job) : calibrate(layout, job));
    }
    std::cout << json{{"results", results}} << '\n';
    return 0;
  } catch (const std::exception &error) {
    std::fprintf(stderr, "real_fit: %s\n", error.what());
    return 1;
  }
}
