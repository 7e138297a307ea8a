#pragma once

namespace fingertip {

/* fingertip calibrate --placements, for programs that find placements themselves, as the package's
 * `validate` does. Reads JSON from standard input:
 *   x_mm, y_mm      [sensor]     pitch_mm     force_N of the weight
 *   placements      of each t_s, reading_Pa [sensor], usable (numbers of the sensors whose reading is
 *                   a measurement), noise_Pa, fading (calibration/solver.hpp)
 * Prints the solution as JSON; without "solved" the placements are too few. Throws Error. */
int calibrate_placements();

} // namespace fingertip
