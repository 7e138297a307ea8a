// What tables of touches are made of.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace fingertip::truth {

// Of none, 0.
inline double percent(double part, double whole) {
  return whole > 0.0 ? 100.0 * part / whole : 0.0;
}

inline double quantile(std::vector<double> values, double share) {
  if (values.empty()) {
    return 0.0;
  }
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

} // namespace fingertip::truth
