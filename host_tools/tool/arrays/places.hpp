// Sensors of any layout, as an info packet has them.
#pragma once

#include "libfingertip/wire.hpp"
#include "tool/arrays/entry.hpp"

#include <algorithm>

namespace fingertip::measure {

template <class Real> wire_info places_of(Batch<const Real, 1> x_mm, Batch<const Real, 1> y_mm, double pitch_mm) {
  same_length(x_mm, y_mm);
  require(x_mm.size() <= FT_MAX_SENSORS, "too many sensors");
  wire_info places{};
  places.sensor_count = static_cast<std::uint8_t>(x_mm.size());
  places.pitch_mm = static_cast<float>(pitch_mm);
  std::copy_n(x_mm.data, x_mm.size(), places.x_mm);
  std::copy_n(y_mm.data, y_mm.size(), places.y_mm);
  return places;
}

} // namespace fingertip::measure
