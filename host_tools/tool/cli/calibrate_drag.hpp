/* fingertip calibrate --drag: the scale of the tangential force from pulls of one known force. */
#pragma once

#include "tool/cli/calibrate.hpp"

namespace fingertip {

/* Calibrates the scale of tangential force; returns as run_calibrate. */
int calibrate_drag(const CalibrateOptions &options);

} // namespace fingertip
