#include "tool/cli/chart.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace fingertip {

namespace {

/* "force  10 N" and the axis. */
constexpr int GUTTER = 11;
/* Shown at the least; more where there is room for it. */
constexpr double SPAN_s = 10;
constexpr double INTERVAL_s = static_cast<double>(History<Model::Sample>::INTERVAL_us) / 1e6;
constexpr int FEWEST_ROWS = 5, FEWEST_COLUMNS = 4;

/* Times of an area's columns, two dots each. */
class Times {
public:
  explicit Times(int columns)
      : dots_(2 * columns), step_(std::max<std::int64_t>(1, std::llround(std::ceil(SPAN_s / (INTERVAL_s * dots_))))) {}
  double span_s() const { return static_cast<double>(step_) * dots_ * INTERVAL_s; }
  int dots() const { return dots_; }
  /* The intervals of one dot, where this is the newest of all. */
  template <typename F> void each(std::int64_t newest, int dot, F &&visit) const {
    /* Whole cells move, so that what has passed stays as it was drawn. */
    std::int64_t last = newest / step_ | 1;
    std::int64_t first = (last - dots_ + 1 + dot) * step_;
    for (std::int64_t i = first; i < first + step_; i++) {
      if (i >= 0 && i <= newest) {
        visit(i);
      }
    }
  }

private:
  int dots_;
  std::int64_t step_;
};

std::string braille(unsigned dots) { return {'\xE2', static_cast<char>(0xA0 | dots >> 6), static_cast<char>(0x80 | (dots & 0x3F))}; }

/* The bit of a dot: column 0 or 1, row 0 to 3 from above. */
unsigned braille_bit(int column, int row) {
  constexpr unsigned bits[2][4] = {{0x01, 0x02, 0x04, 0x40}, {0x08, 0x10, 0x20, 0x80}};
  return bits[column][row];
}

std::string tick_text(float value) {
  bool whole = value == std::round(value);
  return number(value, whole ? 0 : std::abs(value) < 1 ? 2 : 1);
}

void draw_axis(Canvas &canvas, const Area &area, const Chart &chart) {
  Style faint = text_style(FAINT);
  canvas.text(area.left, area.top, chart.name, text_style(INK));
  auto tick = [&](int row, const std::string &value) {
    canvas.text(area.left + GUTTER - 1 - columns_of(value), area.top + row, value, faint);
    canvas.text(area.left + GUTTER - 1, area.top + row, "┤", text_style(RULE));
  };
  for (int row = 0; row < area.height; row++) {
    canvas.text(area.left + GUTTER - 1, area.top + row, "│", text_style(RULE));
  }
  bool symmetric = chart.low < 0;
  std::string unit = std::string(" ") + chart.unit;
  if (area.height == 1) {
    tick(0, (symmetric ? "±" : "") + tick_text(chart.high) + unit);
    return;
  }
  tick(0, tick_text(chart.high) + unit);
  tick(area.height - 1, tick_text(chart.low));
  if (area.height >= 5 && area.height % 2) {
    tick(area.height / 2, tick_text((chart.low + chart.high) / 2));
  }
}

/* The dots of one cell. */
struct Dots {
  unsigned bits = 0;
  bool doubtful = false, alarm = false;
  Colour colour = ACCENT;
};

ChartPoint point_of(const Curve &curve, const Times &times, int dot) {
  ChartPoint point;
  times.each(curve.last, dot, [&](std::int64_t interval) {
    const ChartPoint here = curve.at(interval);
    bool better = here.value && (!point.value || (point.doubtful && !here.doubtful) ||
                                 (point.doubtful == here.doubtful && (curve.goes_both_ways || *here.value > *point.value)));
    if (better) {
      point.value = here.value;
      point.doubtful = here.doubtful;
    }
    point.alarm = point.alarm || here.alarm;
  });
  return point;
}

void draw_curves(Canvas &canvas, const Area &area, const Chart &chart, const Times &times) {
  std::vector<Dots> cells(static_cast<std::size_t>(area.width) * static_cast<std::size_t>(area.height));
  auto cell = [&](int column, int row) -> Dots & { return cells[static_cast<std::size_t>(row * area.width + column)]; };
  auto set = [&](int dot, int row, const ChartPoint &point, Colour colour) {
    Dots &dots = cell(dot / 2, row / 4);
    dots.bits |= braille_bit(dot % 2, row % 4);
    dots.doubtful = dots.doubtful || point.doubtful;
    dots.alarm = dots.alarm || point.alarm;
    dots.colour = colour;
  };
  auto row_of = [&](float value) {
    float part = (chart.high - value) / (chart.high - chart.low);
    return static_cast<int>(std::lround(part * static_cast<float>(4 * area.height - 1)));
  };
  for (const Curve &curve : chart.curves) {
    int before = -1; /* row of the dot before; none */
    for (int dot = 0; dot < times.dots(); dot++) {
      const ChartPoint point = point_of(curve, times, dot);
      if (!point.value || *point.value < chart.low || *point.value > chart.high) {
        before = -1;
        continue;
      }
      const int row = row_of(*point.value);
      if (!point.doubtful || dot % 2 == 0) {
        set(dot, row, point, curve.colour);
      }
      const int from = before < 0 || point.doubtful ? row : before;
      for (int between = from; between != row; between += between < row ? 1 : -1) {
        set(dot, between, point, curve.colour);
      }
      before = point.doubtful ? -1 : row;
    }
  }
  int line_row = chart.line ? row_of(*chart.line) / 4 : -1;
  for (int row = 0; row < area.height; row++) {
    for (int column = 0; column < area.width; column++) {
      const Dots &dots = cell(column, row);
      if (dots.bits) {
        Colour colour = dots.doubtful ? WARNING : dots.alarm ? BAD : dots.colour;
        canvas.text(area.left + column, area.top + row, braille(dots.bits), text_style(colour));
      } else if (row == line_row) {
        canvas.text(area.left + column, area.top + row, "╌", text_style(RULE));
      }
    }
  }
}

void draw_time(Canvas &canvas, const Area &area, double span_s) {
  double step_s = span_s > 60 ? 20 : span_s > 25 ? 10 : span_s > 12 ? 5 : 2;
  int free_until = area.left + area.width;
  for (double ago_s = 0; ago_s <= span_s; ago_s += step_s) {
    std::string text = ago_s > 0 ? "-" + fixed(ago_s, 0) : "0 s";
    int at = area.left + area.width - 1 - static_cast<int>(std::lround(ago_s / span_s * (area.width - 1)));
    at = std::min(at - (ago_s > 0 ? 1 : 0), area.left + area.width - columns_of(text));
    if (at < area.left || at + columns_of(text) > free_until) {
      continue;
    }
    canvas.text(at, area.top, text, text_style(FAINT));
    free_until = at - 1;
  }
}

constexpr float AXIS_RIM_mm = 6.0f; /* beyond the outermost sensors, as the pad is drawn */

/* A doubtful force above this is none: the pads are made for less. */
constexpr float MOST_N = 50;

/* A tangential force below this is hardly more than its standard deviation: no axis is made for it. */
constexpr float LEAST_PULL_N = 0.5f;

using Sample = Model::Sample;

/* there: whether an interval has the value; alarm: where it is shown red; null: never. */
Curve curve_of(const Model &model, bool Sample::*there, float Sample::*value, bool goes_both_ways, bool Sample::*alarm) {
  return {[&model, there, value, alarm](std::int64_t interval) {
            const Sample &sample = model.samples()[interval];
            return ChartPoint{sample.*there ? std::optional<float>(sample.*value) : std::nullopt, sample.doubtful, alarm && sample.*alarm};
          },
          model.samples().last(), goes_both_ways};
}

} // namespace

float round_above(float value) {
  float power = std::pow(10.0f, std::floor(std::log10(value)));
  for (float step : {1.0f, 2.0f, 5.0f}) {
    if (value <= step * power * 1.0001f) {
      return step * power;
    }
  }
  return 10 * power;
}

bool has_room_for_charts(const Area &area) { return area.width - GUTTER >= FEWEST_COLUMNS && area.height >= FEWEST_ROWS; }

void each_shown(const Area &area, std::int64_t last, const std::function<void(std::int64_t interval)> &visit) {
  const Times times(area.width - GUTTER);
  for (int dot = 0; dot < times.dots(); dot++) {
    times.each(last, dot, visit);
  }
}

void draw_charts(Canvas &canvas, const Area &area, const std::vector<Chart> &charts) {
  int columns = area.width - GUTTER;
  const Times times(columns);
  int rows = area.height - 1, count = static_cast<int>(charts.size());
  int top = area.top;
  for (int i = 0; i < count; i++) {
    const Chart &chart = charts[static_cast<std::size_t>(i)];
    int height = rows / count + (i < rows % count ? 1 : 0);
    draw_axis(canvas, {area.left, top, area.width, height}, chart);
    draw_curves(canvas, {area.left + GUTTER, top, columns, height}, chart, times);
    top += height;
  }
  draw_time(canvas, {area.left + GUTTER, top, columns, 1}, times.span_s());
}

Curve force_curve(const Model &model) { return curve_of(model, &Sample::fitted, &Sample::force_N, false, &Sample::slip); }

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
  const auto signed_chart = [&](const char *name, const char *unit, float reach, bool Sample::*there, float Sample::*value,
                                bool Sample::*alarm) {
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
