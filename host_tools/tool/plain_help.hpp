/* Help and wrong usage, as all programs of the tool print them. */
#pragma once

#include <CLI/CLI.hpp>

namespace fingertip {

/* Help within 80 columns, which cuts no word; what is wrong in one line, which names the help. */
void speak_plainly(CLI::App &app);

/* As CLI::Range, which lets NaN pass. */
inline CLI::Validator within(double low, double high) {
  const auto check = [](const std::string &text) { return text.find_first_of("nN") == text.npos ? "" : "Value " + text + " not in range"; };
  return CLI::Range(low, high) & CLI::Validator(check, "");
}

} // namespace fingertip
