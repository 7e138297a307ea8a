// A set force by eq. (5) and (6) of De Clercq et al., RA-L 2022 (CONTROL.md).
#pragma once

#include "grasp/control/reach.hpp"

#include <cstdint>

namespace fingertip {

class GripFixed {
public:
  std::uint32_t step(const GripReadings &readings, const GripSettings &settings, const GripperTraits &traits, double now_s,
                     GripReach &reach);

private:
  bool runs_ = false;
  double stepped_s_ = 0.0, error_N_ = 0.0, integral_N_s_ = 0.0;
};

} // namespace fingertip
