// The tables of shear_static, each by one function that draws touches and writes what the firmware
// said of them.
#pragma once

#include "shear/static/bench.hpp"

#include <nlohmann/json_fwd.hpp>

namespace fingertip::shear {

void judge_pads(Bench &bench, nlohmann::ordered_json &out);
void judge_objects(Bench &bench, nlohmann::ordered_json &out);
void judge_elongated(Bench &bench, nlohmann::ordered_json &out);
void judge_limits(Bench &bench, nlohmann::ordered_json &out);
void judge_thickness(Bench &bench, nlohmann::ordered_json &out);
void judge_learned(Bench &bench, nlohmann::ordered_json &out);
void judge_cast(Bench &bench, nlohmann::ordered_json &out);
void judge_bounds(Bench &bench, nlohmann::ordered_json &out);
void judge_rubber(Bench &bench, nlohmann::ordered_json &out);
void judge_screws(Bench &bench, nlohmann::ordered_json &out);
void judge_taps(Bench &bench, nlohmann::ordered_json &out);
void judge_overhang(Bench &bench, nlohmann::ordered_json &out);
void draw_arrows(Bench &bench, nlohmann::ordered_json &out);

} // namespace fingertip::shear
