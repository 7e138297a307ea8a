// Command line of the form --name value, and --help.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

namespace fingertip::reference {

struct Option {
  const char *name;
  std::string *text = nullptr; // exactly one of the two is set
  std::uint64_t *number = nullptr;
};

// Throws std::runtime_error with a message for the user. On --help, prints the usage, if there is
// one, and ends.
inline void parse_options(int argc, char **argv, const std::vector<Option> &options,
                          const char *usage = nullptr) {
  for (int i = 1; i < argc; i += 2) {
    const std::string name = argv[i];
    if (usage && name == "--help") {
      std::fputs(usage, stdout);
      std::exit(0);
    }
    const Option *found = nullptr;
    std::string known;
    for (const Option &option : options) {
      known += std::string(" ") + option.name;
      found = name == option.name ? &option : found;
    }
    if (!found) {
      throw std::runtime_error("unknown option " + name + "; known are" + known);
    }
    if (i + 1 == argc) {
      throw std::runtime_error(name + " needs a value");
    }
    const std::string value = argv[i + 1];
    if (found->text) {
      *found->text = value;
    } else if (value.empty() || value.size() > 18 ||
               value.find_first_not_of("0123456789") != std::string::npos) {
      throw std::runtime_error(name + " needs a whole number, not '" + value + "'");
    } else {
      *found->number = std::stoull(value);
    }
  }
}

} // namespace fingertip::reference
