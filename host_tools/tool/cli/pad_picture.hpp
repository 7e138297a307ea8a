/* The pad as the monitor draws it: the fitted pressure as colour, over it each sensor with its
 * number, its measured and its fitted pressure, and the tangential force as an arrow. */
#pragma once

#include "tool/cli/canvas.hpp"
#include "tool/cli/ink.hpp"
#include "tool/cli/model.hpp"

namespace fingertip {

/* In its frame, at the upper left corner of what is available; the area that it took. The model
 * must know its sensors. */
Area draw_pad(Canvas &canvas, const Area &available, const Model &model);

} // namespace fingertip
