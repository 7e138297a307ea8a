/* What the pulls of a validation say: how much of the pull the fingertip finds, and in which
 * direction; what the pull does to its location and its force.
 *
 * The pull that is found is the change from the rest before it, over the force that the fingertip
 * reports then. The pull of the thread is its weight over the weight that stands, if the pulley has
 * no friction. A thread h above the rubber tilts the weight by its moment, so the contact's centre
 * moves by h times the pull's share of the force: the card corrects the location for that. It does
 * not correct for some tenths of a millimetre by which the object itself moves as the rubber shears.
 */
#pragma once

#include "tool/validation/gather.hpp"

#include <string>
#include <vector>

namespace fingertip::validating {

struct Figure {
  std::string key, says, unit;
  double value;
  int digits;
};

/* Why this fingertip estimates no pull, and what to do: a sentence; empty: it does. */
std::string why_no_pull(const wire_info &info);

struct PullFigures {
  std::vector<Figure> figures; /* none: there is no pull */
  std::string note;            /* what cannot be said, and what to do: a sentence, or empty */
};
/* The figures of a fingertip that estimates no pull have keys of their own: pull_blind_... */
PullFigures pull_figures(const Measured &measured);

} // namespace fingertip::validating
