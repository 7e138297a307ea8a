#include "tool/cli/chart.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace fingertip {

namespace {

constexpr float AXIS_RIM_mm = 6.0f; /* beyond the outermost sensors, as the pad is drawn */

/* A doubtful force above this is none: the pads are made for less. */
constexpr float MOST_N = 50;

/* A tangential force below this is hardly more than its standard deviation: no axis is made for it.
 */
constexpr float LEAST_PULL_N = 0.5f;

using Sample = Model::Sample;

/* there: whether an interval has the value; alarm: where it is shown red; null: never. */
Curve curve_of(const Model &model, bool Sample::*there, float Sample::*value, bool goes_both_ways,
               bool Sample::*alarm) {
  return {[&model, there, value, alarm](std::int64_t interval) {
            const Sample &sample = model.samples()[interval];
            return ChartPoint{sample.*there ? std::optional<float>(sample.*value) : std::nullopt, sample.doubtful,
                              alarm && sample.*alarm};
          },
          model.samples().last(), goes_both_ways};
}

} // namespace

Curve force_curve(const Model &model) {
  return curve_of(model, &Sample::fitted, &Sample::force_N, false, &Sample::slip);
}

void draw_traces(Canvas &canvas, const Area &area, const Model &model) {
  constexpr int shortest = 4;
  if (!has_room_for_charts(area)) {
    return;
  }
  float force_N = 1, pull_N = LEAST_PULL_N, slip_mm = 0.1f;
  float threshold_mm = model.info() ? model.info()->slip_threshold_mm : 0;
  float x_mm = AXIS_RIM_mm, y_mm = AXIS_RIM_mm;
  if (model.info()) {
    slip_mm = std::max(slip_mm, 1.2f * threshold_mm);
    for (int k = 0; k < model.info()->sensor_count; k++) {
      x_mm = std::max(x_mm, AXIS_RIM_mm + std::abs(model.info()->x_mm[k]));
      y_mm = std::max(y_mm, AXIS_RIM_mm + std::abs(model.info()->y_mm[k]));
    }
  }
  float doubtful_N = force_N;
  each_shown(area, model.samples().last(), [&](std::int64_t interval) {
    const Sample &sample = model.samples()[interval];
    if (sample.fitted && !sample.doubtful) {
      force_N = std::max(force_N, sample.force_N);
    } else if (sample.fitted && sample.force_N <= MOST_N) {
      doubtful_N = std::max(doubtful_N, sample.force_N);
    }
    if (sample.pulled && !sample.doubtful) {
      pull_N = std::max({pull_N, std::abs(sample.qx_N), std::abs(sample.qy_N)});
    }
    if (sample.slip_valid && !sample.doubtful) {
      slip_mm = std::max(slip_mm, sample.slip_mm);
    }
  });
  bool good_ones = force_N > 1;
  force_N = good_ones ? force_N : doubtful_N;
  pull_N = round_above(pull_N);
  std::vector<Chart> charts = {{"force", "N", 0, round_above(force_N), std::nullopt, {force_curve(model)}}};
  const bool three_axes = model.has_pad();
  const auto signed_chart = [&](const char *name, const char *unit, float reach, bool Sample::*there,
                                float Sample::*value, bool Sample::*alarm) {
    charts.push_back({name, unit, -reach, reach, 0.0f, {curve_of(model, there, value, true, alarm)}});
  };
  if (three_axes) {
    signed_chart("qx", "N", pull_N, &Sample::pulled, &Sample::qx_N, &Sample::sliding);
    signed_chart("qy", "N", pull_N, &Sample::pulled, &Sample::qy_N, &Sample::sliding);
  }
  /* The location is in the picture of the pad too, with its last second. */
  if (!three_axes || area.height > shortest + 2) {
    signed_chart("x", "mm", x_mm, &Sample::fitted, &Sample::x_mm, nullptr);
    signed_chart("y", "mm", y_mm, &Sample::fitted, &Sample::y_mm, nullptr);
  }
  charts.push_back({"slip",
                    "mm",
                    0,
                    round_above(slip_mm),
                    threshold_mm > 0 ? std::optional<float>(threshold_mm) : std::nullopt,
                    {curve_of(model, &Sample::slip_valid, &Sample::slip_mm, false, &Sample::slip)}});
  draw_charts(canvas, area, charts);
}

} // namespace fingertip
