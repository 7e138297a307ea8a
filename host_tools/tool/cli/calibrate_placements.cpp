#include "tool/cli/calibrate_placements.hpp"

#include "libfingertip/error.hpp"
#include "library/pad/profile.hpp"
#include "library/pad/thickness.hpp"
#include "tool/calibration/judge.hpp"

extern "C" {
#include "common/limits.h"
}

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>

namespace fingertip {
namespace {

using calibrating::Placement;

struct Asked {
  calibrating::Array array;
  double force_N = 0.0;
  std::vector<Placement> placements;
};

Asked asked_of(const nlohmann::json &text) {
  Asked asked;
  asked.array = {text.at("pitch_mm"), text.at("x_mm"), text.at("y_mm")};
  asked.force_N = text.at("force_N");
  const std::size_t sensors = asked.array.sensors();
  for (const nlohmann::json &each : text.at("placements")) {
    Placement placement;
    placement.t_s = each.at("t_s");
    placement.reading_Pa = each.at("reading_Pa").get<std::vector<double>>();
    placement.noise_Pa = each.at("noise_Pa");
    placement.fading = each.at("fading");
    for (std::size_t k : each.at("usable")) {
      placement.usable |= k < sensors ? std::uint32_t{1} << k : 0u;
    }
    if (placement.reading_Pa.size() != sensors) {
      throw Error("a placement has " + std::to_string(placement.reading_Pa.size()) + " readings, and there are " +
                  std::to_string(sensors) + " sensors");
    }
    asked.placements.push_back(std::move(placement));
  }
  if (sensors < 1 || sensors > FT_MAX_SENSORS || asked.array.y_mm.size() != sensors) {
    throw Error("x_mm and y_mm do not have one value for each of 1 to " + std::to_string(FT_MAX_SENSORS) + " sensors");
  }
  return asked;
}

double force_ratio_of(const calibrating::Array &array, double thickness_mm) {
  wire_info info{};
  info.sensor_count = static_cast<std::uint8_t>(array.sensors());
  info.pitch_mm = static_cast<float>(array.pitch_mm);
  std::copy(array.x_mm.begin(), array.x_mm.end(), info.x_mm);
  std::copy(array.y_mm.begin(), array.y_mm.end(), info.y_mm);
  const double layer_mm = std::clamp(thickness_mm, double(PAD_THICKNESS_MIN_mm), double(PAD_THICKNESS_MAX_mm));
  return static_cast<double>(pad::profile_of({layer_mm}, info).force_ratio);
}

nlohmann::json found_in(const Asked &asked) {
  const calibrating::Judgement judgement = calibrating::judge(asked.array, asked.placements, true);
  const calibrating::Solution &solution = judgement.solution;
  nlohmann::json found = {{"judgement", judgement.text}, {"solved", solution.solved}};
  if (!solution.solved) {
    return found;
  }
  const pad::Thickness thickness = pad::thickness_of(solution.sigma_mm, solution.sigma_sd_mm);
  found["gain"] = solution.gain;
  found["gain_sd"] = solution.gain_sd;
  found["peak_Pa"] = solution.peak_Pa;
  found["width_mm"] = solution.width_mm;
  found["mixing"] = solution.mixing;
  found["dip"] = solution.dip;
  found["dip_share"] = solution.dip_share;
  found["dip_sd_mm"] = solution.dip_sd_mm;
  found["sigma_mm"] = solution.sigma_mm;
  found["thickness_mm"] = thickness.mm;
  found["thickness_sd_mm"] = thickness.sd_mm;
  if (const auto scale = calibrating::force_scale(asked.array, asked.placements, solution, asked.force_N,
                                                  calibrating::shape_of(solution))) {
    found["force_scale"] = scale->scale;
    found["force_ratio"] = force_ratio_of(asked.array, thickness.mm);
  }
  return found;
}

} // namespace

int calibrate_placements() {
  try {
    std::printf("%s\n", found_in(asked_of(nlohmann::json::parse(stdin))).dump().c_str());
  } catch (const nlohmann::json::exception &error) {
    throw Error("standard input: no placements (" + std::string(error.what()) + ")");
  }
  return 0;
}

} // namespace fingertip
