#include "libfingertip/clock.hpp"
#include "libfingertip/share_socket.hpp"
#include "libfingertip/text.hpp"
#include "library/share/server.hpp"
#include "tool/advice.hpp"
#include "tool/cli/command_line.hpp"

#include <chrono>
#include <cstdio>
#include <exception>
#include <grp.h>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

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

/* By what they prevent from being served; last: of the last look. */
struct Errors {
  std::map<std::string, std::string> texts;
  std::exception_ptr last;
};

/* Serves a fingertip unless it is served; one that cannot be keeps none of the others. */
template <typename FindEndpoint> void serve_if_there(Server &server, Errors &errors, const std::string &name, FindEndpoint find_endpoint) {
  try {
    const std::optional<Endpoint> endpoint = find_endpoint();
    if (endpoint && !server.has(*endpoint)) {
      server.add(*endpoint);
    }
    errors.texts.erase(name);
  } catch (const Error &error) {
    errors.last = std::current_exception();
    if (!server.is_empty() && std::exchange(errors.texts[name], error.what()) != error.what()) {
      print_line(error_text(error));
    }
  }
}

/* Those that are there now, also plugged in later: all, or those that are named. Throws Error: none of them can be. */
void look(Server &server, const ServeOptions &options, Errors &errors) {
  std::map<std::string, int> serials;
  for (const Found &found : options.devices.empty() && options.choice.port.empty() ? find_usb() : std::vector<Found>()) {
    serve_if_there(server, errors, found.serial + "/" + std::to_string(serials[found.serial]), [&] {
      if (serials[found.serial]++) {
        throw Error(found.serial + ": another fingertip has this serial number, and one of them is shared");
      }
      return endpoint_of(found, options.choice.transport);
    });
  }
  for (const std::string &each : options.devices) {
    serve_if_there(server, errors, each, [&] {
      return std::optional(choose_endpoint({options.choice.port, each, options.choice.transport}));
    });
  }
}

int serve(const ServeOptions &options) {
  Server server({options.common ? COMMON_SHARE_FOLDER : own_share_folder(), options.group}, print_line);
  const bool is_one_port = options.devices.empty() && !options.choice.port.empty();
  Errors errors;
  if (is_one_port) {
    server.add(choose_endpoint(options.choice));
  } else if (options.devices.empty()) {
    for (const Endpoint &endpoint : all_endpoints(options.choice.transport)) {
      serve_if_there(server, errors, endpoint.port, [&] { return std::optional(endpoint); });
    }
  }
  look(server, options, errors);
  if (server.is_empty() && errors.last) {
    std::rethrow_exception(errors.last);
  }
  look(server, options, errors); /* reports those that are not served */
  if (server.is_empty()) {
    print_line("no fingertip here yet; each that is plugged in will be shared");
  }
  HostTime searched = host_now();
  while (!stop_requested()) {
    server.step(DEVICE_LOOK_INTERVAL);
    if (!is_one_port && host_now() - searched > DEVICE_LOOK_INTERVAL) {
      searched = host_now();
      look(server, options, errors);
    }
  }
  return 0;
}

} // namespace

void add_serve(CommandLine &line) {
  auto options = std::make_shared<ServeOptions>();
  CLI::App *command =
      line.add("serve", "Share fingertips with every program that uses them, until Ctrl-C", [options] { return serve(*options); });
  command->add_option("--device", options->devices, "Serial number of a fingertip to share; default: all, also those plugged in later")
      ->take_all()
      ->expected(1)
      ->type_name("SERIAL");
  with_port_only(command, options->choice);
  command
      ->add_option_function<std::string>(
          "--group", [options](const std::string &name) { options->group = group_of(name); },
          "Who may use them beside this user; default: this user's group")
      ->type_name("NAME");
  command->add_flag("--common", options->common, "Share in /run/fingertip, where all users look, instead of in this user's folder");
}

} // namespace fingertip
