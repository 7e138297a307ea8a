// libfingertip/text.hpp's numbers for the page: libc++ 14 has no std::from_chars of floats, and its
// std::to_chars with a number of digits needs a hundred kilobytes of tables.
#include "libfingertip/text.hpp"

#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace fingertip {

// strtod takes more than std::from_chars does: blanks, "+", hexadecimal, and what is too small to be anything but 0.
template <typename Number> static std::optional<Number> parsed(std::string_view text, Number (*convert)(const char *, char **)) {
  if (text.empty() || text.find_first_not_of("0123456789.eE+-") != std::string_view::npos || text[0] == '+') {
    return std::nullopt;
  }
  const std::string copy(text);
  char *end = nullptr;
  const Number value = convert(copy.c_str(), &end);
  const bool vanished = value == Number(0) && text.substr(0, text.find_first_of("eE")).find_first_of("123456789") != std::string_view::npos;
  return end == copy.c_str() + copy.size() && std::isfinite(value) && !vanished ? std::optional(value) : std::nullopt;
}

template <typename Integer> static std::optional<Integer> whole(std::string_view text) {
  Integer value{};
  const char *end = text.data() + text.size();
  const auto result = std::from_chars(text.data(), end, value);
  return !text.empty() && result.ec == std::errc() && result.ptr == end ? std::optional(value) : std::nullopt;
}

std::string shortest(float value) {
  char text[32];
  return std::string(text, std::to_chars(text, text + sizeof text, value).ptr);
}

std::string fixed(double value, int digits) {
  char text[400];
  (void)std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

std::optional<double> to_double(std::string_view text) { return parsed<double>(text, std::strtod); }
std::optional<float> to_float(std::string_view text) { return parsed<float>(text, std::strtof); }
std::optional<std::uint64_t> to_u64(std::string_view text) { return whole<std::uint64_t>(text); }
std::optional<std::int64_t> to_i64(std::string_view text) { return whole<std::int64_t>(text); }

} // namespace fingertip
