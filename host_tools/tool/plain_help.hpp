/* Help and wrong usage, as all programs of the tool print them. */
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace fingertip {

/* Help within 80 columns, which cuts no word; what is wrong in one line, which names the help. */
void speak_plainly(CLI::App &app);

/* A program that speaks so: its exit status. Run once everything was parsed; what it throws is printed in one line. */
int run_program(CLI::App &app, int argc, char **argv, const std::function<int()> &run);

/* As CLI::Range, which lets NaN pass. */
template <typename Number> CLI::Validator within(Number low, Number high) {
  const CLI::Validator range = CLI::Range(low, high);
  const auto check = [range](std::string &text) {
    return text.find_first_of("nN") == text.npos ? range(text) : "Value " + text + " not in range";
  };
  return CLI::Validator(check, range.get_description());
}

} // namespace fingertip
