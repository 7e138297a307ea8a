#include "tool/plain_help.hpp"

#include "libfingertip/text.hpp"

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

namespace fingertip {

namespace {

constexpr std::size_t HELP_COLUMNS = 80;

/* Lines of at most this many characters, broken at blanks; all but the first begin with so many. */
std::string wrapped(const std::string &line, std::size_t columns, std::size_t indent) {
  std::string text = line;
  std::string lines;
  while (text.size() > columns) {
    std::size_t at = text.rfind(' ', columns);
    if (at == std::string::npos || at <= text.find_first_not_of(' ')) {
      break;
    }
    if (at <= indent) {
      break;
    }
    lines += text.substr(0, at) + "\n";
    text = std::string(indent, ' ') + text.substr(at + 1);
  }
  return lines + text;
}

/* No word is cut by a terminal of 80 columns. */
class HelpFormatter : public CLI::Formatter {
public:
  std::string make_help(const CLI::App *app, std::string name,
                        CLI::AppFormatMode mode) const override {
    std::string help = CLI::Formatter::make_help(app, name, mode);
    std::string all;
    for (std::string_view line : split(help, '\n')) {
      std::size_t indent = line.substr(0, 2) == "  " ? column_width_ : 0;
      all += wrapped(std::string(line), HELP_COLUMNS, indent) + "\n";
    }
    all.pop_back();
    return all;
  }
};

/* What CLI11 says, as people say it. */
std::string problem_of(const CLI::App *failed, const CLI::Error &error) {
  std::string text = error.what();
  std::string kind = error.get_name();
  if (kind == "ArgumentMismatch" && text.find("At Most") != std::string::npos) {
    return text.substr(0, text.find(':')) + " is given twice; give it once";
  }
  if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError)) {
    /* Its name is the command's. It tells the words from the last to the first. */
    const std::string first = text.substr(text.rfind(' ') + 1);
    return "\"" + first + (first[0] == '-' ? "\" is no option of it" : "\" is one word too many");
  }
  if (kind == "RequiredError") {
    for (const CLI::App *command : failed->get_subcommands()) {
      for (const CLI::Option *option : command->get_options()) {
        if (option->get_required() && text.rfind(option->get_name(), 0) == 0) {
          return option->get_type_name() + " is missing";
        }
      }
    }
  }
  return text;
}

} // namespace

void speak_plainly(CLI::App &app) {
  app.formatter(std::make_shared<HelpFormatter>());
  app.failure_message([](const CLI::App *failed, const CLI::Error &error) {
    std::string command = failed->get_name();
    for (const CLI::App *chosen : failed->get_subcommands()) {
      command += " " + chosen->get_name();
    }
    return printable("fingertip: " + problem_of(failed, error) + "; see " + command + " --help") +
           "\n";
  });
}

} // namespace fingertip
