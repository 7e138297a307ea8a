/* Draws the monitor: the pad with its pressure, and the numbers beside it. */
#pragma once

#include "cli/canvas.hpp"
#include "cli/model.hpp"

namespace fingertip {

/* Fits any size from 80 x 24 upwards, and shows what it can below that. note: what else is going
 * on, such as the recording. */
Canvas draw_monitor(const Model &model, const std::string &note, int columns, int rows);

/* No frame for so long is shown as a stall. */
inline constexpr double STALLED_s = 0.7;

} // namespace fingertip
