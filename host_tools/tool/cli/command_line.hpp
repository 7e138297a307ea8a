/* The command line: its commands, and the options that several of them have. */
#pragma once

#include "libfingertip/connection.hpp"
#include "libfingertip/error.hpp"
#include "tool/cli/terminal.hpp"

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

namespace fingertip {

/* What was typed and cannot be meant: exit status 2. */
class WrongUsage : public Error {
public:
  using Error::Error;
};

/* Whatever the parser throws is wrong usage. */
template <typename Parse> auto typed(Parse parse) {
  try {
    return parse();
  } catch (const Error &error) {
    throw WrongUsage(error.code(), error.what());
  }
}

class CommandLine {
public:
  CommandLine(const std::string &description, const std::string &version);

  /* run: the exit status; called once everything was parsed. */
  CLI::App *add(const std::string &name, const std::string &text, std::function<int()> run);

  /* Exit status. Throws Error, WrongUsage, and whatever the command throws. */
  int run(int argc, char **argv);

private:
  CLI::App app_;
  std::function<int()> chosen_;
};

/* Of a recording that is to be written. Throws Error, and WrongUsage for an ending of another format. */
void check_recording(const std::string &path, bool overwrite);

/* --transport; --port too; --device too. */
void with_transport(CLI::App *command, TransportKind &transport);
void with_port_only(CLI::App *command, Choice &choice);
void with_port(CLI::App *command, Choice &choice);
/* --seconds, until the end. */
void with_seconds(CLI::App *command, std::optional<double> &seconds, const std::string &help);
void with_colour(CLI::App *command, ColourMode &mode);

/* An option with a value, and what the help calls that; arguments: as add_option has them. */
template <typename... Arguments> CLI::Option *with_value(CLI::App *command, const char *kind, Arguments &&...arguments) {
  return command->add_option(std::forward<Arguments>(arguments)...)->type_name(kind);
}

/* A number from low to high; allowed: how the error states them. */
CLI::Option *with_number(CLI::App *command, const std::string &option, double low, double high, const std::string &allowed,
                         std::function<void(double)> set, const std::string &help);

/* Where an option's text is no value of it. */
[[noreturn]] void wrong_value(const std::string &option, const std::string &text, const std::string &allowed);

/* The commands; each adds itself. */
void add_list(CommandLine &line);
void add_info(CommandLine &line);
void add_doctor(CommandLine &line);
void add_monitor(CommandLine &line);
void add_record(CommandLine &line);
void add_replay(CommandLine &line);
void add_convert(CommandLine &line);
void add_grasp(CommandLine &line);
void add_simulate(CommandLine &line);
void add_serve(CommandLine &line);
void add_web(CommandLine &line);
void add_tare(CommandLine &line);
void add_calibrate(CommandLine &line);
void add_validate(CommandLine &line);
void add_fit(CommandLine &line);
void add_pad(CommandLine &line);
void add_set(CommandLine &line);
void add_loader(CommandLine &line);
void add_gripper(CommandLine &line);
void add_flash(CommandLine &line);
void add_rule(CommandLine &line);

} // namespace fingertip
