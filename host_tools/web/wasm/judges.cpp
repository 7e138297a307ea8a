// The tool's calibrations and its doctor for the page (judges.mjs explains each). Packets and texts come in by room(), answers go
// out as JSON by answer_at(). The page frees the sessions. Errors are exceptions (exceptions.cpp).
#include "libfingertip/error.hpp"
#include "tool/calibration/gain_session.hpp"
#include "tool/calibration/pulls.hpp"
#include "tool/doctor/judge.hpp"

#include <cerrno> // which nlohmann/json.hpp uses
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#define EXPORT(name) extern "C" __attribute__((export_name(#name)))

namespace fingertip::web {
namespace {

using calibrating::GainSession;
using calibrating::PullSession;
using nlohmann::json;

std::vector<std::uint8_t> given;
std::string answer;

// What the page gave is one frame of the line, without its delimiter.
wire_packet packet() {
  wire_packet decoded;
  std::vector<std::uint8_t> frame = given; // decoding overwrites it
  if (frame.size() > WIRE_MAX_FRAME_BYTES || wire_decode(wire_all_layouts, frame.data(), frame.size(), &decoded) != FT_OK) {
    throw Error("a packet of the fingertip is damaged; connect again");
  }
  return decoded;
}

wire_packet packet_of(wire_type type) {
  wire_packet decoded = packet();
  if (decoded.type != type) {
    throw Error("a packet of another type than was asked for; connect again");
  }
  return decoded;
}

template <typename State> const char *name_of(State state) {
  return state == State::more ? "more" : state == State::good ? "good" : "refused";
}

json scatter_of(const calibrating::Scatter &scatter) { return {{"location_mm", scatter.location_mm}, {"force", scatter.force}}; }

void answer_with(const json &values) { answer = values.dump(); }

} // namespace
} // namespace fingertip::web

using namespace fingertip;
using namespace fingertip::web;
namespace calibrating = fingertip::calibrating;

EXPORT(room) std::uint8_t *room(unsigned bytes) {
  given.resize(bytes);
  return given.data();
}
EXPORT(answer_at) const char *answer_at() { return answer.data(); }
EXPORT(answer_bytes) unsigned answer_bytes() { return static_cast<unsigned>(answer.size()); }

EXPORT(gains_begin) GainSession *gains_begin() {
  const wire_info info = packet_of(WIRE_INFO).body.info;
  calibrating::check_firmware(info, "this fingertip");
  auto *session = new GainSession(info);
  session->judge(false); // where the first is wanted
  return session;
}
EXPORT(gains_free) void gains_free(GainSession *session) { delete session; }
// 1: a placement was completed, and judged.
EXPORT(gains_take) int gains_take(GainSession *session) {
  if (session->judgement().state != calibrating::Judgement::State::more || !session->take(packet())) {
    return 0;
  }
  session->judge(false);
  return 1;
}
EXPORT(gains_take_back) void gains_take_back(GainSession *session) { session->take_back(); }
EXPORT(gains_status) void gains_status(const GainSession *session) {
  const calibrating::Judgement &judgement = session->judgement();
  json placements = json::array();
  for (const calibrating::Fitted &fitted : judgement.solution.placements) {
    placements.push_back({{"x_mm", fitted.x_mm}, {"y_mm", fitted.y_mm}, {"kept", fitted.kept}});
  }
  const json wanted = session->wanted() ? json{{"x_mm", session->wanted()->x_mm}, {"y_mm", session->wanted()->y_mm}} : json();
  answer_with({{"state", name_of(judgement.state)},
               {"text", session->placements().empty() ? "" : judgement.text},
               {"advice", session->advice()},
               {"progress", session->progress()},
               {"placements", placements},
               {"wanted", wanted},
               {"gain", judgement.solution.gain}});
}
// force_N: NaN where it is not known.
EXPORT(gains_result)
void gains_result(const GainSession *session, double force_N, double date_s) {
  if (session->judgement().state != calibrating::Judgement::State::good) {
    throw Error("not calibrated: " + session->judgement().text);
  }
  const calibration made =
      session->made(std::isnan(force_N) ? std::nullopt : std::optional<double>(force_N), static_cast<std::uint32_t>(date_s));
  const auto of_sensors = [&](auto member) {
    json values = json::array();
    for (std::size_t k = 0; k < session->array().sensors(); k++) {
      values.push_back(made.sensors[k].*member);
    }
    return values;
  };
  answer_with({{"calibration",
                {{"calibration_date_s", made.date_s},
                 {"calibration_placements", made.placements},
                 {"force_scale", made.force_scale},
                 {"force_scale_sd", made.force_scale_sd},
                 {"calibration_sigma_um", made.sigma_um},
                 {"calibration_sigma_sd_um", made.sigma_sd_um},
                 {"calibration_dip_share_q16", made.dip_share_q16},
                 {"calibration_dip_sd_um", made.dip_sd_um},
                 {"calibration_ambient_kPa", made.ambient_kPa},
                 {"gain", of_sensors(&sensor_calibration::gain)},
                 {"gain_sd", of_sensors(&sensor_calibration::gain_sd)},
                 {"off_x_um", of_sensors(&sensor_calibration::off_x_um)},
                 {"off_y_um", of_sensors(&sensor_calibration::off_y_um)},
                 {"wider_q15", of_sensors(&sensor_calibration::wider_q15)}}},
               {"before", scatter_of(session->scatter(false))},
               {"after", scatter_of(session->scatter(true))}});
}

EXPORT(pulls_begin) PullSession *pulls_begin(double known_N) {
  const wire_info info = packet_of(WIRE_INFO).body.info;
  calibrating::check_pad(info, "this fingertip");
  return new PullSession(info, known_N);
}
EXPORT(pulls_free) void pulls_free(PullSession *session) { delete session; }
// 1: a pull was completed, and judged.
EXPORT(pulls_take) int pulls_take(PullSession *session) {
  if (session->judgement().state != calibrating::PullJudgement::State::more || !session->take(packet())) {
    return 0;
  }
  session->judge(false);
  return 1;
}
EXPORT(pulls_status) void pulls_status(const PullSession *session) {
  answer_with({{"state", name_of(session->judgement().state)},
               {"text", session->judgement().text},
               {"advice", session->advice()},
               {"last", session->pulls().empty() ? "" : session->last_pull_text()}});
}
// What the page gave last is the fingertip's info.
EXPORT(pulls_result) void pulls_result(const PullSession *session) {
  if (session->judgement().state != calibrating::PullJudgement::State::good) {
    throw Error("not calibrated: " + session->judgement().text);
  }
  const pad_profile made = session->scaled(packet_of(WIRE_INFO).body.info.pad);
  answer_with({{"tangential_scale", made.tangential_scale}, {"tangential_scale_sd", made.tangential_scale_sd}});
}

namespace {

struct Examined {
  Facts facts;
  BaselineMeter baseline;
  bool measured = false;
};

} // namespace

// What the page gave is the name of the port.
EXPORT(doctor_begin) Examined *doctor_begin(unsigned major, unsigned minor, unsigned patch) {
  auto examined = std::make_unique<Examined>();
  examined->facts.knows_computer = false;
  examined->facts.tool_version = {major, minor, patch};
  examined->facts.port.assign(given.begin(), given.end());
  return examined.release();
}
EXPORT(doctor_free) void doctor_free(Examined *examined) { delete examined; }
EXPORT(doctor_info) void doctor_info(Examined *examined) { examined->facts.info = packet_of(WIRE_INFO).body.info; }
EXPORT(doctor_before) void doctor_before(Examined *examined) { examined->facts.before = packet_of(WIRE_HEALTH).body.health; }
EXPORT(doctor_after) void doctor_after(Examined *examined) { examined->facts.after = packet_of(WIRE_HEALTH).body.health; }
EXPORT(doctor_crash) void doctor_crash(Examined *examined) {
  const crash_record record = packet_of(WIRE_CRASH).body.crash;
  if (record.kind != CRASH_NONE) {
    examined->facts.crash = Crash{record, "", "", ""};
  }
}
EXPORT(doctor_take) void doctor_take(Examined *examined) {
  examined->baseline.add(packet());
  examined->measured = true;
}
EXPORT(doctor_seconds) double doctor_seconds(const Examined *examined) { return examined->baseline.seconds(); }
EXPORT(doctor_line)
void doctor_line(Examined *examined, double bytes, double packets, double dropped_packets, double out_of_order, double crc_errors,
                 double format_errors) {
  LineStatistics &line = examined->facts.line;
  line.bytes = static_cast<std::uint64_t>(bytes);
  line.packets = static_cast<std::uint64_t>(packets);
  line.dropped_packets = static_cast<std::uint64_t>(dropped_packets);
  line.out_of_order = static_cast<std::uint64_t>(out_of_order);
  line.crc_errors = static_cast<std::uint64_t>(crc_errors);
  line.format_errors = static_cast<std::uint64_t>(format_errors);
}
EXPORT(doctor_status) void doctor_status(Examined *examined) {
  if (examined->measured) {
    examined->facts.baseline = examined->baseline.result();
  }
  json findings = json::array();
  for (const Finding &finding : judge(examined->facts)) {
    findings.push_back(
        {{"verdict", verdict_text(finding.verdict)}, {"check", finding.check}, {"text", finding.text}, {"advice", finding.advice}});
  }
  answer_with(findings);
}
