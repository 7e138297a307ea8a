// What entry points with a fit have in common.
//
// settings: [1 or press]. deviations: of each sensor, [1 or press][sensor], or none at all, [0][sensor].
#pragma once

#include "tool/arrays/entry.hpp"

extern "C" {
#include "fit/fit.h"
}

namespace fingertip::measure {

inline fit_settings settings_of(const Batch<const fit_settings, 1> &settings, const Batch<const fit_deviation, 2> &deviations,
                                std::size_t press) {
  fit_settings chosen = *settings.row_or_all(press);
  chosen.deviations = deviations.size() ? deviations.row_or_all(press) : nullptr;
  return chosen;
}

inline const fit_array &checked(const Batch<const fit_array, 1> &array, std::size_t sensors,
                                const Batch<const fit_deviation, 2> &deviations) {
  require(array.size() == 1 && array[0].sensor_count == sensors, "readings of another number of sensors");
  require(deviations.size() == 0 || deviations.size(1) == sensors, "deviations of another number of sensors");
  return array[0];
}

} // namespace fingertip::measure
