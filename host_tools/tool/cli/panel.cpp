#include "tool/cli/panel.hpp"

#include "tool/advice.hpp"

#include <algorithm>

namespace fingertip {

std::string right_aligned(const std::string &text, int width) {
  return std::string(static_cast<std::size_t>(std::max(0, width - columns_of(text))), ' ') + text;
}

StateText state_of(const Model &model, bool how_long) {
  auto silence_s = model.seconds_since_frame();
  switch (model.state()) {
  case Model::State::connecting: return {"waiting for an answer", WARNING};
  case Model::State::gone: return {GONE_ADVICE, BAD};
  case Model::State::replay: return {"replay", ACCENT, true};
  case Model::State::nothing_recorded: return {"nothing recorded", ACCENT, true};
  case Model::State::live: break;
  }
  if (model.is_without_sensors()) {
    return {"no sensor answers", BAD};
  }
  if (!silence_s) {
    return {"no frames yet", BAD};
  }
  if (*silence_s > STALLED_s) {
    return {how_long ? "STALLED for " + fixed(*silence_s, 1) + " s" : "STALLED", BAD};
  }
  return model.is_tared() ? StateText{"live", GOOD, true} : StateText{"taring", WARNING, true};
}

void draw_bar(Canvas &canvas, const Area &area) {
  canvas.text(area.left, area.top, std::string(static_cast<std::size_t>(area.width), ' '), {FAINT, BAR, false});
}

int draw_quantity(Canvas &canvas, int column, int row, const Quantity &quantity) {
  bool doubtful = quantity.value && quantity.doubtful;
  column = canvas.text(column, row, std::string(quantity.label) + " ", text_style(FAINT));
  column = canvas.text(column, row, right_aligned(quantity.value.value_or("-"), quantity.width),
                       text_style(doubtful ? WARNING : WHITE, !doubtful));
  column = canvas.text(column, row, doubtful ? "?" : " ", text_style(WARNING));
  return canvas.text(column, row, quantity.unit, text_style(FAINT));
}

int draw_lamp(Canvas &canvas, int column, int row, bool on, const std::string &name, Colour colour) {
  column = canvas.text(column, row, on ? "● " : "○ ", text_style(on ? colour : RULE, true));
  return canvas.text(column, row, name, text_style(on ? colour : FAINT, on));
}

std::vector<std::string> flowed(const std::vector<std::string> &parts, const std::string &separator, int columns) {
  std::vector<std::string> lines;
  for (const std::string &part : parts) {
    std::string longer = lines.empty() ? part : lines.back() + separator + part;
    if (!lines.empty() && columns_of(longer) <= columns) {
      lines.back() = longer;
    } else {
      lines.push_back(part);
    }
  }
  return lines;
}

bool is_too_small(Canvas &canvas) {
  constexpr int least_columns = 80, least_rows = 24;
  const bool small = canvas.columns() < least_columns || canvas.rows() < least_rows;
  auto size = [](int columns, int rows) { return std::to_string(columns) + "x" + std::to_string(rows); };
  if (small) {
    canvas.text(0, 0, "window too small: " + size(canvas.columns(), canvas.rows()) + ", needs " + size(least_columns, least_rows),
                text_style(WARNING, true));
  }
  return small;
}

void draw_caption(Canvas &canvas, const Caption &caption) {
  int row = canvas.rows() - 1;
  if (!caption.question.empty()) {
    canvas.text(1, row, caption.question, text_style(WARNING, true));
    return;
  }
  /* Where both do not fit, the note has at least half of the line. */
  const int left = canvas.columns() - 5 - columns_of(caption.note);
  const int room = caption.note.empty() ? canvas.columns() : std::max(left, canvas.columns() / 2);
  int column = canvas.text(1, row, first_columns(caption.keys, room), text_style(FAINT)) + 3;
  canvas.text(column, row, caption.note, text_style(ACCENT, true));
}

} // namespace fingertip
