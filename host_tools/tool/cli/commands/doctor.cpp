#include "libfingertip/packet_fields.hpp"
#include "libfingertip/progress_bar.hpp"
#include "libfingertip/text.hpp"
#include "tool/cli/command_line.hpp"
#include "tool/cli/terminal.hpp"
#include "tool/doctor/gather.hpp"
#include "tool/doctor/wiring.hpp"

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>

namespace fingertip {

namespace {

using Json = nlohmann::ordered_json;

struct DoctorOptions {
  Examination examination;
  bool json = false;
};

bool wants_colour() {
  const char *none = std::getenv("NO_COLOR");
  return !(none && *none) && screen_depth(ColourMode::automatic).has_value();
}

void print(const std::vector<Finding> &findings) {
  bool colour = wants_colour();
  for (const Finding &finding : findings) {
    const char *paint = finding.verdict == Verdict::ok     ? "\x1b[32m"
                        : finding.verdict == Verdict::warn ? "\x1b[33m"
                                                           : "\x1b[31m";
    std::string text = finding.text + (finding.advice.empty() ? "" : "; " + finding.advice);
    std::printf("%s%-4s%s  %-9s  %s\n", colour ? paint : "", verdict_text(finding.verdict).c_str(),
                colour ? "\x1b[0m" : "", finding.check.c_str(), printable(text).c_str());
  }
}

template <typename Value> Json or_null(const std::optional<Value> &value) {
  return value ? Json(*value) : Json(nullptr);
}

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
  const Rest &rest = *facts.rest;
  Json sensors = Json::array();
  for (unsigned k = 0; k < rest.sensors.size(); k++) {
    const SensorAtRest &sensor = rest.sensors[k];
    Json json = place_json(wiring, k);
    json["readings"] = sensor.readings;
    json["valid_share"] = sensor.valid_share;
    json["mean_Pa"] = sensor.readings ? Json(sensor.mean_Pa) : Json(nullptr);
    json["noise_Pa"] = or_null(sensor.noise_Pa);
    json["drift_Pa_per_s"] = sensor.drift ? Json(sensor.drift->Pa_per_s) : Json(nullptr);
    json["drift_sd_Pa_per_s"] = sensor.drift ? Json(sensor.drift->sd_Pa_per_s) : Json(nullptr);
    sensors.push_back(json);
  }
  return {{"seconds", rest.seconds},
          {"rate_Hz", rest.seconds > 0 ? Json(rest.frames_made / rest.seconds) : Json(nullptr)},
          {"expected_rate_Hz", or_null(expected_rate_Hz(*facts.info))},
          {"expected_noise_Pa", or_null(expected_noise_Pa(facts.info->osr))},
          {"touched_frames", rest.frames_touched},
          {"lost_packets", facts.line.dropped_packets},
          {"sensors", sensors}};
}

Json crash_json(const Crash &crash) {
  const crash_record &record = crash.record;
  Json json = {{"kind", record.kind},     {"exception", record.exception},
               {"vector", record.vector}, {"activity", record.activity},
               {"stuck", record.stuck},   {"uptime_s", static_cast<double>(record.t_us) / 1e6},
               {"place", crash.place},    {"caller", crash.caller}};
  for (const auto &[name, value] : registers_of(record)) {
    json["registers"][name] = value;
  }
  json["events"] = Json::array();
  for (unsigned i = 0; i < CRASH_EVENTS && record.event_codes[i] != CRASH_EVENT_NONE; i++) {
    json["events"].push_back(
        {{"code", record.event_codes[i]}, {"detail", record.event_details[i]}, {"age_s", event_age_s(record, i)}});
  }
  return json;
}

Json to_json(const Facts &facts, const std::vector<Finding> &findings) {
  std::optional<Wiring> wiring;
  Json json = {
      {"tool_version", FINGERTIP_VERSION}, {"verdict", verdict_text(worst_of(findings))}, {"port", facts.port}};
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
  if (facts.rest) {
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
    ProgressBar bar("measuring, touch nothing", ProgressBar::Lines::none);
    facts = gather(options.examination, stop_requested, [&](double share) { bar.show(share); });
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
  with_port(command, options->examination.choice);
  with_number(
      command, "--seconds", 1, 600, "1 to 600", [options](double value) { options->examination.seconds = value; },
      "How long to measure noise, drift and rate; default 10")
      ->type_name("S");
  command
      ->add_option("--elf", options->examination.elf,
                   "ELF file of the firmware, for the names in a crash; default build/BOARD/fingertip-BOARD.elf")
      ->type_name("FILE");
  command->add_flag("--json", options->json, "Print all of it as JSON");
  command
      ->add_option("--root", options->examination.root, "Folder that contains etc, dev, proc, sys and usr; default /")
      ->type_name("FOLDER");
}

} // namespace fingertip
