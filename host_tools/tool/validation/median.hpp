#pragma once

#include <algorithm>
#include <vector>

namespace fingertip::validating {

/* Of an even number the upper one; 0 of none. */
inline double upper_median(std::vector<double> values) {
  if (values.empty()) {
    return 0.0;
  }
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

} // namespace fingertip::validating
