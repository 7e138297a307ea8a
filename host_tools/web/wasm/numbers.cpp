// libfingertip/text.hpp's numbers for the page: libc++ 14 has no std::from_chars of floats, and its
// std::to_chars of floats needs a hundred kilobytes of tables.
#include "libfingertip/text.hpp"

#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace fingertip {

std::string shortest(float value) {
  constexpr int DIGITS_MOST = 9;
  char text[32];
  for (int digits = 1; digits <= DIGITS_MOST; digits++) {
    (void)std::snprintf(text, sizeof text, "%.*g", digits, static_cast<double>(value));
    if (std::strtof(text, nullptr) == value) {
      break;
    }
  }
  return text;
}

std::string fixed(double value, int digits) {
  char text[400];
  (void)std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

std::optional<double> to_double(std::string_view text) {
  // strtod takes more than std::from_chars does: blanks, "+", hexadecimal.
  if (text.empty() || text.find_first_not_of("0123456789.eE+-") != std::string_view::npos ||
      text[0] == '+') {
    return std::nullopt;
  }
  const std::string copy(text);
  char *end = nullptr;
  const double value = std::strtod(copy.c_str(), &end);
  return end == copy.c_str() + copy.size() && std::isfinite(value) ? std::optional(value)
                                                                   : std::nullopt;
}

} // namespace fingertip
