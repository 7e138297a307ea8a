#include "cli/traces.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace fingertip {

namespace {

/* "force  10 N" and the axis. */
constexpr int GUTTER = 11;
/* Shown at the least; more where there is room for it. */
constexpr double SPAN_s = 10;
constexpr float RIM_mm = 6.0f; /* beyond the outermost sensors, as the pad is drawn */

/* A doubtful force above this is none: the pads are made for less. */
constexpr float MOST_N = 50;

/* A tangential load below this is hardly more than its standard deviation: no axis is made for it.
 */
constexpr float LEAST_PULL_N = 0.5f;

using Sample = Model::Sample;

/* 1, 2 or 5 times a power of ten, not below the value. */
float round_above(float value) {
  float power = std::pow(10.0f, std::floor(std::log10(value)));
  for (float step : {1.0f, 2.0f, 5.0f}) {
    if (value <= step * power * 1.0001f) {
      return step * power;
    }
  }
  return 10 * power;
}

struct Trace {
  const char *name;
  const char *unit;
  float low, high;
  std::optional<float> line; /* to compare with: zero, or a threshold */
  std::function<std::optional<float>(const Sample &)> value;
  bool goes_both_ways; /* a dot shows the last value, else the highest */
  bool Sample::*alarm; /* told red where it is so; none: never */
};

/* Times of an area's columns, two dots each. */
class Times {
public:
  Times(const Model &model, int columns) : model_(model), dots_(2 * columns) {
    double shortest_s = Model::SAMPLE_INTERVAL_us / 1e6 * dots_;
    step_ = std::max<std::int64_t>(1, std::llround(std::ceil(SPAN_s / shortest_s)));
    /* Whole cells move, so that what has passed stays as it was drawn. */
    last_ = static_cast<std::int64_t>(model.last_interval()) / step_ | 1;
  }
  double span_s() const {
    return static_cast<double>(step_) * dots_ * Model::SAMPLE_INTERVAL_us / 1e6;
  }
  /* Those of one dot. */
  template <typename F> void each(int dot, F &&visit) const {
    std::int64_t first = (last_ - dots_ + 1 + dot) * step_;
    std::int64_t oldest = static_cast<std::int64_t>(model_.last_interval()) -
                          static_cast<std::int64_t>(model_.samples().size()) + 1;
    for (std::int64_t i = first; i < first + step_; i++) {
      if (i >= oldest && i <= static_cast<std::int64_t>(model_.last_interval())) {
        visit(model_.samples()[static_cast<std::size_t>(i - oldest)]);
      }
    }
  }
  template <typename F> void all(F &&visit) const {
    for (int dot = 0; dot < dots_; dot++) {
      each(dot, visit);
    }
  }

private:
  const Model &model_;
  int dots_;
  std::int64_t step_, last_;
};

std::string braille(unsigned dots) {
  return {'\xE2', static_cast<char>(0xA0 | dots >> 6), static_cast<char>(0x80 | (dots & 0x3F))};
}

/* The bit of a dot: column 0 or 1, row 0 to 3 from above. */
unsigned braille_bit(int column, int row) {
  constexpr unsigned bits[2][4] = {{0x01, 0x02, 0x04, 0x40}, {0x08, 0x10, 0x20, 0x80}};
  return bits[column][row];
}

std::string tick_text(float value) {
  bool whole = value == std::round(value);
  return number(value, whole ? 0 : std::abs(value) < 1 ? 2 : 1);
}

void draw_axis(Canvas &canvas, const Area &area, const Trace &trace) {
  Style faint = text_style(FAINT);
  canvas.text(area.left, area.top, trace.name, text_style(INK));
  auto tick = [&](int row, const std::string &value) {
    canvas.text(area.left + GUTTER - 1 - columns_of(value), area.top + row, value, faint);
    canvas.text(area.left + GUTTER - 1, area.top + row, "┤", text_style(RULE));
  };
  for (int row = 0; row < area.height; row++) {
    canvas.text(area.left + GUTTER - 1, area.top + row, "│", text_style(RULE));
  }
  bool symmetric = trace.low < 0;
  std::string unit = std::string(" ") + trace.unit;
  if (area.height == 1) {
    tick(0, (symmetric ? "±" : "") + tick_text(trace.high) + unit);
    return;
  }
  tick(0, tick_text(trace.high) + unit);
  tick(area.height - 1, tick_text(trace.low));
  if (area.height >= 5 && area.height % 2) {
    tick(area.height / 2, tick_text((trace.low + trace.high) / 2));
  }
}

/* The dots of one cell. */
struct Dots {
  unsigned bits = 0;
  bool doubtful = false, alarm = false;
};

class Curve {
public:
  explicit Curve(const Area &area)
      : width_(area.width), height_(area.height),
        cells_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_)) {}

  int rows() const { return 4 * height_; }
  Dots &cell(int column, int row) {
    return cells_[static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) +
                  static_cast<std::size_t>(column)];
  }
  void set(int dot, int row, bool doubtful, bool alarm) {
    Dots &dots = cell(dot / 2, row / 4);
    dots.bits |= braille_bit(dot % 2, row % 4);
    dots.doubtful = dots.doubtful || doubtful;
    dots.alarm = dots.alarm || alarm;
  }

private:
  int width_, height_;
  std::vector<Dots> cells_;
};

void draw_curve(Canvas &canvas, const Area &area, const Trace &trace, const Times &times) {
  Curve curve(area);
  auto row_of = [&](float value) {
    float part = (trace.high - value) / (trace.high - trace.low);
    return static_cast<int>(std::lround(part * static_cast<float>(curve.rows() - 1)));
  };
  int before = -1; /* row of the dot before; none */
  for (int dot = 0; dot < 2 * area.width; dot++) {
    std::optional<float> value;
    bool doubtful = false, alarm = false;
    times.each(dot, [&](const Sample &sample) {
      auto here = trace.value(sample);
      bool better =
          here && (!value || (doubtful && !sample.doubtful) ||
                   (doubtful == sample.doubtful && (trace.goes_both_ways || *here > *value)));
      if (better) {
        value = here;
        doubtful = sample.doubtful;
      }
      alarm = alarm || (trace.alarm && sample.*trace.alarm);
    });
    if (!value || *value < trace.low || *value > trace.high) {
      before = -1;
      continue;
    }
    int row = row_of(*value);
    if (doubtful) {
      before = -1;
      if (dot % 2 == 0) {
        curve.set(dot, row, true, alarm);
      }
      continue;
    }
    curve.set(dot, row, false, alarm);
    for (int between = before < 0 ? row : before; between != row;
         between += between < row ? 1 : -1) {
      curve.set(dot, between, false, alarm);
    }
    before = row;
  }
  int line_row = trace.line ? row_of(*trace.line) / 4 : -1;
  for (int row = 0; row < area.height; row++) {
    for (int column = 0; column < area.width; column++) {
      const Dots &dots = curve.cell(column, row);
      if (dots.bits) {
        Colour colour = dots.doubtful ? WARNING : dots.alarm ? BAD : ACCENT;
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
    int at = area.left + area.width - 1 -
             static_cast<int>(std::lround(ago_s / span_s * (area.width - 1)));
    at = std::min(at - (ago_s > 0 ? 1 : 0), area.left + area.width - columns_of(text));
    if (at < area.left || at + columns_of(text) > free_until) {
      continue;
    }
    canvas.text(at, area.top, text, text_style(FAINT));
    free_until = at - 1;
  }
}

} // namespace

void draw_traces(Canvas &canvas, const Area &area, const Model &model) {
  constexpr int shortest = 4;
  int columns = area.width - GUTTER;
  if (columns < 4 || area.height < shortest + 1) {
    return;
  }
  Times times(model, columns);
  float force_N = 1, pull_N = LEAST_PULL_N, slip_mm = 0.1f;
  float threshold_mm = model.info() ? model.info()->slip_threshold_mm : 0;
  float x_mm = RIM_mm, y_mm = RIM_mm;
  if (model.info()) {
    slip_mm = std::max(slip_mm, 1.2f * threshold_mm);
    for (int k = 0; k < model.info()->sensor_count; k++) {
      x_mm = std::max(x_mm, RIM_mm + std::abs(model.info()->x_mm[k]));
      y_mm = std::max(y_mm, RIM_mm + std::abs(model.info()->y_mm[k]));
    }
  }
  float doubtful_N = force_N;
  times.all([&](const Sample &sample) {
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
  auto where = [](bool Sample::*there, float Sample::*value) {
    return [there, value](const Sample &sample) {
      return sample.*there ? std::optional<float>(sample.*value) : std::nullopt;
    };
  };
  auto of_fit = [&](float Sample::*value) { return where(&Sample::fitted, value); };
  auto of_pull = [&](float Sample::*value) { return where(&Sample::pulled, value); };
  std::vector<Trace> traces = {{"force", "N", 0, round_above(force_N), std::nullopt,
                                of_fit(&Sample::force_N), false, &Sample::slip}};
  const bool three_axes = model.has_pad();
  if (three_axes) {
    traces.push_back(
        {"qx", "N", -pull_N, pull_N, 0.0f, of_pull(&Sample::qx_N), true, &Sample::sliding});
    traces.push_back(
        {"qy", "N", -pull_N, pull_N, 0.0f, of_pull(&Sample::qy_N), true, &Sample::sliding});
  }
  /* The location is in the picture of the pad too, with its last second. */
  if (!three_axes || area.height > shortest + 2) {
    traces.push_back({"x", "mm", -x_mm, x_mm, 0.0f, of_fit(&Sample::x_mm), true, nullptr});
    traces.push_back({"y", "mm", -y_mm, y_mm, 0.0f, of_fit(&Sample::y_mm), true, nullptr});
  }
  traces.push_back({"slip", "mm", 0, round_above(slip_mm),
                    threshold_mm > 0 ? std::optional<float>(threshold_mm) : std::nullopt,
                    where(&Sample::slip_valid, &Sample::slip_mm), false, &Sample::slip});
  int rows = area.height - 1, count = static_cast<int>(traces.size());
  int top = area.top;
  for (int i = 0; i < count; i++) {
    const Trace &trace = traces[static_cast<std::size_t>(i)];
    int height = rows / count + (i < rows % count ? 1 : 0);
    draw_axis(canvas, {area.left, top, area.width, height}, trace);
    draw_curve(canvas, {area.left + GUTTER, top, columns, height}, trace, times);
    top += height;
  }
  draw_time(canvas, {area.left + GUTTER, top, columns, 1}, times.span_s());
}

} // namespace fingertip
