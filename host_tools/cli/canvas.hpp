/* A grid of coloured character cells, and its text for an ANSI terminal. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace fingertip {

struct Colour {
  std::uint8_t r, g, b;
  bool operator==(const Colour &other) const {
    return r == other.r && g == other.g && b == other.b;
  }
};

/* Nothing means the terminal's own colour. */
struct Style {
  std::optional<Colour> front;
  std::optional<Colour> back;
  bool bold = false;
  bool operator==(const Style &other) const {
    return front == other.front && back == other.back && bold == other.bold;
  }
};

enum class ColourDepth { truecolour, palette_256 };
enum class Characters { utf_8, ascii };

class Canvas {
public:
  Canvas(int columns, int rows);

  int columns() const { return columns_; }
  int rows() const { return rows_; }

  /* Writes UTF-8 text of one-column characters; what lies outside is cut off. Without a background
   * of its own it keeps what is there. Returns the column after it. */
  int text(int column, int row, std::string_view text, const Style &style = {});

  /* A cell of two square halves. */
  void halves(int column, int row, Colour top, Colour bottom);

  /* Draws it all, starting at the terminal's upper left corner. In ASCII halves become whole cells
   * of their mean colour, other shapes the nearest character, foreign letters '?'. */
  std::string ansi(ColourDepth depth, Characters characters) const;

private:
  struct Cell {
    std::string character = " ";
    Style style;
  };
  Cell *at(int column, int row);
  static Cell in_ascii(const Cell &cell);

  int columns_, rows_;
  std::vector<Cell> cells_;
};

/* Between two colours, 0 to 1. */
Colour mix(Colour a, Colour b, float part);

} // namespace fingertip
