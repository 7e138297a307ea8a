/* fingertip calibrate: gains of the sensors, and the scale of the force, from placements of one
 * weight, or the scale of the tangential force from pulls of one, live or in a recording, and into
 * the fingertip. */
#pragma once

#include "libfingertip/connection.hpp"
#include "tool/cli/terminal.hpp"

#include <optional>
#include <string>

namespace fingertip {

struct CalibrateOptions {
  Choice choice;
  std::optional<double> force_N; /* of the weight, where it is known; pulls must have it */
  bool drag = false;             /* pulls along the rubber instead of placements */
  std::string from;              /* a recording; empty: live */
  bool dry_run = false;          /* of a recording, write nothing */
  bool yes = false;              /* ask nothing */
  bool show = false, erase = false;
  bool placements = false; /* of another program */
  ColourMode colour = ColourMode::automatic;
};

/* Exit status. Throws Error: also where what was recorded does not make a calibration, with the
 * reason, and where the user ends it; then the fingertip is as it was. */
int run_calibrate(const CalibrateOptions &options);
/* Of these the one with --drag: the scale of the tangential force. */
int calibrate_drag(const CalibrateOptions &options);

/* fingertip calibrate --placements, for programs that find placements themselves, as the package's
 * `validate` does. Reads JSON from standard input:
 *   x_mm, y_mm      [sensor]     pitch_mm     force_N of the weight
 *   placements      of each t_s, reading_Pa [sensor], usable (numbers of the sensors whose reading is
 *                   a measurement), noise_Pa, fading (calibration/solver.hpp)
 * Prints the solution as JSON; without "solved" the placements are too few. Throws Error. */
int calibrate_placements();

} // namespace fingertip
