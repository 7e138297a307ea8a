/* The pieces that screens are made of: bars, numbers with their units, lamps, and the caption. */
#pragma once

#include "tool/cli/canvas.hpp"
#include "tool/cli/model.hpp"

#include <optional>
#include <string>
#include <vector>

namespace fingertip {

struct StateText {
  std::string text;
  Colour colour;
  bool fine = false; /* or it is replayed */
};

/* The state of a fingertip; how_long: of a stall too. */
StateText state_of(const Model &model, bool how_long = true);

/* A number with its label and unit. */
struct Quantity {
  const char *label;
  std::optional<std::string> value;
  int width;
  const char *unit;
  bool doubtful = false;
};

/* The column after it. */
int draw_quantity(Canvas &canvas, int column, int row, const Quantity &quantity);
int draw_lamp(Canvas &canvas, int column, int row, bool on, const std::string &name, Colour colour);
void draw_bar(Canvas &canvas, const Area &area);
/* In the last row. */
void draw_caption(Canvas &canvas, const Caption &caption);
/* Whether the screen is too small for a picture; then the first row reports it. */
bool is_too_small(Canvas &canvas);

/* Lines of at most this many columns out of parts that stay whole. */
std::vector<std::string> flowed(const std::vector<std::string> &parts, const std::string &separator, int columns);
std::string right_aligned(const std::string &text, int width);

} // namespace fingertip
