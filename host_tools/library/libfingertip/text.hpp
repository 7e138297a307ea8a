/* Numbers to text and back, exactly and without regard to the locale. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace fingertip {

/* The shortest text that reads back as the same number. */
std::string shortest(float value);
/* With this many digits after the point. */
std::string fixed(double value, int digits);

/* Nothing unless all of the text is one finite number of that type. */
std::optional<double> to_double(std::string_view text);
std::optional<float> to_float(std::string_view text);
std::optional<std::uint64_t> to_u64(std::string_view text);
std::optional<std::int64_t> to_i64(std::string_view text);

/* Empty parts are kept: "a,,b" has three. */
std::vector<std::string_view> split(std::string_view text, char separator);
std::string_view trim(std::string_view text);
/* For names that others chose, in one line and harmless to a terminal: control characters, and
 * what is no UTF-8, as \x1b. */
std::string printable(std::string_view text);
std::string hex(const std::vector<std::uint8_t> &bytes);

} // namespace fingertip
