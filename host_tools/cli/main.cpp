/* fingertip: the command line tool. Exit status: 0 done; 1 something went wrong, said in one line;
 * 2 wrong usage. */
#include "cli/calibrate.hpp"
#include "cli/flash.hpp"
#include "cli/gains.hpp"
#include "cli/joint.hpp"
#include "cli/live.hpp"
#include "cli/replay.hpp"
#include "cli/rule.hpp"
#include "libfingertip/command.hpp"
#include "libfingertip/connection.hpp"
#include "libfingertip/names.hpp"
#include "libfingertip/recording.hpp"
#include "libfingertip/session.hpp"
#include "libfingertip/text.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <bitset>
#include <cstdio>
#include <map>

namespace {

using namespace fingertip;

constexpr std::uint8_t SHOWN_STREAMS = WIRE_STREAM_ALL;

/* Exit status 2. */
class WrongUsage : public Error {
public:
  using Error::Error;
};

/* What was typed is wrong, whatever the reason. */
template <typename Parse> auto typed(Parse parse) {
  try {
    return parse();
  } catch (const Error &error) {
    throw WrongUsage(error.what());
  }
}

struct Options {
  Choice choice;
  std::vector<std::string> devices; /* to record together */
  bool all = false;
  LiveOptions live;
  ReplayOptions replay;
  FlashOptions flash;
  CalibrateOptions calibrate;
  std::vector<std::string> settings;
  bool keep = false, forget = false;
  std::vector<std::string> encode;
  unsigned sequence = 0;
  std::uint64_t time_us = 0;
};

/* A fingertip with a session on it. */
struct Device {
  std::unique_ptr<Transport> transport;
  Session session;
  explicit Device(const Choice &choice)
      : transport(open_way(choose_way(choice))), session(*transport, stop_requested) {}
};

void print_pairs(const Metadata &pairs) {
  for (const auto &[key, value] : pairs) {
    std::printf("%-24s%s\n", key.c_str(), value.c_str());
  }
}

/* "serial /dev/ttyACM0, usb 001/005" */
std::string reached_text(const Found &found) {
  std::string text = found.port.empty() ? "" : (found.usb ? "serial " : "port ") + found.port;
  if (found.usb) {
    char place[32];
    std::snprintf(place, sizeof place, "usb %03u/%03u", found.usb->bus, found.usb->address);
    text += (text.empty() ? "" : ", ") + std::string(place);
  }
  return text;
}

int list(const Options &options) {
  std::vector<Found> all = find_usb();
  for (const Found &found : find_in_environment()) {
    all.push_back(found);
  }
  if (all.empty()) {
    throw Error("no fingertip found; plug one in, or name its port in FINGERTIP_PORT");
  }
  for (const Found &found : all) {
    Metadata info = {{"serial", found.serial}, {"board", ""}, {"scene", ""}, {"firmware", ""}};
    std::string reached = reached_text(found);
    try {
      auto way = way_to(found, options.choice.reach);
      if (way) {
        info = info_metadata(ask(*way, stop_requested));
      }
    } catch (const Error &error) {
      reached += " (" + std::string(error.what()) + ")";
    }
    for (const char *key : {"serial", "board", "firmware"}) {
      auto pair = std::find_if(info.begin(), info.end(), [&](auto &p) { return p.first == key; });
      std::printf("%s\t", pair->second.empty() ? "-" : printable(pair->second).c_str());
    }
    std::printf("%s\n", printable(reached).c_str());
  }
  return 0;
}

/* "3 7": the sensors of these bits; "" for none. */
std::string sensors_text(std::uint32_t sensors) {
  std::string text;
  for (int k = 0; k < FT_MAX_SENSORS; k++) {
    if (sensors >> k & 1u) {
      text += (text.empty() ? "" : " ") + std::to_string(k);
    }
  }
  return text;
}

std::string present_text(std::uint32_t present, std::uint8_t sensor_count) {
  std::uint32_t all = (1u << sensor_count) - 1u;
  std::string missing = sensors_text(all & ~present);
  return std::to_string(std::bitset<32>(present & all).count()) + " of " +
         std::to_string(sensor_count) + (missing.empty() ? "" : ", missing: " + missing);
}

std::string rate_text(std::uint32_t rate_mHz) {
  return rate_mHz ? fixed(rate_mHz / 1000.0, 3) : "max";
}

/* What belongs to a capability that the firmware lacks. */
void leave_out_missing(Metadata &pairs, std::uint32_t capabilities) {
  auto is_missing = [&](const std::pair<std::string, std::string> &pair) {
    bool of_slip = pair.first.rfind("slip_", 0) == 0;
    bool of_fit = pair.first.rfind("fit_", 0) == 0 || pair.first.rfind("prior_", 0) == 0 ||
                  pair.first.rfind("location_", 0) == 0;
    return (of_slip && !(capabilities & WIRE_CAPABILITY_SLIP)) ||
           (of_fit && !(capabilities & WIRE_CAPABILITY_FIT));
  };
  pairs.erase(std::remove_if(pairs.begin(), pairs.end(), is_missing), pairs.end());
}

int info(const Options &options) {
  Device device(options.choice);
  wire_info info = device.session.info().body.info;
  wire_health health = device.session.health().body.health;
  Metadata pairs = info_metadata(info);
  auto is_of_sensors = [](const std::pair<std::string, std::string> &pair) {
    return pair.first == "gains" || pair.first == "gain_sds";
  };
  pairs.erase(std::remove_if(pairs.begin(), pairs.end(), is_of_sensors), pairs.end());
  pairs.insert(pairs.begin(), {"port", printable(device.transport->description())});
  for (auto &[key, value] : pairs) {
    if (key == "capabilities") {
      value = capabilities_text(info.capabilities);
    } else if (key == "streams") {
      value = streams_text(info.streams);
    } else if (key == "stored") {
      value = stored_text(info.stored);
    } else if (key == "calibration_date_s") {
      value += " (" + date_text(info.calibration.date_s) + ")";
    } else if (key == "rate_mHz" && info.rate_mHz == 0) {
      value = rate_text(info.rate_mHz);
    }
  }
  leave_out_missing(pairs, info.capabilities);
  print_pairs(pairs);
  std::printf("\n");
  Metadata counters;
  for (const auto &[key, value] : health_fields(health)) {
    if (key == "capabilities") {
      continue; // said above
    }
    std::string bad = sensors_text(health.sensors_prom_bad);
    counters.emplace_back(key, key == "sensors_present"    ? present_text(value, info.sensor_count)
                               : key == "sensors_prom_bad" ? (bad.empty() ? "none" : bad)
                                                           : std::to_string(value));
  }
  leave_out_missing(counters, info.capabilities);
  print_pairs(counters);
  if (info.stored & WIRE_STORED_CALIBRATION) {
    print_gains(info.calibration, info.sensor_count);
  }
  if (info.stored & WIRE_STORED_DAMAGED) {
    std::printf(
        "\nwhat it had stored cannot be read and is not used; calibrate anew, or set --keep\n");
  }
  return 0;
}

int tare(const Options &options) {
  Device device(options.choice);
  wire_info info = device.session.info().body.info;
  device.session.command(
      command_stream(possible_streams(info, WIRE_STREAM_CONTACT | WIRE_STREAM_RAW)));
  bool tared = false;
  bool acknowledged = false;
  std::int64_t last_frame_us = steady_now_us();
  device.session.on_packet([&](const wire_packet &packet) {
    if (packet.type == WIRE_ACK && packet.body.ack.command == WIRE_CMD_TARE) {
      acknowledged = true;
    } else if (packet.type == WIRE_CONTACT || packet.type == WIRE_RAW) {
      std::uint32_t flags =
          packet.type == WIRE_RAW ? packet.body.raw.flags : packet.body.contact.flags;
      last_frame_us = steady_now_us();
      tared = acknowledged && (flags & CONTACT_FLAG_TARED);
    }
  });
  device.session.command(command_tare());
  constexpr std::int64_t patience_us = 12000000; /* the slowest frame rate is one in 10 s */
  while (!tared) {
    if (stop_requested()) {
      throw Interrupted();
    }
    if (device.session.poll(std::chrono::milliseconds(50)) == Transport::Result::gone) {
      throw Error(device.transport->description() +
                  ": vanished while taring; plug it in and try again");
    }
    if (steady_now_us() - last_frame_us > patience_us) {
      throw Error("no frames while taring; see that its sensors answer (fingertip info)");
    }
  }
  device.session.command(command_stream(0));
  std::printf("tared\n");
  return 0;
}

/* Commands for "rate=20" and the like; slip settings share one command. */
struct Settings {
  std::optional<std::uint32_t> rate_mHz, osr, slip_window_ms;
  std::optional<float> slip_threshold_mm, limit_mm;
  std::optional<Prior> prior;
};

Settings parse_settings(const std::vector<std::string> &texts) {
  Settings settings;
  for (const std::string &text : texts) {
    std::size_t equals = text.find('=');
    std::string key = text.substr(0, equals);
    std::string value = equals == std::string::npos ? "" : text.substr(equals + 1);
    if (key == "rate") {
      settings.rate_mHz = rate_mHz_from_text(value);
    } else if (key == "osr") {
      settings.osr = osr_from_text(value);
    } else if (key == "slip_threshold") {
      settings.slip_threshold_mm = slip_threshold_mm_from_text(value);
    } else if (key == "slip_window") {
      settings.slip_window_ms = slip_window_ms_from_text(value);
    } else if (key == "prior") {
      settings.prior = prior_from_text(value);
    } else if (key == "limit") {
      settings.limit_mm = location_limit_mm_from_text(value);
    } else {
      throw Error("setting \"" + text +
                  "\" is unknown; give rate=HZ|max, osr=N, slip_threshold=MM, slip_window=MS, "
                  "prior=SIGMA[:WIDTH]|none or limit=MM");
    }
  }
  return settings;
}

int set(const Options &options) {
  Settings settings = typed([&] { return parse_settings(options.settings); });
  if (options.settings.empty() && !options.keep && !options.forget) {
    throw WrongUsage("nothing to set; give settings, --keep or --forget; see fingertip set --help");
  }
  Device device(options.choice);
  Session &session = device.session;
  if (settings.rate_mHz) {
    session.command(command_rate_mHz(*settings.rate_mHz));
  }
  if (settings.osr) {
    session.command(command_osr(*settings.osr));
  }
  if (settings.slip_threshold_mm || settings.slip_window_ms) {
    wire_info now = session.info().body.info;
    session.command(command_slip(settings.slip_threshold_mm.value_or(now.slip_threshold_mm),
                                 settings.slip_window_ms.value_or(now.slip_window_ms)));
  }
  if (settings.prior) {
    session.command(command_prior(settings.prior->sigma_mm, settings.prior->width_mm));
  }
  if (settings.limit_mm) {
    session.command(command_location_limit(*settings.limit_mm));
  }
  if (options.keep || options.forget) {
    session.command(command_keep(options.keep));
  }
  wire_info info = session.info().body.info;
  std::printf("rate=%s osr=%u", rate_text(info.rate_mHz).c_str(), info.osr);
  if (info.capabilities & WIRE_CAPABILITY_SLIP) {
    std::printf(" slip_threshold=%s slip_window=%u", shortest(info.slip_threshold_mm).c_str(),
                info.slip_window_ms);
  }
  if (info.capabilities & WIRE_CAPABILITY_FIT) {
    std::printf(" prior=%s limit=%s",
                prior_text({info.prior_sigma_mm, info.prior_width_mm}).c_str(),
                shortest(info.location_limit_mm).c_str());
  }
  std::printf("%s\n", info.stored & WIRE_STORED_SETTINGS ? " kept" : "");
  return 0;
}

int loader(const Options &options) {
  Device device(options.choice);
  device.session.command(command_loader());
  std::printf("restarting into the USB loader: the drive RPI-RP2 takes a .uf2 file\n");
  return 0;
}

wire_packet packet_from_words(const std::vector<std::string> &words) {
  struct Form {
    std::size_t arguments;
    std::string usage;
    std::function<wire_packet()> make;
  };
  auto word = [&](std::size_t i) { return words[i]; };
  const std::map<std::string, Form> forms = {
      {"stream",
       {1, "stream none|contact,raw,health",
        [&] { return command_stream(streams_from_text(word(1))); }}},
      {"tare", {0, "tare", command_tare}},
      {"rate", {1, "rate HZ|max", [&] { return command_rate_mHz(rate_mHz_from_text(word(1))); }}},
      {"osr", {1, "osr N", [&] { return command_osr(osr_from_text(word(1))); }}},
      {"slip",
       {2, "slip THRESHOLD_MM WINDOW_MS",
        [&] {
          return command_slip(slip_threshold_mm_from_text(word(1)),
                              slip_window_ms_from_text(word(2)));
        }}},
      {"info", {0, "info", command_info}},
      {"health", {0, "health", command_health}},
      {"loader", {0, "loader", command_loader}},
      {"prior",
       {1, "prior SIGMA[:WIDTH]|none",
        [&] {
          Prior prior = prior_from_text(word(1));
          return command_prior(prior.sigma_mm, prior.width_mm);
        }}},
      {"limit",
       {1, "limit MM",
        [&] { return command_location_limit(location_limit_mm_from_text(word(1))); }}},
      {"keep", {0, "keep", [] { return command_keep(true); }}},
      {"forget", {0, "forget", [] { return command_keep(false); }}},
      {"erase", {0, "erase", command_erase_calibration}},
  };
  auto form = forms.find(words[0]);
  if (form == forms.end()) {
    throw Error("command \"" + words[0] +
                "\" is unknown; give stream, tare, rate, osr, slip, prior, limit, keep, forget, "
                "erase, info, health or loader");
  }
  if (words.size() != 1 + form->second.arguments) {
    throw Error("wrong arguments; give: fingertip encode " + form->second.usage);
  }
  return form->second.make();
}

int encode(const Options &options) {
  wire_packet packet = typed([&] { return packet_from_words(options.encode); });
  packet.sequence = static_cast<std::uint16_t>(options.sequence);
  packet.t_us = options.time_us;
  std::printf("%s\n", hex(frame_bytes(packet)).c_str());
  return 0;
}

[[noreturn]] void wrong_value(const std::string &option, const std::string &text,
                              const std::string &allowed) {
  throw CLI::ValidationError(option + " \"" + text + "\" is not possible; give " + allowed);
}

double speed_from_text(const std::string &text) {
  if (text == "max") {
    return 0;
  }
  auto speed = to_double(text);
  if (!speed || *speed < 0.01 || *speed > 1000) {
    wrong_value("--speed", text, "0.01 to 1000, or max");
  }
  return *speed;
}

double seconds_from_text(const std::string &text) {
  auto seconds = to_double(text);
  if (!seconds || *seconds < 0.001 || *seconds > 1e9) {
    wrong_value("--seconds", text, "a number from 0.001 to 1e9");
  }
  return *seconds;
}

constexpr double GRAVITY_N_PER_g = 9.80665e-3;

double weight_N_from_text(const std::string &option, const std::string &text, double unit_N) {
  constexpr double LIGHTEST_N = 0.1, HEAVIEST_N = 50;
  auto weight = to_double(text);
  if (!weight || *weight * unit_N < LIGHTEST_N || *weight * unit_N > HEAVIEST_N) {
    wrong_value(option, text,
                fixed(LIGHTEST_N / unit_N, 1) + " to " + fixed(HEAVIEST_N / unit_N, 0));
  }
  return *weight * unit_N;
}

Reach reach_from_text(const std::string &text) {
  static const std::map<std::string, Reach> kinds = {
      {"auto", Reach::automatic}, {"serial", Reach::serial}, {"usb", Reach::usb}};
  auto kind = kinds.find(text);
  if (kind == kinds.end()) {
    wrong_value("--transport", text, "auto, serial or usb");
  }
  return kind->second;
}

ColourMode colour_from_text(const std::string &text) {
  static const std::map<std::string, ColourMode> colours = {{"auto", ColourMode::automatic},
                                                            {"truecolour", ColourMode::truecolour},
                                                            {"256", ColourMode::palette_256},
                                                            {"plain", ColourMode::plain}};
  auto mode = colours.find(text);
  if (mode == colours.end()) {
    wrong_value("--colour", text, "auto, truecolour, 256 or plain");
  }
  return mode->second;
}

int run(int argc, char **argv) {
  Options options;
  std::function<int()> action;
  CLI::App app("Talks to Fingertip tactile sensors: shows, records and replays what they feel.",
               "fingertip");
  app.set_version_flag("--version", "fingertip " FINGERTIP_VERSION);
  app.require_subcommand(1);
  app.failure_message([](const CLI::App *failed, const CLI::Error &error) {
    std::string command = "fingertip";
    for (const CLI::App *chosen : failed->get_subcommands()) {
      command += " " + chosen->get_name();
    }
    return printable("fingertip: " + std::string(error.what()) + "; see " + command + " --help") +
           "\n";
  });

  auto add = [&](const char *name, const char *text, std::function<int()> run_it) {
    CLI::App *command = app.add_subcommand(name, text);
    command->callback([&action, run_it] { action = run_it; });
    return command;
  };
  auto with_transport = [&](CLI::App *command) {
    command
        ->add_option_function<std::string>(
            "--transport",
            [&](const std::string &text) { options.choice.reach = reach_from_text(text); },
            "serial, usb (libusb, past the system's driver), or auto: serial where there is a port")
        ->type_name("KIND");
    return command;
  };
  auto with_port = [&](CLI::App *command, bool several = false) {
    if (several) {
      command
          ->add_option("--device", options.devices,
                       "Serial number of the fingertip; several record on one clock")
          ->take_all()
          ->expected(1)
          ->type_name("SERIAL");
    } else {
      command
          ->add_option("--device", options.choice.device,
                       "Serial number of the fingertip; default: the only one there is")
          ->type_name("SERIAL");
    }
    command
        ->add_option("--port", options.choice.port,
                     "Serial port or pseudo-terminal; default: $FINGERTIP_PORT, or a fingertip "
                     "plugged in")
        ->type_name("PATH");
    return with_transport(command);
  };
  auto with_colour = [](CLI::App *command, ColourMode &mode) {
    command
        ->add_option_function<std::string>(
            "--colour", [&mode](const std::string &text) { mode = colour_from_text(text); },
            "auto, truecolour, 256, or plain: a line a second")
        ->type_name("MODE");
  };
  auto with_recording = [&](CLI::App *command) {
    command
        ->add_option_function<std::string>(
            "--seconds",
            [&](const std::string &text) { options.live.seconds = seconds_from_text(text); },
            "End after this much device time")
        ->type_name("S");
    command
        ->add_option("--raw-bytes", options.live.raw_bytes,
                     "Also keep the bytes of the line as they came")
        ->type_name("FILE.ftr");
    command->add_flag("--overwrite", options.live.overwrite, "Replace files that exist");
    command->add_flag("--until-gone", options.live.until_gone,
                      "End when the port vanishes, instead of waiting for it");
  };
  auto live = [&](bool monitor) {
    if (monitor && options.live.recording == STANDARD_OUTPUT) {
      throw WrongUsage("monitor shows on standard output; give --record a file, or use "
                       "`fingertip record -`");
    }
    if (options.live.raw_bytes == STANDARD_OUTPUT) {
      throw WrongUsage("--raw-bytes needs a file; give it a name");
    }
    options.live.choice = options.choice;
    options.live.monitor = monitor;
    options.live.streams = SHOWN_STREAMS;
    return run_live(options.live);
  };

  auto record_them = [&] {
    if (options.live.recording == STANDARD_OUTPUT && (options.all || options.devices.size() > 1)) {
      throw WrongUsage("several fingertips need a file; for - run one `fingertip record - --device "
                       "SERIAL` for each");
    }
    std::vector<Way> ways;
    if (options.all) {
      ways = all_ways(options.choice.reach);
    } else if (options.devices.size() > 1) {
      for (const std::string &device : options.devices) {
        ways.push_back(choose_way({options.choice.port, device, options.choice.reach}));
      }
    }
    if (ways.empty()) {
      options.choice.device = options.devices.empty() ? "" : options.devices[0];
      return live(false);
    }
    options.live.streams = SHOWN_STREAMS;
    return run_joint(options.live, ways);
  };

  with_transport(add("list",
                     "List the fingertips plugged in, and the paths in $FINGERTIP_PORT: serial "
                     "number, board, firmware, how it is reached",
                     [&] { return list(options); }));
  with_port(add("info", "Show identity, settings and health", [&] { return info(options); }));

  CLI::App *monitor =
      with_port(add("monitor", "Show live what the fingertip feels", [&] { return live(true); }));
  with_recording(monitor);
  monitor->add_option("--record", options.live.recording, "Record at the same time")
      ->type_name("FILE.csv");
  with_colour(monitor, options.live.colour);

  CLI::App *record = with_port(add("record", "Record every frame to a CSV file, until Ctrl-C",
                                   [&] { return record_them(); }),
                               true);
  record->add_flag("--all", options.all, "Every fingertip there is, on one clock");
  record
      ->add_option("file", options.live.recording,
                   "The recording to write; -: standard output, each row as it comes")
      ->required()
      ->type_name("FILE.csv|-");
  with_recording(record);

  CLI::App *replay = add("replay", "Show a recording or a capture of bytes",
                         [&] { return run_replay(options.replay); });
  replay->add_option("file", options.replay.file, "Recording (.csv) or bytes of the line (.ftr)")
      ->required()
      ->type_name("FILE");
  replay
      ->add_option_function<std::string>(
          "--speed", [&](const std::string &text) { options.replay.speed = speed_from_text(text); },
          "Times the recorded speed, or max; default 1")
      ->type_name("X|max");
  replay
      ->add_option("--device", options.replay.device,
                   "Serial number of one of several fingertips in the recording")
      ->type_name("SERIAL");
  replay->add_flag("--salvage", options.replay.salvage, "Skip damaged lines and count them");
  replay->add_option("--to-csv", options.replay.to_csv, "Write a recording instead of showing it")
      ->type_name("OUT.csv");
  replay->add_flag("--overwrite", options.replay.overwrite, "Replace OUT.csv if it exists");
  with_colour(replay, options.replay.colour);

  with_port(add("tare", "Measure the zero of every sensor anew; nothing may touch the pad",
                [&] { return tare(options); }));
  CLI::App *calibrate = with_port(add(
      "calibrate", "Find the sensors' gains by setting down one weight at some twenty places", [&] {
        if (options.calibrate.dry_run && options.calibrate.from.empty()) {
          throw WrongUsage("--dry-run goes with --from; without, it asks before it writes");
        }
        options.calibrate.choice = options.choice;
        return run_calibrate(options.calibrate);
      }));
  CLI::Option *weight = calibrate
                            ->add_option_function<std::string>(
                                "--weight",
                                [&](const std::string &text) {
                                  options.calibrate.force_N =
                                      weight_N_from_text("--weight", text, GRAVITY_N_PER_g);
                                },
                                "The weight's, where it is known: then forces are calibrated too")
                            ->type_name("GRAMS");
  calibrate
      ->add_option_function<std::string>(
          "--force",
          [&](const std::string &text) {
            options.calibrate.force_N = weight_N_from_text("--force", text, 1.0);
          },
          "The same in newtons")
      ->excludes(weight)
      ->type_name("N");
  CLI::Option *from =
      calibrate
          ->add_option("--from", options.calibrate.from,
                       "From a recording of such placements, with pressures, instead of live")
          ->type_name("FILE.csv");
  CLI::Option *dry_run =
      calibrate->add_flag("--dry-run", options.calibrate.dry_run, "With --from: only show");
  CLI::Option *yes =
      calibrate->add_flag("--yes", options.calibrate.yes, "Write, or erase, without asking");
  CLI::Option *show =
      calibrate
          ->add_flag("--show", options.calibrate.show, "Show what the fingertip is calibrated by")
          ->excludes(weight, from, dry_run, yes);
  calibrate->add_flag("--erase", options.calibrate.erase, "Have it forget its calibration; it asks")
      ->excludes(weight, from, dry_run, show);
  with_colour(calibrate, options.calibrate.colour);
  CLI::App *set_command =
      with_port(add("set", "Change settings until the next power-on, or for good with --keep",
                    [&] { return set(options); }));
  set_command
      ->add_option("settings", options.settings,
                   "rate=HZ|max (0.1 to 2000), osr=256|512|1024|2048|4096|8192, slip_threshold=MM "
                   "(0.01 to 50), slip_window=MS (5 to 1000, and 160 frames at most), "
                   "prior=SIGMA[:WIDTH]|none (mm, 0.5 to 100, 0.01 to 100; width 0.5), limit=MM "
                   "(of location_sd_mm, 0.01 to 100)")
      ->type_name("KEY=VALUE");
  CLI::Option *keep = set_command->add_flag(
      "--keep", options.keep,
      "Keep all present settings: the fingertip starts with them from now on");
  set_command
      ->add_flag("--forget", options.forget,
                 "Keep none: from its next start on it has the firmware's own")
      ->excludes(keep);
  with_port(add("loader", "Restart into the USB loader, to install firmware",
                [&] { return loader(options); }));

  CLI::App *flash = with_port(add("flash", "Install firmware and see it come back", [&] {
    options.flash.choice = options.choice;
    return run_flash(options.flash);
  }));
  flash->add_option("image", options.flash.file, "The firmware, build/BOARD/fingertip-BOARD.uf2")
      ->required()
      ->type_name("IMAGE.uf2");
  flash
      ->add_option("--volume", options.flash.volume,
                   "Where the loader's drive RPI-RP2 is mounted; default: found, or mounted")
      ->type_name("FOLDER");
  add("rule", "Print the udev rule that lets users without privileges open fingertips", [] {
    std::fputs(UDEV_RULE, stdout);
    return 0;
  });

  CLI::App *encode_command = add("encode", "Print the frame of a command as hexadecimal digits",
                                 [&] { return encode(options); });
  encode_command
      ->add_option("command", options.encode,
                   "stream none|contact,raw,health; tare; rate HZ|max; osr N; slip THRESHOLD_MM "
                   "WINDOW_MS; prior SIGMA[:WIDTH]|none; limit MM; keep; forget; erase (the "
                   "calibration); info; health; loader")
      ->required()
      ->type_name("COMMAND [ARGS]");
  encode_command->add_option("--sequence", options.sequence, "Sequence number; default 0")
      ->check(CLI::Range(0, 65535))
      ->type_name("N");
  encode_command->add_option("--time", options.time_us, "Time of the header; default 0")
      ->type_name("US");

  std::string commands;
  bool is_known = false;
  for (const CLI::App *command : app.get_subcommands([](const CLI::App *) { return true; })) {
    commands += (commands.empty() ? "" : ", ") + command->get_name();
    is_known = is_known || (argc > 1 && command->get_name() == argv[1]);
  }
  if (argc < 2 || (argv[1][0] != '-' && !is_known)) {
    throw WrongUsage(
        (argc < 2 ? "a command is missing" : "\"" + std::string(argv[1]) + "\" is no command") +
        "; give one of " + commands + "; see fingertip --help");
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError &error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  catch_signals();
  return action();
}

} // namespace

int main(int argc, char **argv) {
  try {
    return run(argc, argv);
  } catch (const WrongUsage &error) {
    std::fprintf(stderr, "fingertip: %s\n", printable(error.what()).c_str());
    return 2;
  } catch (const fingertip::Error &error) {
    std::fprintf(stderr, "fingertip: %s\n", printable(error.what()).c_str());
  } catch (const fingertip::Interrupted &) {
    std::fprintf(stderr, "fingertip: interrupted\n");
  }
  return 1;
}
