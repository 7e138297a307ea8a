#include "tool/cli/painter.hpp"

#include <algorithm>
#include <cstdlib>
#include <map>

namespace fingertip {

/* The 6 x 6 x 6 cube of the xterm palette, entries 16 to 231, and its greys, 232 to 255. */
static int palette_index(Colour colour) {
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
    return (r - colour.r) * (r - colour.r) + (g - colour.g) * (g - colour.g) + (b - colour.b) * (b - colour.b);
  };
  int r = nearest(colour.r), g = nearest(colour.g), b = nearest(colour.b);
  int grey = std::clamp(((colour.r + colour.g + colour.b) / 3 - 3) / 10, 0, 23);
  int grey_level = 8 + 10 * grey;
  bool grey_is_nearer = distance(grey_level, grey_level, grey_level) < distance(levels[r], levels[g], levels[b]);
  return grey_is_nearer ? 232 + grey : 16 + 36 * r + 6 * g + b;
}

constexpr const char *UPPER_HALF = "▀";
constexpr const char *LOWER_HALF = "▄";

/* U+2800 to U+28FF: dots in four rows. */
static bool is_braille(const std::string &character) {
  return character.size() == 3 && character[0] == '\xE2' && (static_cast<unsigned char>(character[1]) & 0xFC) == 0xA0;
}

static char ascii_of_braille(const std::string &character) {
  unsigned dots = (static_cast<unsigned char>(character[1]) & 3u) << 6 | (static_cast<unsigned char>(character[2]) & 0x3Fu);
  constexpr unsigned upper = 0x1B, lower = 0xE4; /* two rows each */
  return dots & upper ? (dots & lower ? ':' : '\'') : dots & lower ? '.' : ' ';
}

static char ascii_of(const std::string &character) {
  static const std::map<std::string, char> nearest = {
      {"─", '-'}, {"│", '|'},  {"┤", '|'},  {"╌", '-'}, {"┼", '+'}, {"╭", '+'}, {"╮", '+'}, {"╰", '+'}, {"╯", '+'}, {"●", '*'}, {"○", 'o'},
      {"·", '.'}, {"×", 'x'},  {"σ", 's'},  {"µ", 'u'}, {"±", '~'}, {"≥", '>'}, {"←", '<'}, {"→", '>'}, {"↑", '^'}, {"↓", 'v'}, {"↗", '/'},
      {"↙", '/'}, {"↖", '\\'}, {"↘", '\\'}, {"▏", ' '}, {"▎", ' '}, {"▍", ' '}, {"▌", '#'}, {"▋", '#'}, {"▊", '#'}, {"▉", '#'}, {"█", '#'}};
  auto found = nearest.find(character);
  return found != nearest.end() ? found->second : is_braille(character) ? ascii_of_braille(character) : '?';
}

/* From dark to bright. */
static std::string shade(Colour colour, Characters characters) {
  constexpr const char *shades[] = {" ", "░", "▒", "▓", "█"};
  constexpr const char *ascii[] = {" ", ".", ":", "+", "#"};
  /* Weights of ITU-R BT.601 in tenths; the pad's own colour is below the first step. */
  int brightness = (3 * colour.r + 6 * colour.g + colour.b) / 10;
  auto step = static_cast<std::size_t>(std::clamp((brightness + 20) * 5 / 276, 0, 4));
  return characters == Characters::ascii ? ascii[step] : shades[step];
}

static void append_colour(std::string &codes, int plane, std::int32_t colour, bool truecolour) {
  codes += (codes.empty() ? "" : ";");
  if (colour < 0) {
    codes += std::to_string(plane + 9);
  } else if (truecolour) {
    codes += std::to_string(plane + 8) + ";2;" + std::to_string(colour >> 16) + ";" + std::to_string(colour >> 8 & 0xFF) + ";" +
             std::to_string(colour & 0xFF);
  } else {
    codes += std::to_string(plane + 8) + ";5;" + std::to_string(colour);
  }
}

std::int32_t Painter::code(const std::optional<Colour> &colour) const {
  if (!colour || depth_ == ColourDepth::none) {
    return TERMINALS_OWN;
  }
  return depth_ == ColourDepth::palette_256 ? palette_index(*colour) : colour->r << 16 | colour->g << 8 | colour->b;
}

Painter::Shown Painter::shown(const Canvas::Cell &cell) const {
  const auto &[front, back, bold] = cell.style;
  if (!cell.halves) {
    bool as_it_is = characters_ == Characters::utf_8 || cell.character.size() == 1;
    std::string character = as_it_is ? cell.character : std::string(1, ascii_of(cell.character));
    /* a blank's front cannot be seen */
    return {character, character == " " ? TERMINALS_OWN : code(front), code(back), character != " " && bold};
  }
  Colour mean = mix(*front, *back, 0.5f);
  if (depth_ == ColourDepth::none) {
    return {shade(mean, characters_), TERMINALS_OWN, TERMINALS_OWN, false};
  }
  if (characters_ == Characters::ascii) {
    return {" ", TERMINALS_OWN, code(mean), false};
  }
  Shown halves{"", code(front), code(back), false};
  return halves.front == halves.back ? Shown{" ", TERMINALS_OWN, halves.back, false} : halves;
}

std::string Painter::pen_change(Shown &pen, const Shown &wanted) const {
  bool truecolour = depth_ == ColourDepth::truecolour;
  std::string codes;
  if (pen.bold && !wanted.bold) {
    codes = "22";
  } else if (wanted.bold && !pen.bold) {
    codes = "1";
  }
  /* A blank shows only what is behind it. */
  if (wanted.character != " " && pen.front != wanted.front) {
    append_colour(codes, 30, wanted.front, truecolour);
    pen.front = wanted.front;
  }
  if (pen.back != wanted.back) {
    append_colour(codes, 40, wanted.back, truecolour);
    pen.back = wanted.back;
  }
  pen.bold = wanted.bold;
  return codes.empty() ? "" : "\x1b[" + codes + "m";
}

std::string Painter::paint(const Canvas &canvas) {
  bool all = shown_.empty() || columns_ != canvas.columns() || rows_ != canvas.rows();
  std::string out = "\x1b[0m";
  if (all) {
    columns_ = canvas.columns();
    rows_ = canvas.rows();
    shown_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), {" ", TERMINALS_OWN, TERMINALS_OWN, false});
    out += "\x1b[2J";
  }
  Shown pen;
  int pen_column = -1, pen_row = -1;
  for (int row = 0; row < rows_; row++) {
    for (int column = 0; column < columns_; column++) {
      Shown wanted = shown(canvas.cell(column, row));
      Shown &there = shown_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(column)];
      if (wanted == there) {
        continue;
      }
      there = wanted;
      if (pen_row != row) {
        out += "\x1b[" + std::to_string(row + 1) + ";" + std::to_string(column + 1) + "H";
      } else if (pen_column != column) {
        out += "\x1b[" + std::to_string(column - pen_column) + "C";
      }
      if (wanted.character.empty()) {
        bool turned = pen.front == wanted.back || pen.back == wanted.front;
        wanted.character = turned ? LOWER_HALF : UPPER_HALF;
        if (turned) {
          std::swap(wanted.front, wanted.back);
        }
      }
      out += pen_change(pen, wanted) + wanted.character;
      pen_row = row;
      pen_column = column + 1;
    }
  }
  return out.size() > 4 ? out : "";
}

} // namespace fingertip
