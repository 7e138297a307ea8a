#include "web/wasm/json.hpp"

#include <cstdio>

namespace fingertip::web {

Json &Json::value(double number) {
  if (!std::isfinite(number)) {
    return null();
  }
  char text[32];
  (void)std::snprintf(text, sizeof text, "%.17g", number);
  return bare(text);
}

void Json::quoted(std::string_view text) {
  separate();
  text_ += '"';
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      text_ += '\\';
    }
    if (static_cast<unsigned char>(c) < 0x20) {
      char escaped[8];
      (void)std::snprintf(escaped, sizeof escaped, "\\u%04x", static_cast<unsigned>(c));
      text_ += escaped;
    } else {
      text_ += c;
    }
  }
  text_ += '"';
}

} // namespace fingertip::web
