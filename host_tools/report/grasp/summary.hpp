// What became of a set of grasps, as JSON.
#pragma once

#include "grasp/trials.hpp"

#include <nlohmann/json_fwd.hpp>

namespace fingertip::grasp {

// Of all, then by object; if they were still, by the set force, else by friction, mass and
// disturbance. null: nothing to take a quantile of, or it is never.
nlohmann::ordered_json summary_of(const std::vector<Done> &done, bool still);
nlohmann::ordered_json line_of(std::uint64_t n, const Done &one);
// With all that is known of it over time.
nlohmann::ordered_json trace_of(const Set &set, std::uint64_t n);

} // namespace fingertip::grasp
