// The tool's calibrations and its doctor for the page (src/judges/judges.ts explains each).
// Packets and texts come in by room(), answers go out as JSON by answer_at().
// The page frees the sessions. Errors are exceptions (exceptions.cpp).
#include "libfingertip/error.hpp"
#include "tool/calibration/gain_session.hpp"
#include "tool/calibration/pull_session.hpp"
#include "tool/doctor/judge.hpp"
#include "web/wasm/json.hpp"

#include <map>
#include <memory>
#include <string>
#include <vector>

#define EXPORT(name) extern "C" __attribute__((export_name(#name)))

namespace fingertip::web {
namespace {

using calibrating::GainSession;
using calibrating::PlacementFinder;
using calibrating::PullFinder;
using calibrating::PullSession;

std::vector<std::uint8_t> given;
std::string answer;

// What the page gave is one frame of the line, without its delimiter.
wire_packet packet() {
  wire_packet decoded;
  std::vector<std::uint8_t> frame = given; // decoding overwrites it
  if (frame.size() > WIRE_MAX_FRAME_BYTES ||
      wire_decode(wire_all_layouts, frame.data(), frame.size(), &decoded) != FT_OK) {
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

std::string given_text() { return {given.begin(), given.end()}; }

const char *name_of(calibrating::Judgement::State state) {
  using State = calibrating::Judgement::State;
  return state == State::more ? "more" : state == State::good ? "good" : "refused";
}
const char *name_of(calibrating::PullJudgement::State state) {
  using State = calibrating::PullJudgement::State;
  return state == State::more ? "more" : state == State::good ? "good" : "refused";
}
const char *name_of(PlacementFinder::State state) {
  using State = PlacementFinder::State;
  return state == State::resting    ? "resting"
         : state == State::settling ? "settling"
         : state == State::taken    ? "taken"
                                    : "refused";
}
const char *name_of(PullFinder::State state) {
  using State = PullFinder::State;
  return state == State::free       ? "free"
         : state == State::settling ? "settling"
         : state == State::resting  ? "resting"
         : state == State::pulled   ? "pulled"
         : state == State::taken    ? "taken"
                                    : "refused";
}

// What may end an examination by a page.
ErrorCode code_of(const std::string &name) {
  static const std::map<std::string, ErrorCode> codes{
      {"no_port", ErrorCode::no_port},
      {"port_in_use", ErrorCode::port_in_use},
      {"cannot_open", ErrorCode::cannot_open},
      {"not_a_fingertip", ErrorCode::not_a_fingertip},
      {"gone", ErrorCode::gone},
      {"no_answer", ErrorCode::no_answer},
      {"other_version", ErrorCode::other_version},
  };
  const auto found = codes.find(name);
  return found == codes.end() ? ErrorCode::other : found->second;
}

void answer_with(const Json &json) { answer = json.text(); }

void add_scatter(Json &json, const char *name, const calibrating::Scatter &scatter) {
  json.name(name).begin();
  json.field("location_mm", scatter.location_mm).field("force", scatter.force);
  json.end();
}

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
  return new GainSession(info);
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
  const calibrating::Solution &solution = judgement.solution;
  const bool any = !session->placements().empty();
  Json json;
  json.begin();
  json.field("state", std::string_view(name_of(judgement.state)));
  json.field("reason", std::string_view(calibrating::name_of(judgement.reason)));
  json.field("text", std::string_view(any ? judgement.text : ""));
  json.field("advice", std::string_view(session->advice()));
  json.field("progress", std::string_view(session->progress()));
  json.field("finder", std::string_view(name_of(session->finder().state())));
  json.name("above_Pa").list(session->finder().above_Pa());
  json.name("placements").begin_list();
  for (const calibrating::Fitted &fitted : solution.placements) {
    json.begin().field("x_mm", fitted.x_mm).field("y_mm", fitted.y_mm).field("kept", fitted.kept);
    json.end();
  }
  json.end_list().name("wanted");
  if (session->wanted()) {
    json.begin().field("x_mm", session->wanted()->x_mm).field("y_mm", session->wanted()->y_mm);
    json.end();
  } else {
    json.null();
  }
  json.name("unsure").list(judgement.unsure).name("silent").list(judgement.silent);
  json.name("gain").list(solution.gain).name("gain_sd").list(solution.gain_sd);
  answer_with(json.end());
}
// force_N: NaN where it is not known.
EXPORT(gains_result)
void gains_result(const GainSession *session, double force_N, double date_s) {
  if (session->judgement().state != calibrating::Judgement::State::good) {
    throw Error("not calibrated: " + session->judgement().text);
  }
  const calibration made = session->made(std::isnan(force_N) ? std::nullopt : std::optional<double>(force_N),
                                         static_cast<std::uint32_t>(date_s));
  std::vector<float> gain, gain_sd;
  std::vector<int> off_x_um, off_y_um, wider_q15;
  for (std::size_t k = 0; k < session->array().sensors(); k++) {
    gain.push_back(made.sensors[k].gain);
    gain_sd.push_back(made.sensors[k].gain_sd);
    off_x_um.push_back(made.sensors[k].off_x_um);
    off_y_um.push_back(made.sensors[k].off_y_um);
    wider_q15.push_back(made.sensors[k].wider_q15);
  }
  Json json;
  json.begin().name("calibration").begin();
  json.field("date_s", static_cast<double>(made.date_s));
  json.field("placements", static_cast<double>(made.placements));
  json.field("force_scale", static_cast<double>(made.force_scale));
  json.field("force_scale_sd", static_cast<double>(made.force_scale_sd));
  json.field("sigma_um", static_cast<double>(made.sigma_um));
  json.field("sigma_sd_um", static_cast<double>(made.sigma_sd_um));
  json.field("dip_share_q16", static_cast<double>(made.dip_share_q16));
  json.field("dip_sd_um", static_cast<double>(made.dip_sd_um));
  json.field("ambient_kPa", static_cast<double>(made.ambient_kPa));
  json.name("gain").list(gain).name("gain_sd").list(gain_sd);
  json.name("off_x_um").list(off_x_um).name("off_y_um").list(off_y_um);
  json.name("wider_q15").list(wider_q15).end();
  add_scatter(json, "before", session->scatter(false));
  add_scatter(json, "after", session->scatter(true));
  answer_with(json.end());
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
  Json json;
  json.begin();
  json.field("state", std::string_view(name_of(session->judgement().state)));
  json.field("text", std::string_view(session->judgement().text));
  json.field("advice", std::string_view(session->advice()));
  json.field("finder", std::string_view(name_of(session->finder().state())));
  json.field("last", std::string_view(session->pulls().empty() ? "" : session->last_pull_text()));
  json.name("pulls").begin_list();
  for (const calibrating::Pull &pull : session->pulls()) {
    json.begin().field("x_mm", pull.x_mm).field("y_mm", pull.y_mm);
    json.field("qx_N", pull.qx_N).field("qy_N", pull.qy_N).end();
  }
  answer_with(json.end_list().end());
}
// What the page gave last is the fingertip's info.
EXPORT(pulls_result) void pulls_result(const PullSession *session) {
  if (session->judgement().state != calibrating::PullJudgement::State::good) {
    throw Error("not calibrated: " + session->judgement().text);
  }
  const pad_profile made = session->scaled(packet_of(WIRE_INFO).body.info.pad);
  Json json;
  json.begin();
  json.field("tangential_scale", static_cast<double>(made.tangential_scale));
  json.field("tangential_scale_sd", static_cast<double>(made.tangential_scale_sd));
  answer_with(json.end());
}

namespace {

struct Examined {
  Facts facts;
  RestMeter rest;
  bool measured = false;
};

} // namespace

// What the page gave is the name of the port.
EXPORT(doctor_begin) Examined *doctor_begin(unsigned major, unsigned minor, unsigned patch) {
  auto examined = std::make_unique<Examined>();
  examined->facts.knows_computer = false;
  examined->facts.tool_version = {major, minor, patch};
  examined->facts.port = given_text();
  return examined.release();
}
EXPORT(doctor_free) void doctor_free(Examined *examined) { delete examined; }
EXPORT(doctor_info) void doctor_info(Examined *examined) { examined->facts.info = packet_of(WIRE_INFO).body.info; }
EXPORT(doctor_before) void doctor_before(Examined *examined) {
  examined->facts.before = packet_of(WIRE_HEALTH).body.health;
}
EXPORT(doctor_after) void doctor_after(Examined *examined) {
  examined->facts.after = packet_of(WIRE_HEALTH).body.health;
}
EXPORT(doctor_crash) void doctor_crash(Examined *examined) {
  const crash_record record = packet_of(WIRE_CRASH).body.crash;
  if (record.kind != CRASH_NONE) {
    examined->facts.crash = Crash{record, "", "", ""};
  }
}
EXPORT(doctor_take) void doctor_take(Examined *examined) {
  examined->rest.add(packet());
  examined->measured = true;
}
EXPORT(doctor_seconds) double doctor_seconds(const Examined *examined) { return examined->rest.seconds(); }
EXPORT(doctor_line)
void doctor_line(Examined *examined, double bytes, double packets, double dropped_packets, double out_of_order,
                 double crc_errors, double format_errors) {
  LineStatistics &line = examined->facts.line;
  line.bytes = static_cast<std::uint64_t>(bytes);
  line.packets = static_cast<std::uint64_t>(packets);
  line.dropped_packets = static_cast<std::uint64_t>(dropped_packets);
  line.out_of_order = static_cast<std::uint64_t>(out_of_order);
  line.crc_errors = static_cast<std::uint64_t>(crc_errors);
  line.format_errors = static_cast<std::uint64_t>(format_errors);
}
// What the page gave is the code's name, a new line, and the text.
EXPORT(doctor_failure) void doctor_failure(Examined *examined) {
  const std::string all = given_text();
  const std::size_t line = all.find('\n');
  examined->facts.failure =
      Failure{code_of(all.substr(0, line)), line == std::string::npos ? "" : all.substr(line + 1)};
}
EXPORT(doctor_status) void doctor_status(Examined *examined) {
  if (examined->measured) {
    examined->facts.rest = examined->rest.result();
  }
  Json json;
  json.begin_list();
  for (const Finding &finding : judge(examined->facts)) {
    json.begin();
    json.field("verdict", std::string_view(verdict_text(finding.verdict)));
    json.field("check", std::string_view(finding.check));
    json.field("text", std::string_view(finding.text));
    json.field("advice", std::string_view(finding.advice));
    json.name("sensors").list(finding.sensors).end();
  }
  answer_with(json.end_list());
}
