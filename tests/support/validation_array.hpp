// Fifteen sensors, 9 mm apart, three across and five along.
#pragma once

#include "tool/calibration/solver.hpp"

namespace fingertip::validating {

inline calibrating::Array validation_array() {
  calibrating::Array array;
  array.pitch_mm = 9.0;
  for (int column = -1; column <= 1; column++) {
    for (int row = -2; row <= 2; row++) {
      array.x_mm.push_back(9.0 * column);
      array.y_mm.push_back(9.0 * row);
    }
  }
  return array;
}

} // namespace fingertip::validating
