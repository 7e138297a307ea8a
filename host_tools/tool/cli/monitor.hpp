/* Draws the monitor: one fingertip or several side by side, each with its pad, its numbers, and its
 * traces. */
#pragma once

#include "tool/cli/canvas.hpp"
#include "tool/cli/caption.hpp"
#include "tool/cli/model.hpp"

#include <vector>

namespace fingertip {

inline constexpr int MONITOR_COLUMNS = 80, MONITOR_ROWS = 24;

/* Fits any size from those upwards; below that it shows a note and the numbers alone. */
Canvas draw_monitor(const std::vector<Model> &models, const Caption &caption, int columns, int rows);

} // namespace fingertip
