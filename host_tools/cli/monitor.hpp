/* Draws the monitor: one fingertip or several side by side, each with its pad, its numbers, and its
 * traces. */
#pragma once

#include "cli/canvas.hpp"
#include "cli/model.hpp"

#include <string>
#include <vector>

namespace fingertip {

/* What stands below the fingertips. */
struct Caption {
  std::string keys;     /* what they do */
  std::string note;     /* what else is going on, such as the recording */
  std::string question; /* instead of both */
};

inline constexpr int MONITOR_COLUMNS = 80, MONITOR_ROWS = 24;

/* Fits any size from those upwards; below that it says so, and shows the numbers alone. */
Canvas draw_monitor(const std::vector<Model> &models, const Caption &caption, int columns,
                    int rows);

} // namespace fingertip
