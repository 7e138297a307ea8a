/* Draws the monitor: one fingertip or several side by side, each with its pad, its numbers, and its traces. */
#pragma once

#include "tool/cli/canvas.hpp"
#include "tool/cli/model.hpp"

#include <vector>

namespace fingertip {

/* Fits any size from 80 x 24 upwards; below that it shows a note and the numbers alone. */
Canvas draw_monitor(const std::vector<Model> &models, const Caption &caption, int columns, int rows);

/* The same for a grasp: the pads of both fingertips, left and right, side by side, beside them the gripper and what its
 * controller wants, below them both over time. */
Canvas draw_grasp(const std::vector<Model> &fingertips, const GripModel &grip, const Caption &caption, int columns, int rows);

} // namespace fingertip
