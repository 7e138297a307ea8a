/* Colours and shapes that the parts of the monitor share. */
#pragma once

#include "libfingertip/text.hpp"
#include "tool/cli/canvas.hpp"

namespace fingertip {

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
