#include "libfingertip/command.hpp"
#include "tool/cli/command_line.hpp"
#include "tool/cli/device.hpp"

#include <cstdio>
#include <memory>
#include <string>
#include <vector>

namespace fingertip {

namespace {

struct SetOptions {
  Choice choice;
  std::vector<std::string> settings;
  bool keep = false, forget = false;
};

int set(const SetOptions &options) {
  const auto wanted = typed([&] {
    std::vector<WantedSetting> all;
    for (const std::string &text : options.settings) {
      all.push_back(setting_from_text(text));
    }
    return all;
  });
  if (options.settings.empty() && !options.keep && !options.forget) {
    throw WrongUsage("nothing to set; give settings, --keep or --forget; see fingertip set --help");
  }
  Device device(options.choice);
  Session &session = device.session;
  for (const wire_packet &command : setting_commands(wanted, session.info().body.info)) {
    session.command(command);
  }
  if (options.keep || options.forget) {
    session.command(command_keep(options.keep));
  }
  wire_info info = session.info().body.info;
  std::printf("%s%s\n", settings_text(info).c_str(), info.stored & WIRE_STORED_SETTINGS ? " kept" : "");
  return 0;
}

} // namespace

void add_set(CommandLine &line) {
  auto options = std::make_shared<SetOptions>();
  CLI::App *command = line.add("set", "Change settings until the next power-on, or for good with --keep",
                               [options] { return set(*options); });
  with_port(command, options->choice);
  command->add_option("settings", options->settings, settings_help())->type_name("KEY=VALUE");
  CLI::Option *keep = command->add_flag("--keep", options->keep,
                                        "Keep all present settings: the fingertip starts with them from now on");
  command->add_flag("--forget", options->forget, "Keep none: from its next start on it has the firmware's defaults")
      ->excludes(keep);
}

} // namespace fingertip
