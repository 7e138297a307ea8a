#include "report/grasp/options.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace fingertip::reference {
namespace {

// CLI11 alone lets a negative number wrap.
CLI::Validator whole_number() {
  const auto complaint = [](const std::string &text) {
    const bool whole = !text.empty() && text.size() <= 18 && text.find_first_not_of("0123456789") == std::string::npos;
    return whole ? std::string() : "needs a whole number, not '" + text + "'";
  };
  return CLI::Validator(complaint, "N");
}

} // namespace

void parse_options(int argc, char **argv, const std::vector<Option> &options, const std::string &usage) {
  CLI::App app;
  auto formatter =
      std::make_shared<CLI::FormatterLambda>([&](const CLI::App *, std::string, CLI::AppFormatMode) { return usage; });
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

int print_found(const char *program, int argc, char **argv, const std::vector<Option> &options,
                const std::string &usage, const std::function<nlohmann::ordered_json()> &measure) {
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
