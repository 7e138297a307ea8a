/* Numbers to text and back, exactly and without regard to the locale. */
#pragma once

#include <cstdint>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace fingertip {

/* The shortest text that reads back as the same number. */
std::string shortest(float value);
/* The number with `digits` digits after the point. */
std::string fixed(double value, int digits);

/* Nothing unless all of the text is one finite number of that type. */
std::optional<double> to_double(std::string_view text);
std::optional<float> to_float(std::string_view text);
std::optional<std::uint64_t> to_u64(std::string_view text);
std::optional<std::int64_t> to_i64(std::string_view text);

/* Empty parts are kept: "a,,b" has three. */
std::vector<std::string_view> split(std::string_view text, char separator);
std::string_view trim(std::string_view text);
std::string upper(std::string text); /* of ASCII */
/* The first for which is_it holds, else nullptr. */
template <typename Range, typename IsIt> auto find_in(Range &range, const IsIt &is_it) -> decltype(&*std::begin(range)) {
  for (auto &each : range) {
    if (is_it(each)) {
      return &each;
    }
  }
  return nullptr;
}

/* What text_of makes of each. */
template <typename Range, typename TextOf> std::vector<std::string> texts_of(const Range &range, const TextOf &text_of) {
  std::vector<std::string> all;
  for (const auto &each : range) {
    all.push_back(text_of(each));
  }
  return all;
}

struct AsText {
  template <typename Text> std::string operator()(const Text &text) const { return std::string(text); }
};
/* What text_of makes of each, with the separator between; what is empty is left out. */
template <typename Range, typename TextOf = AsText>
std::string joined(const Range &range, const char *separator, const TextOf &text_of = {}) {
  std::string all;
  for (const auto &each : range) {
    const std::string text = text_of(each);
    all += (all.empty() || text.empty() ? "" : separator) + text;
  }
  return all;
}
/* Makes names that others chose harmless to a terminal: control characters, and what is no UTF-8, become \x1b. */
std::string printable(std::string_view text);
std::string hex(const std::vector<std::uint8_t> &bytes);

} // namespace fingertip
