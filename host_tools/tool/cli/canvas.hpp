/* A grid of coloured character cells. */
#pragma once

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
    return cells_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                  static_cast<std::size_t>(column)];
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

} // namespace fingertip
