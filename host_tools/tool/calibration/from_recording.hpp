/* Placements of a weight, from a recording that has the pressures: what `fingertip calibrate --from`
 * calibrates from. */
#pragma once

#include "tool/calibration/gain_session.hpp"

#include <functional>
#include <string>

namespace fingertip::calibrating {

struct Recorded {
  wire_info info; /* of the fingertip that was recorded */
  GainSession session;
};

/* The whole recording, judged. device: which fingertip of several, or empty. on_placement: may be
 * empty; it gets the session after each placement. Throws Error where the file cannot be read, or
 * holds no pressures. */
Recorded session_from(const std::string &path, const std::string &device,
                      const std::function<void(const GainSession &)> &on_placement);

/* Throws Error with the judgement's reason. */
void refuse_unless_good(const Judgement &judgement);

} // namespace fingertip::calibrating
