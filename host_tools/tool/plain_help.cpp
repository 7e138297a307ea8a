#include "tool/plain_help.hpp"

#include "libfingertip/text.hpp"
#include "tool/advice.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace fingertip {

namespace {

constexpr std::size_t HELP_COLUMNS = 80;

/* Lines of at most this many characters, broken at blanks; all but the first are indented. */
std::string wrapped(const std::string &line, std::size_t columns, std::size_t indent) {
  std::string text = line;
  std::string lines;
  while (text.size() > columns) {
    std::size_t at = text.rfind(' ', columns);
    if (at == std::string::npos || at <= text.find_first_not_of(' ') || at <= indent) {
      break;
    }
    lines += text.substr(0, at) + "\n";
    text = std::string(indent, ' ') + text.substr(at + 1);
  }
  return lines + text;
}

/* CLI11's description of a value: "GRAMS:FLOAT in [50 - 2000]", "TEXT:{csv,mcap}", "FILE.csv". */
struct Values {
  std::string word, unit, allowed; /* GRAMS, grams, "50 to 2000"; or empty */
};

std::string number_text(const std::string &text) {
  char *end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  char plain[64];
  std::snprintf(plain, sizeof plain, "%.10g", value);
  return *end != '\0' ? text : plain;
}

Values values_of(const CLI::Option &option) {
  static const std::regex RANGE("(.*):(FLOAT|INT) in \\[(.*) - (.*)\\]");
  static const std::regex CHOICE("(.*):\\{(.*)\\}");
  static const std::map<std::string, std::string> UNITS = {
      {"GRAMS", "grams"}, {"MM", "mm"}, {"KG", "kg"}, {"S", "seconds"}, {"N/MM", "N/mm"}};
  const std::string text = option.get_type_name();
  std::smatch found;
  if (std::regex_match(text, found, RANGE)) {
    const auto unit = UNITS.find(found[1]);
    return {found[1],
            unit != UNITS.end()                      ? unit->second
            : found[1] == "N" && found[2] == "FLOAT" ? "newtons"
                                                     : "",
            number_text(found[3]) + " to " + number_text(found[4])};
  }
  if (std::regex_match(text, found, CHOICE)) {
    std::string allowed = std::regex_replace(found[2].str(), std::regex(","), ", ");
    const std::size_t last = allowed.rfind(", ");
    if (last != std::string::npos) {
      allowed.replace(last, 2, " or ");
    }
    return {found[1] == "TEXT" ? "NAME" : found[1].str(), "", allowed};
  }
  return {text == "TEXT" ? "NAME" : text, "", ""};
}

std::string names_of(const std::set<CLI::Option *> &options) {
  return joined(options, ", ", [](const CLI::Option *option) { return option->get_name(); });
}

/* No word is cut by a terminal of 80 columns; ranges, defaults and what excludes what in words. */
class HelpFormatter : public CLI::Formatter {
public:
  std::string make_option_opts(const CLI::Option *option) const override {
    if (option->get_type_size() == 0) {
      return "";
    }
    return " " + values_of(*option).word + (option->get_expected_max() == CLI::detail::expected_max_vector_size ? " ..." : "");
  }

  std::string make_option_desc(const CLI::Option *option) const override {
    std::string text = option->get_description();
    std::vector<std::string> more;
    if (option->get_required()) {
      more.push_back("required");
    }
    if (option->get_type_size() != 0) {
      const Values values = values_of(*option);
      if (!values.allowed.empty()) {
        more.push_back(values.allowed + (values.unit.empty() ? "" : " " + values.unit));
      }
      if (!option->get_default_str().empty()) {
        more.push_back("default " + option->get_default_str());
      }
    }
    if (!option->get_needs().empty()) {
      more.push_back("only with " + names_of(option->get_needs()));
    }
    if (!option->get_excludes().empty()) {
      more.push_back("not with " + names_of(option->get_excludes()));
    }
    return text + (more.empty() ? "" : " (" + joined(more, "; ") + ")");
  }

  std::string make_help(const CLI::App *app, std::string name, CLI::AppFormatMode mode) const override {
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

/* The value in "Value 5 not in range 10 to 1000" and "x not in {a,b}". */
std::string refused_value(const std::string &text) {
  const std::string after = text.rfind("Value ", 0) == 0 ? text.substr(6) : text;
  return after.substr(0, after.find(" not in "));
}

/* CLI11's message, in plain words. */
std::string problem_of(const CLI::App *failed, const CLI::Error &error) {
  std::string text = error.what();
  std::string kind = error.get_name();
  if (kind == "ArgumentMismatch" && text.find("At Most") != std::string::npos) {
    return text.substr(0, text.find(':')) + " is given twice; give it once";
  }
  if (kind == "ArgumentMismatch" && text.find(" required ") != std::string::npos) {
    return text.substr(0, text.find(':')) + " lacks its value";
  }
  if (const std::size_t equals = text.find(" = "); kind == "ConversionError" && equals != std::string::npos) {
    const std::size_t name = text.find(": ") + 2;
    return text.substr(name, equals - name) + " takes a number, not \"" + text.substr(equals + 3) + "\"";
  }
  if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError)) {
    /* Its name is the command's. It lists the words from the last to the first. */
    const std::string first = text.substr(text.rfind(' ') + 1);
    return "\"" + first + (first[0] == '-' ? "\" is no option of it" : "\" is one word too many");
  }
  std::vector<const CLI::Option *> options = failed->get_options();
  for (const CLI::App *command : failed->get_subcommands()) {
    const auto its = command->get_options();
    options.insert(options.end(), its.begin(), its.end());
  }
  for (const CLI::Option *option : options) {
    const Values values = values_of(*option);
    if (kind == "ValidationError" && !values.allowed.empty() && text.rfind(option->get_name() + ": ", 0) == 0) {
      return option->get_name() + " takes " + values.allowed + (values.unit.empty() ? "" : " " + values.unit) + ", not \"" +
             refused_value(text.substr(option->get_name().size() + 2)) + "\"";
    }
    if (kind == "RequiredError" && option->get_required() && text.rfind(option->get_name(), 0) == 0) {
      return option->get_type_name() + " is missing";
    }
  }
  return text;
}

} // namespace

void speak_plainly(CLI::App &app) {
  app.formatter(std::make_shared<HelpFormatter>());
  app.failure_message([](const CLI::App *failed, const CLI::Error &error) {
    std::string command = failed->get_name();
    const std::string program = command.substr(0, command.find(' '));
    for (const CLI::App *chosen : failed->get_subcommands()) {
      command += " " + chosen->get_name();
    }
    return printable(program + ": " + problem_of(failed, error) + "; see " + command + " --help") + "\n";
  });
}

int run_program(CLI::App &app, int argc, char **argv, const std::function<int()> &run) {
  speak_plainly(app);
  const std::string program = app.get_name().substr(0, app.get_name().find(' '));
  try {
    app.parse(argc, argv);
    return run();
  } catch (const CLI::ParseError &error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const Error &error) {
    print_error(program.c_str(), error);
  } catch (const std::exception &error) {
    print_error(program.c_str(), Error(error.what()));
  }
  return 1;
}

} // namespace fingertip
