#include "tool/cli/command_line.hpp"

#include "libfingertip/line_sink.hpp"
#include "libfingertip/text.hpp"
#include "tool/cli/installed_files.hpp"
#include "tool/plain_help.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <numeric>

namespace fingertip {

/* The letters of a word that may be mistyped: two that change places count as two. */
constexpr std::size_t letters_mistyped(std::size_t letters) { return letters < 6 ? 1 : 2; }

/* Letters to put in, take out or change, to make one word of the other; many for long words. */
static std::size_t letters_apart(const std::string &one, const std::string &other) {
  std::array<std::size_t, 32> row;
  if (other.size() >= row.size()) {
    return row.size();
  }
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < one.size(); i++) {
    std::size_t diagonal = row[0]++;
    for (std::size_t j = 0; j < other.size(); j++) {
      const std::size_t changed = diagonal + (one[i] != other[j]);
      diagonal = row[j + 1];
      row[j + 1] = std::min({changed, row[j + 1] + 1, row[j] + 1});
    }
  }
  return row[other.size()];
}

template <typename Value>
static CLI::Option *with_choice(CLI::App *command, const std::string &option, const std::map<std::string, Value> &values,
                                const std::string &allowed, Value &value, const std::string &help) {
  return command->add_option_function<std::string>(
      option,
      [=, &value](const std::string &text) {
        const auto found = values.find(text);
        if (found == values.end()) {
          wrong_value(option, text, allowed);
        }
        value = found->second;
      },
      help);
}

CommandLine::CommandLine(const std::string &description, const std::string &version) : app_(description, "fingertip") {
  app_.set_version_flag("--version", [version] {
    const std::string note = page_note(version);
    return "fingertip " + version + (note.empty() ? "" : "\n" + note);
  });
  app_.require_subcommand(1);
  speak_plainly(app_);
}

CLI::App *CommandLine::add(const std::string &name, const std::string &text, std::function<int()> run) {
  CLI::App *command = app_.add_subcommand(name, text);
  command->callback([this, run = std::move(run)] { chosen_ = run; });
  return command;
}

int CommandLine::run(int argc, char **argv) {
  std::string meant;
  bool is_known = false;
  std::size_t nearest = argc > 1 ? letters_mistyped(std::string(argv[1]).size()) + 1 : 0;
  const auto commands = app_.get_subcommands([](const CLI::App *) { return true; });
  for (const CLI::App *command : commands) {
    const std::size_t apart = argc > 1 ? letters_apart(argv[1], command->get_name()) : nearest;
    is_known = is_known || apart == 0;
    if (apart < nearest) {
      nearest = apart;
      meant = command->get_name();
    }
  }
  if (argc < 2 || (argv[1][0] != '-' && !is_known)) {
    if (!meant.empty()) {
      throw WrongUsage("\"" + std::string(argv[1]) + "\" is no command; is " + meant + " meant? see fingertip --help");
    }
    throw WrongUsage((argc < 2 ? "a command is missing" : "\"" + std::string(argv[1]) + "\" is no command") + "; give one of " +
                     joined(commands, ", ", [](const CLI::App *command) { return command->get_name(); }) + "; see fingertip --help");
  }
  try {
    app_.parse(argc, argv);
  } catch (const CLI::ParseError &error) {
    return app_.exit(error) == 0 ? 0 : 2;
  }
  for (const CLI::Option *option : app_.get_subcommands().front()->get_options()) {
    const auto given = option->results();
    if (std::find(given.begin(), given.end(), "") != given.end()) {
      throw WrongUsage(option->get_name() + " takes a text, and this one is empty; see fingertip --help");
    }
  }
  catch_signals();
  return chosen_();
}

void check_recording(const std::string &path, bool overwrite) {
  const auto end = std::filesystem::path(path).extension();
  if (!end.empty() && end != ".csv" && end != ".CSV" && !is_mcap_name(path)) {
    throw WrongUsage("\"" + printable(path) + "\" must end with .csv or .mcap, which selects the format");
  }
  check_output(path, overwrite);
}

void with_transport(CLI::App *command, TransportKind &transport) {
  using Kind = TransportKind;
  with_choice<Kind>(command, "--transport",
                    {{"auto", Kind::automatic}, {"socket", Kind::socket}, {"serial", Kind::serial}, {"usb", Kind::usb}},
                    "auto, socket, serial or usb", transport,
                    "socket (of fingertip serve), serial, usb (libusb, past the system's driver), or auto: the first that there is")
      ->type_name("KIND");
}

void with_port_only(CLI::App *command, Choice &choice) {
  with_value(command, "PATH", "--port", choice.port, "Serial port or pseudo-terminal; default: $FINGERTIP_PORT, or a fingertip plugged in");
  with_transport(command, choice.transport);
}

void with_port(CLI::App *command, Choice &choice) {
  with_value(command, "SERIAL", "--device", choice.device, "Serial number of the fingertip; default: the only one there is");
  with_port_only(command, choice);
}

void with_seconds(CLI::App *command, std::optional<double> &seconds, const std::string &help) {
  with_number(
      command, "--seconds", 0.001, 1e9, "a number from 0.001 to 1e9", [&seconds](double value) { seconds = value; }, help)
      ->type_name("S");
}

void with_colour(CLI::App *command, ColourMode &mode) {
  with_choice<ColourMode>(command, "--colour",
                          {{"auto", ColourMode::automatic},
                           {"truecolour", ColourMode::truecolour},
                           {"256", ColourMode::palette_256},
                           {"plain", ColourMode::plain}},
                          "auto, truecolour, 256 or plain", mode, "auto, truecolour, 256, or plain: a line a second")
      ->type_name("MODE");
}

CLI::Option *with_number(CLI::App *command, const std::string &option, double low, double high, const std::string &allowed,
                         std::function<void(double)> set, const std::string &help) {
  return command->add_option_function<std::string>(
      option,
      [=](const std::string &text) {
        const auto value = to_double(text);
        if (!value || *value < low || *value > high) {
          wrong_value(option, text, allowed);
        }
        set(*value);
      },
      help);
}

void wrong_value(const std::string &option, const std::string &text, const std::string &allowed) {
  throw CLI::ValidationError(option + " \"" + text + "\" is not possible; give " + allowed);
}

} // namespace fingertip
