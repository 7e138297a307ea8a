// libfingertip/text.hpp's numbers, for libc++ 14, which has no std::from_chars of floats.
#include "libfingertip/text.hpp"

#include <cmath>
#include <cstdlib>

namespace fingertip {

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
