#include "libfingertip/text.hpp"

#include <algorithm>

namespace fingertip {

/* Length of the first character: 0 if it is none, or a control character. */
static std::size_t printable_length(std::string_view text) {
  auto first = static_cast<unsigned char>(text[0]);
  if (first < 0x80) {
    return first >= 0x20 && first != 0x7F;
  }
  std::size_t length = first < 0xC0 ? 0 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : first < 0xF8 ? 4 : 0;
  if (length == 0 || length > text.size()) {
    return 0;
  }
  char32_t code = first & (0x7Fu >> length);
  for (std::size_t i = 1; i < length; i++) {
    auto next = static_cast<unsigned char>(text[i]);
    if ((next & 0xC0) != 0x80) {
      return 0;
    }
    code = code << 6 | (next & 0x3F);
  }
  constexpr char32_t lowest[] = {0, 0, 0xA0 /* below are the C1 controls */, 0x800, 0x10000};
  bool valid = code >= lowest[length] && code <= 0x10FFFF && (code < 0xD800 || code > 0xDFFF);
  return valid ? length : 0;
}

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (;;) {
    std::size_t at = text.find(separator);
    parts.push_back(text.substr(0, at));
    if (at == std::string_view::npos) {
      return parts;
    }
    text.remove_prefix(at + 1);
  }
}

std::string_view trim(std::string_view text) {
  const char *blank = " \t\r";
  std::size_t first = text.find_first_not_of(blank);
  if (first == std::string_view::npos) {
    return {};
  }
  return text.substr(first, text.find_last_not_of(blank) - first + 1);
}

std::string printable(std::string_view text) {
  std::string shown;
  while (!text.empty()) {
    std::size_t length = printable_length(text);
    if (length > 0) {
      shown += text.substr(0, length);
    } else {
      shown += "\\x" + hex({static_cast<std::uint8_t>(text[0])});
    }
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return shown;
}

std::string hex(const std::vector<std::uint8_t> &bytes) {
  std::string text;
  for (std::uint8_t byte : bytes) {
    const char *digits = "0123456789abcdef";
    text += digits[byte >> 4];
    text += digits[byte & 15];
  }
  return text;
}

std::string upper(std::string text) {
  for (char &c : text) {
    c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  }
  return text;
}

} // namespace fingertip
