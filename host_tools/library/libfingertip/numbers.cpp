#include "libfingertip/text.hpp"

#include <charconv>
#include <cmath>

namespace fingertip {

template <typename Number, typename... Format> static std::string written(Number value, Format... format) {
  char buffer[400];
  auto result = std::to_chars(buffer, buffer + sizeof buffer, value, format...);
  return std::string(buffer, result.ptr);
}

template <typename Number> static std::optional<Number> parsed(std::string_view text) {
  Number value{};
  auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec != std::errc() || result.ptr != text.data() + text.size() || text.empty()) {
    return std::nullopt;
  }
  return value;
}

template <typename Number> static std::optional<Number> finite(std::optional<Number> value) {
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::string shortest(float value) { return written(value); }

std::string fixed(double value, int digits) { return written(value, std::chars_format::fixed, digits); }

std::optional<double> to_double(std::string_view text) { return finite(parsed<double>(text)); }
std::optional<float> to_float(std::string_view text) { return finite(parsed<float>(text)); }
std::optional<std::uint64_t> to_u64(std::string_view text) { return parsed<std::uint64_t>(text); }
std::optional<std::int64_t> to_i64(std::string_view text) { return parsed<std::int64_t>(text); }

} // namespace fingertip
