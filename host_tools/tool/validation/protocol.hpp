/* What a validation consists of: an empty minute, presses of one weight at marked places, a hold, a
 * rest. The marks are those of the printed template (sheet.hpp).
 *
 * A recording of it is a usual recording of one fingertip. The steps stand in it as events, so that
 * the card can be made from the recording alone:
 *
 *   # event: validate: begin weight_g=300 skin_mm=12
 *   # event: validate: empty
 *   # event: validate: press mark=1 x_mm=-9 y_mm=18        before each press
 *   # event: validate: take_back                           the last press does not count
 *   # event: validate: hold
 *   # event: validate: rest
 *   # event: validate: end
 */
#pragma once

#include "tool/calibration/solver.hpp"

#include <optional>
#include <string>
#include <vector>

namespace fingertip::validating {

constexpr double EMPTY_s = 60.0; /* nothing touches the pad */
constexpr double HOLD_s = 30.0;  /* the weight stands in the middle */
constexpr double REST_s = 30.0;  /* after it was lifted */
constexpr double RATE_Hz = 50.0; /* of frames meanwhile: enough, and the recording stays small */
constexpr std::size_t TURNS = 2; /* presses at each mark, all around, and again */

struct Mark {
  double x_mm, y_mm; /* in the axes of the board, which the template's own may miss a little */
};

/* On each sensor, and in the middle of each cell of four; 23 on the grid of three by five. So each
 * sensor, at a corner too, has presses in which it reads most, and presses from which its
 * neighbours say what it should read. In an order in which each mark is far from the one before, so
 * that the rubber there is at rest. Those on the outer sensors lie one overhang from the rubber's
 * end. */
std::vector<Mark> marks_of(const calibrating::Array &array);

struct Step {
  enum class Kind { begin, empty, press, take_back, hold, rest, end } kind;
  std::size_t mark = 0; /* press: from 0; the template and the event count from 1 */
  Mark at{0.0, 0.0};
  double weight_g = 0.0, skin_mm = 0.0; /* begin: the weight, the rubber as it was cast */
};

/* As the event's text, and back; none: another event. */
std::string event_of(const Step &step);
std::optional<Step> step_of(const std::string &event);

/* All of them, in order. */
std::vector<Step> steps_of(const std::vector<Mark> &marks, double weight_g, double skin_mm);

} // namespace fingertip::validating
