#include "cli/canvas.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <map>

namespace fingertip {

namespace {

/* The 6 x 6 x 6 cube of the xterm palette, entries 16 to 231, and its greys, 232 to 255. */
int palette_index(Colour colour) {
  constexpr int levels[6] = {0, 95, 135, 175, 215, 255};
  auto nearest = [&](int value) {
    int best = 0;
    for (int i = 1; i < 6; i++) {
      if (std::abs(levels[i] - value) < std::abs(levels[best] - value)) {
        best = i;
      }
    }
    return best;
  };
  auto distance = [&](int r, int g, int b) {
    return (r - colour.r) * (r - colour.r) + (g - colour.g) * (g - colour.g) +
           (b - colour.b) * (b - colour.b);
  };
  int r = nearest(colour.r), g = nearest(colour.g), b = nearest(colour.b);
  int grey = std::clamp(((colour.r + colour.g + colour.b) / 3 - 3) / 10, 0, 23);
  int grey_level = 8 + 10 * grey;
  bool grey_is_nearer =
      distance(grey_level, grey_level, grey_level) < distance(levels[r], levels[g], levels[b]);
  return grey_is_nearer ? 232 + grey : 16 + 36 * r + 6 * g + b;
}

std::string colour_code(int plane, const std::optional<Colour> &colour, ColourDepth depth) {
  if (!colour) {
    return ";" + std::to_string(plane + 9);
  }
  std::string code = ";" + std::to_string(plane + 8);
  if (depth == ColourDepth::palette_256) {
    return code + ";5;" + std::to_string(palette_index(*colour));
  }
  return code + ";2;" + std::to_string(colour->r) + ";" + std::to_string(colour->g) + ";" +
         std::to_string(colour->b);
}

std::string style_code(const Style &style, ColourDepth depth) {
  return std::string("\x1b[0") + (style.bold ? ";1" : "") + colour_code(30, style.front, depth) +
         colour_code(40, style.back, depth) + "m";
}

std::size_t character_length(unsigned char first) {
  return first < 0x80 ? 1 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
}

constexpr const char *UPPER_HALF = "▀";

char ascii_of(const std::string &character) {
  static const std::map<std::string, char> nearest = {
      {"─", '-'}, {"│", '|'}, {"╭", '+'}, {"╮", '+'}, {"╰", '+'}, {"╯", '+'}, {"●", '*'},
      {"○", 'o'}, {"·", '.'}, {"×", 'x'}, {"σ", 's'}, {"µ", 'u'}, {"▏", ' '}, {"▎", ' '},
      {"▍", ' '}, {"▌", '#'}, {"▋", '#'}, {"▊", '#'}, {"▉", '#'}, {"█", '#'}, {"▁", '_'},
      {"▂", '_'}, {"▃", '_'}, {"▄", '_'}, {"▅", '#'}, {"▆", '#'}, {"▇", '#'}};
  auto found = nearest.find(character);
  return found != nearest.end() ? found->second : '?';
}

} // namespace

Colour mix(Colour a, Colour b, float part) {
  part = std::clamp(part, 0.0f, 1.0f);
  auto channel = [&](std::uint8_t from, std::uint8_t to) {
    return static_cast<std::uint8_t>(
        std::lround(static_cast<float>(from) + part * static_cast<float>(to - from)));
  };
  return {channel(a.r, b.r), channel(a.g, b.g), channel(a.b, b.b)};
}

Canvas::Canvas(int columns, int rows)
    : columns_(std::max(columns, 1)), rows_(std::max(rows, 1)),
      cells_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_)) {}

Canvas::Cell *Canvas::at(int column, int row) {
  if (column < 0 || column >= columns_ || row < 0 || row >= rows_) {
    return nullptr;
  }
  return &cells_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                 static_cast<std::size_t>(column)];
}

int Canvas::text(int column, int row, std::string_view text, const Style &style) {
  while (!text.empty()) {
    std::size_t length =
        std::min(character_length(static_cast<unsigned char>(text[0])), text.size());
    if (Cell *cell = at(column, row)) {
      std::optional<Colour> behind = cell->style.back;
      cell->character = text.substr(0, length);
      cell->style = style;
      if (!style.back) {
        cell->style.back = behind;
      }
    }
    text.remove_prefix(length);
    column++;
  }
  return column;
}

void Canvas::halves(int column, int row, Colour top, Colour bottom) {
  if (Cell *cell = at(column, row)) {
    cell->character = UPPER_HALF;
    cell->style = {top, bottom, false};
  }
}

Canvas::Cell Canvas::in_ascii(const Cell &cell) {
  if (cell.character.size() == 1) {
    return cell;
  }
  if (cell.character != UPPER_HALF) {
    return {std::string(1, ascii_of(cell.character)), cell.style};
  }
  const auto &[front, back, bold] = cell.style;
  return {" ", {front, back ? mix(*front, *back, 0.5f) : front, bold}};
}

std::string Canvas::ansi(ColourDepth depth, Characters characters) const {
  std::string out = "\x1b[H";
  for (int row = 0; row < rows_; row++) {
    std::optional<Style> current;
    for (int column = 0; column < columns_; column++) {
      const Cell &drawn =
          cells_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                 static_cast<std::size_t>(column)];
      Cell cell = characters == Characters::ascii ? in_ascii(drawn) : drawn;
      if (!current || !(*current == cell.style)) {
        out += style_code(cell.style, depth);
        current = cell.style;
      }
      out += cell.character;
    }
    out += "\x1b[0m";
    if (row + 1 < rows_) {
      out += "\r\n";
    }
  }
  return out;
}

} // namespace fingertip
