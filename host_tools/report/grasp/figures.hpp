// Figures of many grasps as JSON: rounded to a thousandth, null where there are none.
#pragma once

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

namespace fingertip::grasp {

inline double rounded(double value) { return std::round(1e3 * value) / 1e3; }

inline nlohmann::ordered_json quantile(std::vector<double> values, double share) {
  if (values.empty()) {
    return nullptr;
  }
  std::sort(values.begin(), values.end());
  const double value = values[static_cast<std::size_t>(share * (double(values.size()) - 1.0))];
  return std::isfinite(value) ? nlohmann::ordered_json(rounded(value)) : nlohmann::ordered_json(nullptr);
}

inline nlohmann::ordered_json percent(double part, double whole) {
  return whole > 0.0 ? nlohmann::ordered_json(rounded(100.0 * part / whole)) : nlohmann::ordered_json(nullptr);
}

} // namespace fingertip::grasp
