/* Quantities over time, below one another, each with its axes; the newest at the right. */
#pragma once

#include "tool/cli/canvas.hpp"
#include "tool/cli/model.hpp"

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace fingertip {

/* The values of one interval. */
struct ChartPoint {
  std::optional<float> value;
  bool doubtful = false; /* shown only where there is no other, and dashed */
  bool alarm = false;    /* shown red */
};

struct Curve {
  std::function<ChartPoint(std::int64_t interval)> at;
  std::int64_t last = 0;       /* the newest interval */
  bool goes_both_ways = false; /* a dot shows the last value, else the highest */
  Colour colour = ACCENT;
};

struct Chart {
  const char *name;
  const char *unit;
  float low, high;
  std::optional<float> line; /* to compare with: zero, or a threshold */
  std::vector<Curve> curves; /* the last one above the others */
};

/* Whether there is room for any. */
bool has_room_for_charts(const Area &area);
/* Calls visit with every interval that will be shown of a curve whose newest is this. */
void each_shown(const Area &area, std::int64_t last, const std::function<void(std::int64_t interval)> &visit);
/* A row for each at the least and one for the time. */
void draw_charts(Canvas &canvas, const Area &area, const std::vector<Chart> &charts);

/* Force, x, y and slip below one another, the newest at the right; at least a row for each and one for the time. Where
 * the fingertip knows its pad qx and qy are between, instead of x and y where there is no room for all. What carries a
 * warning is dashed, and left out where it is beyond the axis that the others need. */
void draw_traces(Canvas &canvas, const Area &area, const Model &model);
/* Of the model, which must outlive it. */
Curve force_curve(const Model &model);

/* 1, 2 or 5 times a power of ten, not below the value. */
float round_above(float value);

} // namespace fingertip
