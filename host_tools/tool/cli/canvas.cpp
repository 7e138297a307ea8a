#include "tool/cli/canvas.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace fingertip {

static std::size_t character_length(std::string_view text) {
  auto first = static_cast<unsigned char>(text[0]);
  return std::min<std::size_t>(first < 0x80 ? 1 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4, text.size());
}

Colour mix(Colour a, Colour b, float part) {
  part = std::clamp(part, 0.0f, 1.0f);
  auto channel = [&](std::uint8_t from, std::uint8_t to) {
    return static_cast<std::uint8_t>(std::lround(static_cast<float>(from) + part * static_cast<float>(to - from)));
  };
  return {channel(a.r, b.r), channel(a.g, b.g), channel(a.b, b.b)};
}

int columns_of(std::string_view text) {
  int columns = 0;
  for (; !text.empty(); columns++) {
    text.remove_prefix(character_length(text));
  }
  return columns;
}

std::string first_columns(std::string_view text, int columns) {
  std::size_t length = 0;
  for (; columns > 0 && length < text.size(); columns--) {
    length += character_length(text.substr(length));
  }
  return std::string(text.substr(0, length));
}

Canvas::Canvas(int columns, int rows)
    : columns_(std::max(columns, 1)), rows_(std::max(rows, 1)),
      cells_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_)) {}

Canvas::Cell *Canvas::at(int column, int row) {
  if (column < 0 || column >= columns_ || row < 0 || row >= rows_) {
    return nullptr;
  }
  return &cells_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(column)];
}

int Canvas::text(int column, int row, std::string_view text, const Style &style) {
  while (!text.empty()) {
    std::size_t length = character_length(text);
    if (Cell *cell = at(column, row)) {
      std::optional<Colour> behind = cell->style.back;
      *cell = {std::string(text.substr(0, length)), style, false};
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
    *cell = {"", {top, bottom, false}, true};
  }
}

} // namespace fingertip
