/* Canvases to the bytes that show them on an ANSI terminal, of which only those are sent that change it.
 * ncurses has no two free colours to a cell, which the pad needs, and does not bracket pastes. */
#pragma once

#include "tool/cli/canvas.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace fingertip {

/* none: shades of characters instead of colours, for NO_COLOR. */
enum class ColourDepth { truecolour, palette_256, none };
enum class Characters { utf_8, ascii };

class Painter {
public:
  Painter(ColourDepth depth, Characters characters) : depth_(depth), characters_(characters) {}

  /* What turns the canvas before into this one; everything at first, and where the size changed. In ASCII halves become
   * whole cells of their mean colour, other shapes the nearest character, foreign letters '?'. */
  std::string paint(const Canvas &canvas);

  /* Nothing is known of what the terminal shows. */
  void forget() { shown_.clear(); }

private:
  static constexpr std::int32_t TERMINALS_OWN = -1;

  /* Colours as the terminal gets them: 0xRRGGBB, or a number of the palette. */
  struct Shown {
    std::string character; /* empty: halves */
    std::int32_t front = TERMINALS_OWN, back = TERMINALS_OWN;
    bool bold = false;
    bool operator==(const Shown &other) const {
      return character == other.character && front == other.front && back == other.back && bold == other.bold;
    }
  };

  Shown shown(const Canvas::Cell &cell) const;
  std::int32_t code(const std::optional<Colour> &colour) const;
  std::string pen_change(Shown &pen, const Shown &wanted) const;

  ColourDepth depth_;
  Characters characters_;
  int columns_ = 0, rows_ = 0;
  std::vector<Shown> shown_;
};

} // namespace fingertip
