// Command line of the form --name value, and --help, for the programs that measure, and how they
// end.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace fingertip::reference {

// CLI11 alone lets a negative number wrap.
inline CLI::Validator whole_number() {
  const auto complaint = [](const std::string &text) {
    const bool whole = !text.empty() && text.size() <= 18 &&
                       text.find_first_not_of("0123456789") == std::string::npos;
    return whole ? std::string() : "needs a whole number, not '" + text + "'";
  };
  return CLI::Validator(complaint, "N");
}

struct Option {
  const char *name;
  std::string *text = nullptr; // exactly one of the three is set
  std::uint64_t *number = nullptr;
  bool *flag = nullptr; // without a value
};

// Throws std::runtime_error with a message for the user. On --help, prints the usage and ends.
inline void parse_options(int argc, char **argv, const std::vector<Option> &options,
                          const std::string &usage) {
  CLI::App app;
  auto formatter = std::make_shared<CLI::FormatterLambda>(
      [&](const CLI::App *, std::string, CLI::AppFormatMode) { return usage; });
  app.formatter(formatter);
  app.set_help_flag("--help");
  for (const Option &option : options) {
    if (option.text) {
      app.add_option(option.name, *option.text);
    } else if (option.number) {
      app.add_option(option.name, *option.number)->check(whole_number());
    } else {
      app.add_flag(option.name, *option.flag);
    }
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp &) {
    std::fputs(app.help().c_str(), stdout);
    std::exit(0);
  } catch (const CLI::ParseError &error) {
    throw std::runtime_error(std::string(error.what()) + "; see --help");
  }
}

// A main that prints what it found as one JSON object on the standard output, or in one line on
// stderr what went wrong. Exit status.
template <typename Measure>
int print_found(const char *program, int argc, char **argv, const std::vector<Option> &options,
                const std::string &usage, const Measure &measure) {
  try {
    parse_options(argc, argv, options, usage);
    const nlohmann::ordered_json found = measure();
    std::cout << found.dump(1) << '\n';
    std::cout.flush();
    return std::cout ? 0 : 1;
  } catch (const std::exception &error) {
    std::fprintf(stderr, "%s: %s\n", program, error.what());
    return 1;
  }
}

} // namespace fingertip::reference
