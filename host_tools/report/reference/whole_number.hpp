#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace fingertip::reference {

// CLI11 alone lets a negative number wrap.
inline CLI::Validator whole_number() {
  const auto complaint = [](const std::string &text) {
    const bool whole = !text.empty() && text.size() <= 18 && text.find_first_not_of("0123456789") == std::string::npos;
    return whole ? std::string() : "needs a whole number, not '" + text + "'";
  };
  return CLI::Validator(complaint, "N");
}

} // namespace fingertip::reference
