/* Asks computer and fingertip for the facts, and prints what they mean. */
#include "libfingertip/command.hpp"
#include "libfingertip/connection.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/progress_bar.hpp"
#include "libfingertip/session.hpp"
#include "libfingertip/text.hpp"
#include "tool/cli/command_line.hpp"
#include "tool/cli/terminal.hpp"
#include "tool/doctor/judge.hpp"
#include "tool/doctor/wiring.hpp"

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

namespace fingertip {

namespace {

using Json = nlohmann::ordered_json;

struct DoctorOptions {
  Choice choice;
  double seconds = 10;    /* of the measurement, device time */
  std::string root = "/"; /* of the system's files */
  std::string elf;        /* of the firmware, for the names in a crash; empty: where it is built */
  bool json = false;
};

/* One that starts answers within a second. */
constexpr Session::Policy PATIENCE = {std::chrono::milliseconds(1000), 4};
/* The slowest frame rate is one in 10 s. */
constexpr std::int64_t SILENCE_MAX_us = 12000000;

/* What somebody who has it has open. */
std::string device_of(const Endpoint &endpoint, const std::string &root) {
  if (!endpoint.port.empty()) {
    return endpoint.port;
  }
  for (const Found &found : find_usb(root)) {
    if (found.usb && is_same_serial(found.serial, endpoint.serial)) {
      char name[32];
      std::snprintf(name, sizeof name, "dev/bus/usb/%03u/%03u", found.usb->bus, found.usb->address);
      return (std::filesystem::path(root) / name).string();
    }
  }
  return "";
}

/* What it was built into, seen from the source's folder. */
std::string usual_elf(const wire_info &info) {
  std::string board = text_field(info.board);
  return "build/" + board + "/fingertip-" + board + ".elf";
}

/* An image is known by what cmake/write_build_info.cmake marks in it. */
Crash read_crash(const crash_record &record, const wire_info &info, const std::string &elf) {
  std::string path = elf.empty() ? usual_elf(info) : elf;
  std::error_code ignored;
  if (elf.empty() && !std::filesystem::exists(path, ignored)) {
    return with_places(record, std::nullopt);
  }
  Symbols symbols = Symbols::of_file(path);
  auto is_marked = [&](const std::string &mark, const char *field) {
    return symbols.holds("fingertip-" + mark + "=" + text_field(field) + '\0');
  };
  if (is_marked("git", info.git_hash) && is_marked("board", info.board) && is_marked("scene", info.scene)) {
    return with_places(record, symbols);
  }
  Crash crash = with_places(record, std::nullopt);
  crash.symbols_note = path + " is of other firmware: no names";
  return crash;
}

/* Nothing of firmware that does not know the question. */
void ask_for_crash(Session &session, Facts &facts, const std::string &elf) {
  try {
    crash_record record = session.crash().body.crash;
    if (record.kind != CRASH_NONE) {
      facts.crash = read_crash(record, *facts.info, elf);
    }
  } catch (const Error &error) {
    if (error.code() != ErrorCode::unknown_command) {
      throw;
    }
  }
}

void measure(Session &session, Facts &facts, const std::string &elf, double seconds, const std::function<bool()> &stop,
             const std::function<void(double)> &progress) {
  BaselineMeter meter;
  std::int64_t last_us = steady_now_us();
  session.on_packet([&](const wire_packet &packet) {
    last_us = is_frame(packet) ? steady_now_us() : last_us;
    meter.add(packet);
  });
  facts.before = session.health().body.health;
  ask_for_crash(session, facts, elf);
  LineStatistics before = session.statistics();
  session.command(command_stream(possible_streams(*facts.info, WIRE_STREAM_CONTACT | WIRE_STREAM_RAW)), PATIENCE);
  while (meter.seconds() < seconds && steady_now_us() - last_us < SILENCE_MAX_us) {
    if (stop()) {
      throw Interrupted();
    }
    if (session.poll(std::chrono::milliseconds(50)) == Transport::Result::gone) {
      throw Gone(facts.port + ": vanished while it was examined");
    }
    progress(meter.seconds() / seconds);
  }
  facts.line = session.statistics() - before;
  facts.baseline = meter.result();
  facts.after = session.health().body.health;
  ask_for_crash(session, facts, elf); /* it may have crashed meanwhile */
  session.on_packet({});
  session.command(command_stream(0), PATIENCE);
}

/* Whatever ends it early is one of the facts, but for an ELF file that was named and is none: Error. stop: asked while waiting; true throws
 * Interrupted. progress: called with the share of the measurement that is over, 0..1. Leaves the streams off. */
Facts gather(const DoctorOptions &options, const std::function<bool()> &stop, const std::function<void(double)> &progress) {
  if (!options.elf.empty()) {
    Symbols::of_file(options.elf);
  }
  Facts facts;
  facts.rule = find_rule(options.root);
  try {
    facts.port = options.choice.port;
    Endpoint endpoint = choose_endpoint(options.choice, options.root);
    facts.is_shared = !endpoint.socket.empty();
    facts.port = device_of(endpoint, options.root);
    std::error_code none;
    facts.is_plugged_in = std::filesystem::canonical(facts.port, none).parent_path() != "/dev/pts";
    facts.holders = holders_of(facts.port, options.root);
    auto transport = open_endpoint(endpoint, options.root);
    facts.port = transport->description();
    Session session(*transport, stop);
    facts.info = session.info(PATIENCE).body.info;
    measure(session, facts, options.elf, options.seconds, stop, progress);
  } catch (const Error &error) {
    facts.failure = Failure{error.code(), error.what()};
    if (!facts.port.empty() && facts.holders.seen.empty()) {
      facts.holders = holders_of(facts.port, options.root);
    }
  }
  return facts;
}

bool wants_colour() {
  const char *none = std::getenv("NO_COLOR");
  return !(none && *none) && screen_depth(ColourMode::automatic).has_value();
}

void print(const std::vector<Finding> &findings) {
  bool colour = wants_colour();
  for (const Finding &finding : findings) {
    const char *paint = finding.verdict == Verdict::ok ? "\x1b[32m" : finding.verdict == Verdict::warn ? "\x1b[33m" : "\x1b[31m";
    std::string text = finding.text + (finding.advice.empty() ? "" : "; " + finding.advice);
    std::printf("%s%-4s%s  %-9s  %s\n", colour ? paint : "", verdict_text(finding.verdict).c_str(), colour ? "\x1b[0m" : "",
                finding.check.c_str(), printable(text).c_str());
  }
}

template <typename Value> Json or_null(const std::optional<Value> &value) { return value ? Json(*value) : Json(nullptr); }

Json place_json(const std::optional<Wiring> &wiring, unsigned sensor) {
  Json json = {{"sensor", sensor}};
  if (wiring && sensor < wiring->sensor_count) {
    Place place = wiring->place(sensor);
    json["strip"] = place.strip;
    json[place.multiplexer ? "channel" : "position"] = place.position;
    if (place.multiplexer) {
      json["multiplexer"] = *place.multiplexer;
    } else {
      json["gpio"] = or_null(place.gpio);
    }
  }
  return json;
}

Json measured_json(const Facts &facts, const std::optional<Wiring> &wiring) {
  const Baseline &baseline = *facts.baseline;
  Json sensors = Json::array();
  for (unsigned k = 0; k < baseline.sensors.size(); k++) {
    const SensorBaseline &sensor = baseline.sensors[k];
    Json json = place_json(wiring, k);
    json["readings"] = sensor.readings;
    json["valid_share"] = sensor.valid_share;
    json["mean_Pa"] = sensor.readings ? Json(sensor.mean_Pa) : Json(nullptr);
    json["noise_Pa"] = or_null(sensor.noise_Pa);
    json["drift_Pa_per_s"] = sensor.drift ? Json(sensor.drift->Pa_per_s) : Json(nullptr);
    json["drift_sd_Pa_per_s"] = sensor.drift ? Json(sensor.drift->sd_Pa_per_s) : Json(nullptr);
    sensors.push_back(json);
  }
  return {{"seconds", baseline.seconds},
          {"rate_Hz", baseline.seconds > 0 ? Json(baseline.frames_made / baseline.seconds) : Json(nullptr)},
          {"expected_rate_Hz", or_null(expected_rate_Hz(*facts.info))},
          {"expected_noise_Pa", or_null(expected_noise_Pa(facts.info->osr))},
          {"touched_frames", baseline.frames_touched},
          {"lost_packets", facts.line.dropped_packets},
          {"sensors", sensors}};
}

Json crash_json(const Crash &crash) {
  const crash_record &record = crash.record;
  Json json = {{"kind", record.kind},         {"exception", record.exception}, {"vector", record.vector},
               {"activity", record.activity}, {"stuck", record.stuck},         {"uptime_s", static_cast<double>(record.t_us) / 1e6},
               {"place", crash.place},        {"caller", crash.caller}};
  for (const auto &[name, value] : registers_of(record)) {
    json["registers"][name] = value;
  }
  json["events"] = Json::array();
  for (unsigned i = 0; i < CRASH_EVENTS && record.event_codes[i] != CRASH_EVENT_NONE; i++) {
    json["events"].push_back({{"code", record.event_codes[i]}, {"detail", record.event_details[i]}, {"age_s", event_age_s(record, i)}});
  }
  return json;
}

Json to_json(const Facts &facts, const std::vector<Finding> &findings) {
  std::optional<Wiring> wiring;
  Json json = {{"tool_version", FINGERTIP_VERSION}, {"verdict", verdict_text(worst_of(findings))}, {"port", facts.port}};
  if (facts.info) {
    std::string board = text_field(facts.info->board);
    wiring = Wiring::of_board(board);
    json["serial"] = text_field(facts.info->serial);
    json["board"] = board;
    json["scene"] = text_field(facts.info->scene);
    json["git_hash"] = text_field(facts.info->git_hash);
    json["osr"] = facts.info->osr;
  }
  json["findings"] = Json::array();
  for (const Finding &finding : findings) {
    Json sensors = Json::array();
    for (unsigned sensor : finding.sensors) {
      sensors.push_back(place_json(wiring, sensor));
    }
    json["findings"].push_back({{"check", finding.check},
                                {"verdict", verdict_text(finding.verdict)},
                                {"text", finding.text},
                                {"advice", finding.advice},
                                {"sensors", sensors}});
  }
  if (facts.crash) {
    json["crash"] = crash_json(*facts.crash);
  }
  if (facts.baseline) {
    json["measured"] = measured_json(facts, wiring);
  }
  if (facts.after) {
    for (const auto &[key, value] : health_fields(*facts.after)) {
      json["health"][key] = value;
    }
  }
  return json;
}

int doctor(const DoctorOptions &options) {
  Facts facts;
  {
    ProgressBar bar("measuring, touch nothing");
    facts = gather(options, stop_requested, [&](double share) { bar.show(share); });
  }
  auto &[major, minor, patch] = facts.tool_version;
  std::sscanf(FINGERTIP_VERSION, "%u.%u.%u", &major, &minor, &patch);
  std::vector<Finding> findings = judge(facts);
  if (options.json) {
    std::printf("%s\n", to_json(facts, findings).dump(2, ' ', false, Json::error_handler_t::replace).c_str());
  } else {
    print(findings);
  }
  return worst_of(findings) == Verdict::bad ? 1 : 0;
}

} // namespace

void add_doctor(CommandLine &line) {
  auto options = std::make_shared<DoctorOptions>();
  CLI::App *command = line.add("doctor",
                               "Find what is wrong with a fingertip, its sensors and its port; nothing may touch the "
                               "pad meanwhile. Exit status 1 if anything is bad",
                               [options] { return doctor(*options); });
  with_port(command, options->choice);
  with_number(
      command, "--seconds", 1, 600, "1 to 600", [options](double value) { options->seconds = value; },
      "How long to measure noise, drift and rate; default 10")
      ->type_name("S");
  with_value(command, "FILE", "--elf", options->elf,
             "ELF file of the firmware, for the names in a crash; default build/BOARD/fingertip-BOARD.elf");
  command->add_flag("--json", options->json, "Print all of it as JSON");
  with_value(command, "FOLDER", "--root", options->root, "Folder that contains etc, dev, proc, sys and usr; default /");
}

} // namespace fingertip
