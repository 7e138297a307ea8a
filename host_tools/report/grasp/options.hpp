// Command line of the form --name value, and --help, for the programs that measure, and how they
// end.
#pragma once

#include <cstdint>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace fingertip::reference {

struct Option {
  const char *name;
  std::string *text = nullptr; // exactly one of the three is set
  std::uint64_t *number = nullptr;
  bool *flag = nullptr; // without a value
};

// Throws std::runtime_error with a message for the user. On --help, prints the usage and ends.
void parse_options(int argc, char **argv, const std::vector<Option> &options, const std::string &usage);

// A main that prints what it found as one JSON object on the standard output, or in one line on
// stderr what went wrong. Exit status.
int print_found(const char *program, int argc, char **argv, const std::vector<Option> &options,
                const std::string &usage, const std::function<nlohmann::ordered_json()> &measure);

} // namespace fingertip::reference
