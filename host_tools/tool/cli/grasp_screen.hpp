/* Draws a grasp: the pads of both fingertips side by side, beside them the gripper and what its
 * controller wants, below them both over time. */
#pragma once

#include "tool/cli/canvas.hpp"
#include "tool/cli/grip_model.hpp"
#include "tool/cli/model.hpp"
#include "tool/cli/panel.hpp"

#include <vector>

namespace fingertip {

/* fingertips: left, right. As draw_monitor for small windows. */
Canvas draw_grasp(const std::vector<Model> &fingertips, const GripModel &grip, const Caption &caption, int columns,
                  int rows);

} // namespace fingertip
