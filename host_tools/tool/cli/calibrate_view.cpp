#include "tool/cli/calibrate_view.hpp"

#include "libfingertip/clock.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <sstream>

namespace fingertip {

namespace {

using calibrating::GainSession;
using calibrating::Judgement;

constexpr Colour INK = {222, 222, 228}, FAINT = {128, 130, 145}, RULE = {66, 68, 84};
constexpr Colour GOOD = {92, 214, 140}, WARNING = {250, 190, 60}, ACCENT = {96, 190, 255};
constexpr Colour WHITE = {255, 255, 255}, PRESSED = {120, 60, 30};
constexpr double FULL_Pa = 20000.0;

constexpr double RIM_mm = 6.0;      /* beyond the outer sensors */
constexpr double CELL_ASPECT = 2.0; /* height of a character over its width */
constexpr int TEXT_COLUMNS = 44;
constexpr std::chrono::milliseconds REDRAW{40};

/* Where a place of the pad is on the screen. */
class Pad {
public:
  Pad(const calibrating::Array &array, int columns, int rows) {
    const auto [left, right] = std::minmax_element(array.x_mm.begin(), array.x_mm.end());
    const auto [bottom, top] = std::minmax_element(array.y_mm.begin(), array.y_mm.end());
    left_mm_ = *left - RIM_mm;
    top_mm_ = *top + RIM_mm;
    const double width_mm = *right + RIM_mm - left_mm_, height_mm = top_mm_ - *bottom + RIM_mm;
    column_mm_ = std::max(width_mm / std::max(columns, 4), height_mm / (CELL_ASPECT * std::max(rows, 4)));
    columns_ = static_cast<int>(std::lround(width_mm / column_mm_));
    rows_ = static_cast<int>(std::lround(height_mm / (CELL_ASPECT * column_mm_)));
  }
  int columns() const { return columns_; }
  int rows() const { return rows_; }
  int column(double x_mm) const {
    return std::clamp(static_cast<int>(std::floor((x_mm - left_mm_) / column_mm_)), 0, columns_ - 1);
  }
  int row(double y_mm) const {
    return std::clamp(static_cast<int>(std::floor((top_mm_ - y_mm) / (CELL_ASPECT * column_mm_))), 0, rows_ - 1);
  }

private:
  double left_mm_, top_mm_, column_mm_;
  int columns_, rows_;
};

/* Breaks text into lines of at most this many characters. */
std::vector<std::string> wrapped(const std::string &text, std::size_t columns) {
  std::vector<std::string> lines(1);
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (!lines.back().empty() && lines.back().size() + 1 + word.size() > columns) {
      lines.emplace_back();
    }
    lines.back() += (lines.back().empty() ? "" : " ") + word;
  }
  return lines;
}

Canvas draw(const GainSession &session, int columns, int rows) {
  Canvas canvas(columns, rows);
  const calibrating::Array &array = session.array();
  const Judgement *judgement = session.placements().empty() ? nullptr : &session.judgement();
  canvas.text(1, 0, "fingertip calibrate", {WHITE, std::nullopt, true});
  const Pad pad(array, columns - TEXT_COLUMNS - 4, rows - 4);
  const int left = 1, top = 2;
  for (int c = 0; c < pad.columns(); c++) {
    canvas.text(left + c, top - 1, "─", {RULE, std::nullopt, false});
    canvas.text(left + c, top + pad.rows(), "─", {RULE, std::nullopt, false});
  }
  const auto at = [&](double x_mm, double y_mm, const std::string &text, const Style &style) {
    canvas.text(left + pad.column(x_mm), top + pad.row(y_mm), text, style);
  };
  if (judgement) {
    for (const calibrating::Fitted &fitted : judgement->solution.placements) {
      at(fitted.x_mm, fitted.y_mm, fitted.kept ? "●" : "x", {fitted.kept ? ACCENT : WARNING, std::nullopt, false});
    }
  }
  for (std::size_t k = 0; k < array.sensors(); k++) {
    const bool unsure = !judgement || std::count(judgement->unsure.begin(), judgement->unsure.end(), k) > 0;
    const double pressure = std::clamp(session.finder().above_Pa()[k] / FULL_Pa, 0.0, 1.0);
    at(array.x_mm[k], array.y_mm[k], std::to_string(k),
       {unsure ? WARNING : GOOD, mix({0, 0, 0}, PRESSED, static_cast<float>(std::sqrt(pressure))), true});
  }
  if (session.wanted()) {
    at(session.wanted()->x_mm, session.wanted()->y_mm, "○", {WHITE, std::nullopt, true});
  }

  const int text_left = left + pad.columns() + 3;
  int row = top;
  const auto add_line = [&](const std::string &text, Colour colour, bool bold = false) {
    for (const std::string &line : wrapped(text, TEXT_COLUMNS)) {
      canvas.text(text_left, row++, line, {colour, std::nullopt, bold});
    }
  };
  add_line(session.advice(), WHITE, true);
  row++;
  add_line(session.progress(), INK);
  if (judgement && session.placements().size() >= calibrating::PLACEMENTS_MIN) {
    row++;
    add_line(judgement->text, judgement->state == Judgement::State::more ? FAINT : GOOD);
  }
  row++;
  if (session.wanted()) {
    add_line("○ where the next one helps most", FAINT);
  }
  add_line("● placements, green numbers: sensors that are done", FAINT);
  canvas.text(text_left, rows - 1, "q quit   u take the last one back", {FAINT, std::nullopt, false});
  return canvas;
}

class ScreenCalibrateView : public CalibrateView {
public:
  explicit ScreenCalibrateView(ColourDepth depth) : screen_(depth) {}
  void update(const GainSession &session, bool news) override {
    const auto now = host_now();
    if (news || now >= next_) {
      next_ = now + REDRAW;
      screen_.draw(draw(session, screen_.columns(), screen_.rows()));
    }
  }
  std::optional<Key> key() override { return screen_.key(); }

private:
  Screen screen_;
  HostTime next_{};
};

class LineCalibrateView : public CalibrateView {
public:
  void update(const GainSession &session, bool news) override {
    const std::string advice = session.advice();
    if (news) {
      std::printf("%s\n", session.progress().c_str());
    }
    if (advice != advice_) {
      std::printf("%s\n", advice.c_str());
      advice_ = advice;
    }
    std::fflush(stdout);
  }

private:
  std::string advice_;
};

} // namespace

std::unique_ptr<CalibrateView> make_calibrate_view(ColourMode mode) {
  if (auto depth = screen_depth(mode)) {
    return std::make_unique<ScreenCalibrateView>(*depth);
  }
  return std::make_unique<LineCalibrateView>();
}

} // namespace fingertip
