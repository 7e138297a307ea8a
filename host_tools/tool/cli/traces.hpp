/* Force along three axes, location and slip over time, each with its axes. */
#pragma once

#include "tool/cli/canvas.hpp"
#include "tool/cli/chart.hpp"
#include "tool/cli/ink.hpp"
#include "tool/cli/model.hpp"

namespace fingertip {

/* Force, x, y and slip below one another, the newest at the right; at least a row for each and one
 * for the time. Where the fingertip knows its pad qx and qy are between, instead of x and y where
 * there is no room for all. What carries a warning is dashed, and left out where it is
 * beyond the axis that the others need. */
void draw_traces(Canvas &canvas, const Area &area, const Model &model);

/* Of the model, which must outlive it. */
Curve force_curve(const Model &model);

} // namespace fingertip
