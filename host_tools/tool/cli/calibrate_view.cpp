#include "tool/cli/calibrate_view.hpp"

#include "libfingertip/clock.hpp"
#include "tool/cli/pad_picture.hpp"
#include "tool/cli/panel.hpp"

#include <cstdio>

namespace fingertip {

using calibrating::GainSession;
using calibrating::Judgement;

constexpr Colour PRESSED = {120, 60, 30};
constexpr double FULL_Pa = 20000.0;
constexpr int TEXT_COLUMNS = 44;
constexpr std::chrono::milliseconds REDRAW{40};

static Canvas draw(const GainSession &session, int columns, int rows) {
  Canvas canvas(columns, rows);
  const calibrating::Array &array = session.array();
  const Judgement *judgement = session.placements().empty() ? nullptr : &session.judgement();
  canvas.text(1, 0, "fingertip calibrate", text_style(WHITE, true));
  const PadScale pad(array.x_mm.data(), array.y_mm.data(), array.sensors(), columns - TEXT_COLUMNS - 4, rows - 4);
  const int left = 1, top = 2;
  for (int c = 0; c < pad.columns(); c++) {
    canvas.text(left + c, top - 1, "─", text_style(RULE));
    canvas.text(left + c, top + pad.rows(), "─", text_style(RULE));
  }
  const auto at = [&](double x_mm, double y_mm, const std::string &text, const Style &style) {
    canvas.text(left + std::clamp(pad.column_of(static_cast<float>(x_mm)), 0, pad.columns() - 1),
                top + std::clamp(pad.pixel_row_of(static_cast<float>(y_mm)) / 2, 0, pad.rows() - 1), text, style);
  };
  if (judgement) {
    for (const calibrating::Fitted &fitted : judgement->solution.placements) {
      at(fitted.x_mm, fitted.y_mm, fitted.kept ? "●" : "x", text_style(fitted.kept ? ACCENT : WARNING));
    }
  }
  for (std::size_t k = 0; k < array.sensors(); k++) {
    const bool unsure = !judgement || std::count(judgement->unsure.begin(), judgement->unsure.end(), k) > 0;
    const double pressure = std::clamp(session.finder().above_Pa()[k] / FULL_Pa, 0.0, 1.0);
    at(array.x_mm[k], array.y_mm[k], std::to_string(k),
       {unsure ? WARNING : GOOD, mix({0, 0, 0}, PRESSED, static_cast<float>(std::sqrt(pressure))), true});
  }
  if (session.wanted()) {
    at(session.wanted()->x_mm, session.wanted()->y_mm, "○", text_style(WHITE, true));
  }

  const int text_left = left + pad.columns() + 3;
  int row = top;
  const auto add_line = [&](const std::string &text, Colour colour, bool bold = false) {
    std::vector<std::string> words;
    for (std::string_view word : split(text, ' ')) {
      words.emplace_back(word);
    }
    for (const std::string &line : flowed(words, " ", TEXT_COLUMNS)) {
      canvas.text(text_left, row++, line, text_style(colour, bold));
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
  canvas.text(text_left, rows - 1, "q quit   u take the last one back", text_style(FAINT));
  return canvas;
}

CalibrateView::CalibrateView(ColourMode mode) {
  if (auto depth = screen_depth(mode)) {
    screen_ = std::make_unique<Screen>(*depth);
  }
}

void CalibrateView::update(const GainSession &session, bool news) {
  const auto now = host_now();
  if (screen_) {
    if (news || now >= next_) {
      next_ = now + REDRAW;
      screen_->draw(draw(session, screen_->columns(), screen_->rows()));
    }
    return;
  }
  if (news) {
    std::printf("%s\n", session.progress().c_str());
  }
  if (session.advice() != advice_) {
    advice_ = session.advice();
    std::printf("%s\n", advice_.c_str());
  }
  std::fflush(stdout);
}

} // namespace fingertip
