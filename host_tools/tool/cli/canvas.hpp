/* A grid of coloured character cells. */
#pragma once

#include "libfingertip/text.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace fingertip {

struct Colour {
  std::uint8_t r, g, b;
  bool operator==(const Colour &other) const { return r == other.r && g == other.g && b == other.b; }
};

/* Nothing means the terminal's own colour. */
struct Style {
  std::optional<Colour> front;
  std::optional<Colour> back;
  bool bold = false;
};

class Canvas {
public:
  /* In a cell with two square halves the front is the upper one's colour. */
  struct Cell {
    std::string character = " ";
    Style style;
    bool halves = false;
  };

  Canvas(int columns, int rows);

  int columns() const { return columns_; }
  int rows() const { return rows_; }
  const Cell &cell(int column, int row) const {
    return cells_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(column)];
  }

  /* Writes UTF-8 text of one-column characters; what lies outside is cut off. Without a background
   * of its own it keeps what is there. Returns the column after it. */
  int text(int column, int row, std::string_view text, const Style &style = {});

  void halves(int column, int row, Colour top, Colour bottom);

private:
  Cell *at(int column, int row);

  int columns_, rows_;
  std::vector<Cell> cells_;
};

/* The last line of a screen. */
struct Caption {
  std::string keys;     /* what they do */
  std::string note;     /* what else is going on, such as the recording */
  std::string question; /* instead of both */
};

/* Characters of a text, each a column wide. */
int columns_of(std::string_view text);
/* Its first ones. */
std::string first_columns(std::string_view text, int columns);

/* Between two colours, 0 to 1. */
Colour mix(Colour a, Colour b, float part);

/* Colours and shapes that the parts of a screen share. */
inline constexpr Colour INK = {222, 222, 228};
inline constexpr Colour FAINT = {128, 130, 145};
inline constexpr Colour RULE = {66, 68, 84};
inline constexpr Colour BAR = {32, 34, 50};
inline constexpr Colour PAD = {16, 16, 28};
inline constexpr Colour WHITE = {255, 255, 255};
inline constexpr Colour BLACK = {0, 0, 0};
inline constexpr Colour GOOD = {92, 214, 140};
inline constexpr Colour WARNING = {250, 190, 60};
inline constexpr Colour BAD = {255, 84, 84};
inline constexpr Colour ACCENT = {96, 190, 255};

constexpr Style text_style(Colour colour, bool bold = false) { return {colour, std::nullopt, bold}; }

struct Area {
  int left, top, width, height;
};

inline std::string number(float value, int digits) { return fixed(static_cast<double>(value), digits); }

} // namespace fingertip
