// `fingertip simulate --press`: a weight on a ball is set down evenly all over each fingertip, to look at, to record and to calibrate from.
// With --mouse a hand presses instead (hand_server.hpp): the ball goes where the hand is, within some 30 ms, without friction.
//
// The pad: 12 mm of silicone without ends, which remembers as the twin's does (memory, aftereffect; twin/effects.hpp).
// Sensors' gains differ by 10 %, and are not calibrated.
#pragma once

#include "simulation/cell/place.hpp"
#include "simulation/cell/validated.hpp"

namespace fingertip::cell {

struct PressOptions : SimulationOptions {
  std::size_t fingertips = 1; // 1 or 2
  bool by_hand = false;
  double weight_g = 300.0;
};

constexpr const char *PRESS_FACE = "sphere15"; // a ball of 15 mm, as calibrate asks for

// Instead, a hand that goes through the steps of `fingertip validate` (validated.hpp) whenever a
// program sets the fingertip's frame rate, as validate does first.
void validate(const ValidatedOptions &options, std::optional<double> seconds, const Place &place);

// Until a signal comes, or its time is over. Throws Error.
void press(const PressOptions &options, const Place &place);

} // namespace fingertip::cell
