#include "libfingertip/clock.hpp"
#include "libfingertip/share_socket.hpp"
#include "libfingertip/text.hpp"
#include "library/share/server.hpp"
#include "tool/advice.hpp"
#include "tool/cli/command_line.hpp"

#include <chrono>
#include <cstdio>
#include <grp.h>
#include <map>
#include <memory>
#include <optional>

namespace fingertip {

namespace {

struct ServeOptions {
  Choice choice; /* without the device */
  std::vector<std::string> devices;
  std::optional<gid_t> group;
  bool common = false;
};

constexpr std::chrono::milliseconds DEVICE_LOOK_INTERVAL{1000};

void print_line(const std::string &line) { std::fprintf(stderr, "%s\n", printable(line).c_str()); }

gid_t group_of(const std::string &name) {
  const group *found = getgrnam(name.c_str());
  if (!found) {
    wrong_value("--group", name, "the name of a group (getent group)");
  }
  return found->gr_gid;
}

/* Serves fingertips that are plugged in later; an error that prevents this is printed once: errors has it by serial
 * number. */
void look(Server &server, Reach reach, std::map<std::string, std::string> &errors) {
  for (const Found &found : find_usb()) {
    auto way = way_to(found, reach);
    if (!way || server.has(*way)) {
      continue;
    }
    try {
      server.add(*way);
      errors.erase(found.serial);
    } catch (const Error &error) {
      if (errors[found.serial] != error.what()) {
        errors[found.serial] = error.what();
        print_line(error_text(error));
      }
    }
  }
}

int serve(const ServeOptions &options) {
  Server server({options.common ? COMMON_SHARE_FOLDER : own_share_folder(), options.group}, print_line);
  bool all = options.devices.empty() && options.choice.port.empty();
  std::map<std::string, std::string> errors;
  if (all) {
    for (const Way &way : all_ways(options.choice.reach)) {
      server.add(way);
    }
  }
  for (const std::string &device : options.devices) {
    server.add(choose_way({options.choice.port, device, options.choice.reach}));
  }
  if (!all && options.devices.empty()) {
    server.add(choose_way(options.choice));
  }
  if (server.is_empty()) {
    print_line("no fingertip here yet; each that is plugged in will be shared");
  }
  HostTime searched = host_now();
  while (!stop_requested()) {
    server.step(DEVICE_LOOK_INTERVAL);
    if (all && host_now() - searched > DEVICE_LOOK_INTERVAL) {
      searched = host_now();
      look(server, options.choice.reach, errors);
    }
  }
  return 0;
}

} // namespace

void add_serve(CommandLine &line) {
  auto options = std::make_shared<ServeOptions>();
  CLI::App *command = line.add("serve", "Share fingertips with every program that uses them, until Ctrl-C",
                               [options] { return serve(*options); });
  command
      ->add_option("--device", options->devices,
                   "Serial number of a fingertip to share; default: all, also those plugged in later")
      ->take_all()
      ->expected(1)
      ->type_name("SERIAL");
  with_port_only(command, options->choice);
  command
      ->add_option_function<std::string>(
          "--group", [options](const std::string &name) { options->group = group_of(name); },
          "Who may use them beside this user; default: this user's group")
      ->type_name("NAME");
  command->add_flag("--common", options->common,
                    "Share in /run/fingertip, where all users look, instead of in this user's folder");
}

} // namespace fingertip
