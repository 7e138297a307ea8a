/* What a validation consists of: an empty minute, presses of one weight at marked places, a hold, a
 * rest, and pulls if the user wants them. The marks are those of the printed template (sheet.hpp).
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
 *   # event: validate: pull toward_deg=90 weight_g=100 height_mm=2    before each pull
 *   # event: validate: end
 */
#pragma once

#include "tool/calibration/solver.hpp"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace fingertip::validating {

constexpr double EMPTY_s = 60.0; /* nothing touches the pad */
constexpr double HOLD_s = 30.0;  /* the weight stands in the middle */
constexpr double REST_s = 30.0;  /* after it was lifted */
constexpr double RATE_Hz = 50.0; /* of frames meanwhile: enough, and the recording stays small */
constexpr std::size_t TURNS = 2; /* presses at each mark, all around, and again */

/* The weight stands in the middle of the pad. A thread at its foot runs level over a pulley, and
 * another weight hangs on it: once along each of the ways. (A tilted pad would need no thread. But
 * a weight on a slope presses below its centre of mass, millimetres beside its foot, so where the
 * contact is would not be known.) */
struct Pulling {
  double weight_g = 0.0;  /* that hangs on the thread; 0: no pulls */
  double height_mm = 2.0; /* of the thread above the rubber */
};
constexpr std::array<double, 4> PULLS_TOWARD_deg = {0.0, 90.0, 180.0, 270.0}; /* from +x to +y */
/* Of the weight that stands: less hardly shows, more may slide. */
constexpr double PULL_SHARE_MIN = 0.15, PULL_SHARE_MAX = 0.5;

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
  enum class Kind { begin, empty, press, take_back, hold, rest, pull, end } kind;
  std::size_t mark = 0; /* press: from 0; the template and the event count from 1 */
  Mark at{0.0, 0.0};
  double weight_g = 0.0, skin_mm = 0.0; /* begin: the weight, the rubber as it was cast */
  double toward_deg = 0.0;              /* pull: its way */
  Pulling pulling = {};                 /* pull */
};

/* As the event's text, and back; none: another event. */
std::string event_of(const Step &step);
std::optional<Step> step_of(const std::string &event);

/* All of them, in order. */
std::vector<Step> steps_of(const std::vector<Mark> &marks, double weight_g, double skin_mm,
                           const Pulling &pulling = {});

/* "+x" of 0 degrees. */
std::string way_of(double toward_deg);

} // namespace fingertip::validating
