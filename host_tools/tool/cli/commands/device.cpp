/* Commands that find fingertips and talk to one: list, info, set, tare, pad, loader, and the udev rule for them. */
#include "libfingertip/command.hpp"
#include "libfingertip/connection.hpp"
#include "libfingertip/names.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/progress_bar.hpp"
#include "libfingertip/session.hpp"
#include "libfingertip/text.hpp"
#include "library/pad/edges.hpp"
#include "library/pad/profile.hpp"
#include "library/pad/table_file.hpp"
#include "tool/advice.hpp"
#include "tool/cli/canvas.hpp"
#include "tool/cli/command_line.hpp"
#include "tool/cli/names_of_values.hpp"
#include "tool/cli/terminal.hpp"

#include <cstdio>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace fingertip {

extern const char *const UDEV_RULE; /* the text of 60-fingertip.rules */

namespace {

/* "socket /run/fingertip/E66..2C.sock, serial /dev/ttyACM0, usb 001/005" */
std::string reached_text(const Found &found) {
  char place[32] = "";
  if (found.usb) {
    std::snprintf(place, sizeof place, "usb %03u/%03u", found.usb->bus, found.usb->address);
  }
  return joined(std::vector<std::string>{found.socket.empty() ? "" : "socket " + found.socket,
                                         found.port.empty() ? "" : (found.usb ? "serial " : "port ") + found.port, place},
                ", ");
}

int list(TransportKind transport) {
  FoundDevices devices = find_fingertips();
  std::vector<Found> all = devices.here;
  all.insert(all.end(), devices.in_environment.begin(), devices.in_environment.end());
  if (all.empty()) {
    throw Error(ErrorCode::no_fingertip, "no fingertip found");
  }
  for (const Found &found : all) {
    Metadata info = {{"serial", found.serial}};
    std::string reached = reached_text(found);
    try {
      auto endpoint = endpoint_of(found, transport);
      if (endpoint) {
        info = info_metadata(ask(*endpoint, stop_requested));
      }
    } catch (const Error &error) {
      reached += " (" + error_text(error) + ")";
    }
    for (const char *key : {"serial", "board", "firmware"}) {
      const std::string value = value_of(info, key);
      std::printf("%s\t", value.empty() ? "-" : printable(value).c_str());
    }
    std::printf("%s\n", printable(reached).c_str());
  }
  return 0;
}

/* A fingertip answers within milliseconds, one that starts within a second. */
constexpr std::int64_t SILENCE_us = 1500000;

/* Whether to stop; reports once that the fingertip has not answered. */
std::function<bool()> patience(const Transport &transport, const Session &session) {
  return [&transport, &session, begun_us = steady_now_us(), reported = false]() mutable {
    if (!reported && session.statistics().bytes == 0 && steady_now_us() - begun_us > SILENCE_us) {
      reported = true;
      std::fprintf(stderr, "%s: waiting for an answer\n", printable(transport.description()).c_str());
    }
    return stop_requested();
  };
}

/* A fingertip with a session on it. Reports on standard error if it waits long for an answer; the signals end it. */
struct Device {
  std::unique_ptr<Transport> transport;
  Session session;

  explicit Device(const Choice &choice)
      : transport(open_endpoint(choose_endpoint(choice))), session(*transport, patience(*transport, session)) {}
};

/* Whether the firmware has what it belongs to, and no other table shows it. */
bool is_shown(const std::string &key, std::uint32_t capabilities) {
  static const std::set<std::string> of_sensors = {"gains", "gain_sds", "off_x_um", "off_y_um", "wider_q15"};
  auto begins = [&](const char *with) { return key.rfind(with, 0) == 0; };
  const bool of_fit = begins("fit_") || begins("prior_") || begins("location_");
  return !of_sensors.count(key) && (!begins("slip_") || (capabilities & WIRE_CAPABILITY_SLIP)) &&
         (!of_fit || (capabilities & WIRE_CAPABILITY_FIT));
}

void print(const std::string &key, const std::string &value) { std::printf("%-24s%s\n", key.c_str(), value.c_str()); }

int info(const Choice &choice) {
  Device device(choice);
  wire_info info = device.session.info().body.info;
  wire_health health = device.session.health().body.health;
  const Metadata pairs = info_metadata(info);
  print("port", printable(device.transport->description()));
  for (const auto &[key, value] : pairs) {
    if (is_shown(key, info.capabilities)) {
      print(key, key == "capabilities"                     ? capabilities_text(info.capabilities)
                 : key == "streams"                        ? streams_text(info.streams)
                 : key == "stored"                         ? stored_text(info.stored)
                 : key == "calibration_date_s"             ? value + " (" + date_text(info.calibration.date_s) + ")"
                 : key == "rate_mHz" && info.rate_mHz == 0 ? rate_text(info.rate_mHz)
                                                           : value);
    }
  }
  std::printf("\n");
  for (const auto &[key, value] : health_fields(health)) {
    const std::string bad = sensors_text(health.sensors_prom_bad);
    if (key != "capabilities" && is_shown(key, info.capabilities)) { /* the former is above */
      print(key, key == "sensors_present"    ? present_text(value, info.sensor_count)
                 : key == "sensors_prom_bad" ? (bad.empty() ? "none" : bad)
                                             : std::to_string(value));
    }
  }
  const std::string firmware = value_of(pairs, "firmware");
  if (firmware != FINGERTIP_VERSION) {
    std::printf("\nits firmware is of version %s, this tool of version " FINGERTIP_VERSION
                "; install this tool's with `fingertip flash`, or use the other's tool\n",
                printable(firmware).c_str());
  }
  if (info.stored & WIRE_STORED_CALIBRATION) {
    print_gains(info.calibration, info.sensor_count);
  }
  if (info.stored & WIRE_STORED_DAMAGED) {
    std::printf("\nwhat it had stored cannot be read and is not used; calibrate again, or set --keep\n");
  }
  return 0;
}

struct SetOptions {
  Choice choice;
  std::vector<std::string> settings;
  bool keep = false, forget = false;
};

int set(const SetOptions &options) {
  const auto wanted = typed([&] {
    std::vector<WantedSetting> all;
    for (const std::string &text : options.settings) {
      const WantedSetting one = setting_from_text(text);
      if (find_in(all, [&](const WantedSetting &other) { return other.setting == one.setting; })) {
        throw Error(text + ": is set twice; set it once");
      }
      all.push_back(one);
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

struct TareOptions {
  Choice choice;
  bool force = false;
};

/* Follows the frames around the command. */
class Tare {
public:
  explicit Tare(Device &device) : device_(device) {
    device.session.on_packet([this](const wire_packet &packet) { take(packet); });
  }

  void run(bool force) {
    try {
      device_.session.command(command_tare(force));
    } catch (const Error &error) {
      if (error.code() != ErrorCode::not_now) {
        throw;
      }
      wait_for([this] { return frames_ > 0; });
      if (!(flags_ & CONTACT_FLAG_CONTACT)) {
        throw;
      }
      throw Error("not tared, it reports a contact" + force_text() + "; let go of the pad, or --force where nothing touches it");
    }
    wait_for([this] { return tared_; });
  }

private:
  void take(const wire_packet &packet) {
    if (packet.type == WIRE_ACK && packet.body.ack.command == WIRE_CMD_TARE) {
      acknowledged_ = true;
    } else if (is_frame(packet)) {
      flags_ = flags_of(packet);
      force_N_ = packet.type == WIRE_CONTACT ? packet.body.contact.force_N : force_N_;
      last_frame_us_ = steady_now_us();
      frames_++;
      tared_ = acknowledged_ && (flags_ & CONTACT_FLAG_TARED);
    }
  }

  std::string force_text() const { return force_N_ > 0 ? " of " + fixed(force_N_, 2) + " N" : ""; }

  template <typename Condition> void wait_for(Condition condition) {
    constexpr std::int64_t patience_us = 12000000; /* the slowest frame rate is one in 10 s */
    while (!condition()) {
      if (stop_requested()) {
        throw Interrupted();
      }
      if (device_.session.poll(std::chrono::milliseconds(50)) == Transport::Result::gone) {
        throw Gone(device_.transport->description() + ": vanished while taring");
      }
      if (steady_now_us() - last_frame_us_ > patience_us) {
        throw Error("no frames while taring; see that its sensors answer (fingertip info)");
      }
    }
  }

  Device &device_;
  std::int64_t last_frame_us_ = steady_now_us();
  std::uint32_t flags_ = 0;
  float force_N_ = 0;
  int frames_ = 0;
  bool acknowledged_ = false, tared_ = false;
};

int tare(const TareOptions &options) {
  Device device(options.choice);
  wire_info info = device.session.info().body.info;
  Tare taring(device);
  device.session.command(command_stream(possible_streams(info, WIRE_STREAM_CONTACT | WIRE_STREAM_RAW)));
  taring.run(options.force);
  device.session.command(command_stream(0));
  std::printf("tared\n");
  return 0;
}

struct PadOptions {
  Choice choice;
  std::optional<double> thickness_mm;
  double overhang_mm = 0;
  bool from_touch = false, erase = false;
};

int erase_pad(Session &session) {
  session.command(command_erase_pad());
  std::printf("pad erased; no tangential force from now on\n");
  return 0;
}

// The thickness that the user sets, or that the fingertip's calibration found.
double thickness_mm(const PadOptions &options, const wire_info &info) {
  const bool calibrated = (info.stored & WIRE_STORED_CALIBRATION) != 0;
  const auto found = calibrated ? pad::thickness_of(info.calibration) : std::nullopt;
  if (options.thickness_mm) {
    const std::string other = found ? pad::disagreement(*found, *options.thickness_mm) : "";
    if (!other.empty()) {
      std::fprintf(stderr, "fingertip: %s\n", other.c_str());
    }
    return *options.thickness_mm;
  }
  if (!found) {
    throw WrongUsage("give --thickness MM of the pad's rubber, or calibrate first: that finds it");
  }
  if (!pad::profile_suits(*found)) {
    throw Error("the calibration's width is that of " + text_of(*found) +
                " of rubber; the tangential force is accurate enough on 9 to 20 mm");
  }
  std::printf("thickness found in the calibration: %s\n", text_of(*found).c_str());
  return found->shown_mm();
}

int pad_command(const PadOptions &options) {
  Device device(options.choice);
  Session &session = device.session;
  wire_info info = session.info().body.info;
  if (!(info.capabilities & WIRE_CAPABILITY_TANGENTIAL)) {
    throw Error("its firmware, of scene " + text_field(info.scene) + ", reports no tangential force; install one of scene grasp");
  }
  if (options.erase) {
    return erase_pad(session);
  }
  const pad::Shape shape{thickness_mm(options, info), options.overhang_mm, options.from_touch};
  pad_profile profile = typed([&] { return pad::profile_of(shape, info); });
  const bool ends = shape.overhang_mm >= pad::EDGE_OVERHANG_MIN_mm && shape.overhang_mm <= pad::EDGE_OVERHANG_MAX_mm;
  if (ends) {
    ProgressBar bar("the pad's ends");
    profile.edges =
        typed([&] { return pad::edges_of(profile, info, twin::default_cache_directory(), [&](double share) { bar.show(share); }); });
  }
  session.command(command_pad(profile));
  std::printf("thickness=%s overhang=%s%s%s force_ratio=%s kept\n", shortest(profile.thickness_mm).c_str(),
              profile.overhang_mm > 0 ? shortest(profile.overhang_mm).c_str() : "?", ends ? " ends" : "",
              profile.from_touch ? " from_touch" : "", number(profile.force_ratio, 3).c_str());
  if (shape.overhang_mm == 0) {
    std::fprintf(stderr, "fingertip: a pad without end, as there is no --overhang: where the rubber ends, location and "
                         "tangential force are off\n");
  }
  if (pad::edges_spoil_the_zero(shape) && !options.from_touch) {
    std::fprintf(stderr,
                 "fingertip: the rubber ends %s mm beyond the outer sensors, less than half its thickness, which "
                 "spoils the zero of the tangential force; --from-touch reports the change instead\n",
                 shortest(profile.overhang_mm).c_str());
  }
  return 0;
}

int loader(const Choice &choice) {
  Device device(choice);
  if (is_simulated(device.session.info().body.info)) {
    throw Error("a simulated fingertip has no USB loader; Ctrl-C ends `fingertip simulate`");
  }
  device.session.command(command_loader());
  std::printf("restarting into the USB loader: the drive RPI-RP2 takes a .uf2 file\n");
  return 0;
}

} // namespace

void add_list(CommandLine &line) {
  auto choice = std::make_shared<Choice>();
  with_transport(line.add("list",
                          "List the fingertips plugged in, and the paths in $FINGERTIP_PORT: serial number, board, "
                          "firmware, how it is reached",
                          [choice] { return list(choice->transport); }),
                 choice->transport);
}

void add_info(CommandLine &line) {
  auto choice = std::make_shared<Choice>();
  with_port(line.add("info", "Show identity, settings and health", [choice] { return info(*choice); }), *choice);
}

void add_set(CommandLine &line) {
  auto options = std::make_shared<SetOptions>();
  CLI::App *command =
      line.add("set", "Change settings until the next power-on, or for good with --keep", [options] { return set(*options); });
  with_port(command, options->choice);
  command->footer("Example: fingertip set rate=max osr=256");
  with_value(command, "KEY=VALUE", "settings", options->settings, settings_help());
  CLI::Option *keep = command->add_flag("--keep", options->keep, "Keep all present settings: the fingertip starts with them from now on");
  command->add_flag("--forget", options->forget, "Keep none: from its next start on it has the firmware's defaults")->excludes(keep);
}

void add_tare(CommandLine &line) {
  auto options = std::make_shared<TareOptions>();
  CLI::App *tare_command =
      line.add("tare", "Measure the zero of every sensor; nothing may touch the pad", [options] { return tare(*options); });
  with_port(tare_command, options->choice);
  tare_command->add_flag("--force", options->force, "Tare even if a contact is reported, though nothing touches the pad");
}

void add_pad(CommandLine &line) {
  auto options = std::make_shared<PadOptions>();
  CLI::App *command = line.add("pad", "Set the pad's profile, for the tangential force (the fingertip keeps it without power)",
                               [options] { return pad_command(*options); });
  with_port(command, options->choice);
  CLI::Option *thickness = with_value(command, "MM", "--thickness", options->thickness_mm,
                                      "Thickness of the rubber above the sensors; the tangential force is not accurate enough on less. "
                                      "Default: as the calibration found it")
                               ->check(within(pad::THINNEST_mm, double{PAD_THICKNESS_MAX_mm}));
  CLI::Option *overhang = with_value(command, "MM", "--overhang", options->overhang_mm,
                                     "How far the rubber extends beyond the outer sensors; from 3 to 20 mm the effect of the ends is "
                                     "computed and subtracted. Default: a pad without end")
                              ->check(within(0.0, double{PAD_OVERHANG_MAX_mm}));
  CLI::Option *from_touch = command->add_flag("--from-touch", options->from_touch,
                                              "Report the change since the first 100 ms of each contact: for pads "
                                              "whose rubber ends within half its thickness of the outer sensors");
  command->add_flag("--erase", options->erase, "Erase the pad's profile: no tangential force")
      ->excludes(thickness)
      ->excludes(overhang)
      ->excludes(from_touch);
}

void add_loader(CommandLine &line) {
  auto choice = std::make_shared<Choice>();
  with_port(line.add("loader", "Restart into the USB loader, to install firmware", [choice] { return loader(*choice); }), *choice);
}

void add_rule(CommandLine &line) {
  line.add("rule", "Print the udev rule that lets users without privileges open fingertips", [] {
    std::fputs(UDEV_RULE, stdout);
    return 0;
  });
}

} // namespace fingertip
