/* A grasp from a terminal: two fingertips and a gripper, shown, recorded and controlled. */
#include "grasp/grasp_loop.hpp"
#include "grasp/grip_row.hpp"
#include "grasp/gripper/gripper.hpp"
#include "grasp/settings.hpp"
#include "grasp/words.hpp"
#include "libfingertip/clock.hpp"
#include "libfingertip/connection.hpp"
#include "libfingertip/output_file.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/packet_file.hpp"
#include "libfingertip/share_socket.hpp"
#include "libfingertip/text.hpp"
#include "library/share/line_server.hpp"
#include "tool/advice.hpp"
#include "tool/cli/command_line.hpp"
#include "tool/cli/gripper_options.hpp"
#include "tool/cli/live_recording.hpp"
#include "tool/cli/terminal.hpp"
#include "tool/cli/view.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <map>
#include <memory>
#include <optional>
#include <string>

namespace fingertip {

namespace {

using std::chrono::milliseconds;

struct GraspOptions {
  GripperWay gripper;
  std::string left, right; /* serial number, or port; empty: what there is */
  TransportKind transport = TransportKind::automatic;
  std::map<std::string, double> limits;   /* by name, grasp/settings.hpp */
  std::map<std::string, double> breaking; /* the same, of a preset; limits override them */
  bool activate = false;
  bool wait = false;             /* for requests: it neither grasps nor ends by itself */
  std::optional<double> seconds; /* since both fingertips stream */
  std::string recording;         /* empty: none */
  bool overwrite = false;
  bool quiet = false;
  ColourMode colour = ColourMode::automatic;
};

/* How a grasp ended, as exit status: 0 as asked, 1 by an error. */
enum GraspEnd { GRASP_DONE = 0, GRASP_MISSED = 3, GRASP_DROPPED = 4, GRASP_FAULT = 5 };

constexpr std::size_t FINGERS = GraspLoop::FINGERS;
constexpr const char *SIDES[FINGERS] = {"left", "right"};
constexpr milliseconds NEWS_POLL{20};
/* Between two rows of the gripper where nothing changes. */
constexpr std::int64_t ROW_us = 10000;
/* A fingertip that starts measures its zero for half a second. */
constexpr std::int64_t TARING_us = 3000000;
/* Without a terminal it ends TAIL_us after the grasp, and waits INACTIVE_us at most for a gripper that may not be activated. */
constexpr std::int64_t TAIL_us = 300000, INACTIVE_us = 2000000;
/* At this frame rate an object at 0.1 m/s slides by a millimetre between two frames. */
constexpr std::uint32_t RATE_LEAST_mHz = 100000;

constexpr struct {
  char key;
  GripRequest request;
  const char *name;
} KEYS[] = {{'o', GRIP_REQUEST_RELEASE, "open"},
            {'h', GRIP_REQUEST_HOLD, "hold"},
            {'g', GRIP_REQUEST_GRASP, "grasp"},
            {'p', GRIP_REQUEST_PLACE, "place"},
            {'r', GRIP_REQUEST_HAND_OVER, "hand over"}};

std::optional<Endpoint> endpoint_at(const std::string &text, TransportKind transport) {
  if (text.empty()) {
    return std::nullopt;
  }
  bool is_port = text.find('/') != std::string::npos || text.rfind("sim:", 0) == 0;
  return choose_endpoint({is_port ? text : "", is_port ? "" : text, transport});
}

bool is_same(const Endpoint &one, const Endpoint &other) {
  return one.serial.empty() || other.serial.empty() ? one.port == other.port : is_same_serial(one.serial, other.serial);
}

std::array<Endpoint, FINGERS> ways_of(const GraspOptions &options) {
  const std::optional<Endpoint> left = endpoint_at(options.left, options.transport), right = endpoint_at(options.right, options.transport);
  if (left && right) {
    if (is_same(*left, *right)) {
      throw WrongUsage("--left and --right name the same fingertip; name two");
    }
    return {*left, *right};
  }
  std::vector<Endpoint> others;
  std::string names;
  for (const Endpoint &endpoint : all_endpoints(options.transport)) {
    names += " " + (endpoint.serial.empty() ? endpoint.port : endpoint.serial);
    if (!(left && is_same(endpoint, *left)) && !(right && is_same(endpoint, *right))) {
      others.push_back(endpoint);
    }
  }
  if (others.size() != (left || right ? 1 : 2)) {
    throw Error("a grasp takes two fingertips, and there are" + (names.empty() ? " none" : names) +
                "; plug them in, or choose with --left and --right");
  }
  return {left.value_or(others.front()), right.value_or(others.back())};
}

/* Throws Error: it cannot take part in a grasp at all. */
void check_for_grasp(const std::string &name, const wire_info &info, const wire_health &health) {
  if ((info.capabilities & WIRE_CAPABILITY_FIT) == 0) {
    throw Error(name + ": firmware of scene " + text_field(info.scene) + " reports no force; flash scene grasp");
  }
  if ((health.sensors_present & first_sensors(info.sensor_count)) == 0) {
    throw Error(name + ": none of its sensors answers; see their wiring and supply (fingertip info)");
  }
}

/* What allows a grasp, but should be mended: a line each. needs_load: the force follows the load. */
std::vector<std::string> lacks_for_grasp(const wire_info &info, bool needs_load) {
  std::vector<std::string> lacks;
  if (needs_load && (info.capabilities & WIRE_CAPABILITY_TANGENTIAL) == 0) {
    lacks.push_back("no load is estimated, only places show it: flash scene grasp");
  } else if (needs_load && (info.stored & WIRE_STORED_PAD) == 0) {
    lacks.push_back("no load is estimated, only places show it: fingertip pad");
  }
  if ((info.stored & WIRE_STORED_CALIBRATION) == 0) {
    lacks.push_back("forces may be off by some 10 %: fingertip calibrate");
  }
  if (info.rate_mHz != 0 && info.rate_mHz < RATE_LEAST_mHz) {
    lacks.push_back("sees slides late at " + fixed(info.rate_mHz / 1e3, 1) + " frames a second: fingertip set rate=max");
  }
  return lacks;
}

class GraspSession {
public:
  GraspSession(const GraspOptions &options, const std::map<std::string, double> &limits, const GripSettings &settings)
      : options_(options), limits_(limits), settings_(settings), models_(FINGERS),
        loop_(ways_of(options), {WIRE_STREAM_ALL, options.activate, interrupts}) {
    grip_.set_gripper(options.gripper.model);
    grip_.set_cap_N(static_cast<float>(settings.cap_N));
    for (std::size_t i = 0; i < FINGERS; i++) {
      models_[i].set_source(loop_.name(i));
    }
  }

  int run() {
    begin();
    if (options_.quiet) {
      view_ = make_quiet_grasp_view(grip_);
    } else {
      has_keys_ = screen_depth(options_.colour).has_value();
      view_ = make_grasp_view(options_.colour, grip_);
    }
    while (!take_news()) {
      answer_interrupts();
      if (requests_) {
        requests_->step();
      }
      show();
      if (!ending_ && should_end()) {
        ending_ = true;
        state_at_end_ = state();
        silent_at_end_ = last_ && (last_->report.trouble & GRIP_GRIPPER_SILENT) != 0;
        loop_.end();
      }
    }
    view_.reset();
    return finish();
  }

private:
  /* Both fingertips and the gripper are there, and fit for it. */
  void begin() {
    const auto ready = loop_.meet(stop_requested);
    if (std::memcmp(ready[0].packet.body.info.serial, ready[1].packet.body.info.serial, WIRE_TEXT_BYTES) == 0) {
      throw Error(loop_.name(0) + ": is left and right; name two fingertips");
    }
    for (std::size_t i = 0; i < FINGERS; i++) {
      const wire_info &info = ready[i].packet.body.info;
      models_[i].take(ready[i].packet);
      models_[i].set_state(Model::State::live);
      check_for_grasp(loop_.name(i), info, ready[i].health);
      for (const std::string &lack : lacks_for_grasp(info, settings_.mode == GRIP_MODE_HOLD)) {
        std::fprintf(stderr, "%s (%s) %s\n", SIDES[i], text_field(info.serial).c_str(), printable(lack).c_str());
      }
    }
    GripperWay way = options_.gripper;
    std::unique_ptr<Gripper> gripper = reach_gripper(way);
    try {
      check(*gripper, way.port);
    } catch (const Error &error) {
      throw with_gripper_advice(error);
    }
    const std::string line = way.model + " " + way.port + ", " + gripper->line();
    grip_.set_gripper(line);
    zero_us_ = steady_now_us();
    if (!options_.recording.empty()) {
      Metadata head = {{"grasp_gripper", line}};
      const Metadata all = settings_metadata(settings_);
      head.insert(head.end(), all.begin(), all.end());
      recording_.emplace(options_.recording, options_.overwrite, std::vector<DeviceUpdate>(ready.begin(), ready.end()), "", zero_us_, head);
      keep([&] { recording_->writer().comment(GRIP_ROW_KEY, static_cast<double>(zero_us_), "time_us," + grip_columns()); });
    }
    loop_.begin(
        std::move(gripper), [way] { return open_gripper(way); }, settings_);
    try {
      make_own_folder(own_share_folder());
      requests_.emplace(own_share_folder() + "/" + grasp_socket_name(text_field(ready[0].packet.body.info.serial)),
                        LineServer::Clients{[this](int, const std::string &asked) { return answer(asked); }});
    } catch (const Error &error) {
      lost_ = "takes no requests: " + error_text(error);
    }
  }

  /* A line of another program: NAME=VALUE, any number of them, then a request if there is one; or "report". */
  std::string answer(const std::string &line) {
    if (line == "report") {
      return report_line();
    }
    std::vector<std::string_view> words = split(trim(line), ' ');
    const std::optional<GripRequest> request = request_of_name(words.back());
    words.resize(words.size() - (request ? 1 : 0));
    event("request " + line);
    try {
      const std::map<std::string, double> before = limits_;
      std::map<std::string, double> limits = limits_of(words);
      limits.insert(before.begin(), before.end());
      if (change(limits) && (!request || wish(*request, request_name(*request)))) {
        return "ok";
      }
      change(before);
      return "error cannot be while it is " + state_name(state());
    } catch (const Error &error) {
      return std::string("error ") + error.what();
    }
  }

  bool change(const std::map<std::string, double> &limits) {
    const GripSettings settings = settings_for(gripper_traits(options_.gripper.model), limits);
    if (!loop_.change(settings)) {
      return false;
    }
    limits_ = limits;
    grip_.set_cap_N(static_cast<float>(settings.cap_N));
    return true;
  }

  std::string report_line() const {
    const std::string columns = grip_columns(), cells = last_ ? grip_cells(row_of(*last_)) : "";
    const auto names = split(columns, ','), values = split(cells, ',');
    std::string line = "report";
    for (std::size_t i = 0; i < values.size() && i < names.size(); i++) {
      std::string value(values[i]);
      std::replace(value.begin(), value.end(), ' ', ',');
      line += " " + std::string(names[i]) + "=" + value;
    }
    return line;
  }

  void check(Gripper &gripper, const std::string &port) const {
    const GripperStatus status = gripper.poll();
    if (status.fault != 0 && !options_.activate) {
      throw Error(port + ": fault " + std::to_string(status.fault) + " of the gripper, " + gripper.fault_text(status.fault) +
                  "; --activate clears it, and moves it");
    }
    if (!status.active && !options_.activate) {
      throw Error(port + ": the gripper is not active; take out what it holds, and let it move with --activate");
    }
  }

  /* What writes. A disk that is full ends the recording, not the grasp. */
  template <typename Write> void keep(Write write) {
    if (!recording_) {
      return;
    }
    try {
      write();
    } catch (const Error &error) {
      lost_ = "not recorded any more: " + error_text(error);
      recording_.reset();
    }
  }

  void event(const std::string &text) {
    keep([&] {
      recording_->writer().comment(GRIP_EVENT_KEY, static_cast<double>(steady_now_us()),
                                   fixed(static_cast<double>(steady_now_us() - zero_us_), 1) + "," + text);
    });
  }

  /* True after the last. */
  bool take_news() {
    double settled_us = std::min(static_cast<double>(steady_now_us()), loop_.read_until_us());
    bool ended = false;
    for (GraspNews &news : loop_.take(NEWS_POLL)) {
      switch (news.kind) {
      case GraspNews::Kind::device: take_device(*news.device); break;
      case GraspNews::Kind::step: take_step(news); break;
      case GraspNews::Kind::gripper:
        trouble_ = news.text;
        event("gripper: " + (news.text.empty() ? "answers, without a fault" : news.text));
        break;
      case GraspNews::Kind::fault: event(fault_ = news.text); break;
      case GraspNews::Kind::dropped: lost_ = std::to_string(news.count) + " lines not recorded: this program was held up"; break;
      case GraspNews::Kind::ended: ended = true; break;
      }
    }
    keep([&] { recording_->writer().settle(settled_us - SETTLE_us); });
    return ended;
  }

  void take_device(DeviceUpdate &news) {
    using Kind = DeviceUpdate::Kind;
    Model &model = models_[news.device];
    switch (news.kind) {
    case Kind::packet:
      model.take(news.packet);
      look_at_start(news);
      keep([&] { recording_->packet(news); });
      break;
    case Kind::clock: keep([&] { recording_->writer().clock(news.device, news.estimate, news.jumps); }); break;
    case Kind::gone:
    case Kind::back:
      model.set_state(news.kind == Kind::gone ? Model::State::gone : Model::State::live);
      keep([&] { recording_->event(news.device, news.kind == Kind::gone ? EVENT_GONE : EVENT_BACK); });
      break;
    case Kind::ended:
      if (!ending_) {
        model.set_state(Model::State::gone);
        lost_fingers_++;
      }
      break;
    default: break;
    }
  }

  /* Nothing moves before both have a zero. */
  void look_at_start(const DeviceUpdate &news) {
    if (requested_ || news.packet.type != WIRE_CONTACT) {
      return;
    }
    const std::uint32_t flags = news.packet.body.contact.flags;
    has_zero_[news.device] = flags & CONTACT_FLAG_TARED;
    touches_[news.device] = flags & CONTACT_FLAG_CONTACT;
    if (has_zero_[0] && has_zero_[1]) {
      requested_ = true;
      for (std::size_t i = 0; i < FINGERS; i++) {
        if (touches_[i]) {
          message_.show(std::string(SIDES[i]) + " has contact already, which is taken for the object");
        }
      }
      if (!options_.wait) {
        wish(GRIP_REQUEST_GRASP, "grasp");
      }
    }
  }

  void take_step(const GraspNews &news) {
    const GripReport &report = news.report;
    bool changed = !last_ || report.state != last_->report.state || report.trouble != last_->report.trouble ||
                   report.slides != last_->report.slides || news.command.motion != last_->command.motion ||
                   news.command.width_mm != last_->command.width_mm ||
                   (news.status && (!last_->status || news.status->host_us != last_->status->host_us));
    if (last_ && report.state != last_->report.state) {
      state_since_us_ = news.host_us;
      if (requests_) {
        requests_->send("state " + state_name(report.state));
      }
    }
    if (!changed && news.host_us - last_->host_us < ROW_us) {
      return;
    }
    last_ = news;
    const GripRow row = row_of(news);
    grip_.take(row);
    keep([&] {
      recording_->writer().comment(GRIP_ROW_KEY, static_cast<double>(news.host_us), fixed(row.time_us, 1) + "," + grip_cells(row));
    });
  }

  GripRow row_of(const GraspNews &news) const {
    GripRow row{static_cast<double>(news.host_us - zero_us_), news.report, news.command, news.status};
    if (row.status) {
      row.status->host_us -= zero_us_;
      row.status->fault = news.report.gripper_fault;
    }
    return row;
  }

  std::uint8_t state() const { return last_ ? last_->report.state : std::uint8_t{GRIP_IDLE}; }
  std::int64_t state_us() const { return steady_now_us() - state_since_us_; }

  bool wish(GripRequest request, const std::string &name) {
    bool done = loop_.request(request);
    event(name + (done ? "" : ", which cannot be now"));
    if (!done) {
      message_.show("cannot " + name + " while it is " + state_name(state()));
    }
    return done;
  }

  /* At once, and in words of its own. */
  void answer_interrupts() {
    if (interrupts() > reported_interrupts_) {
      reported_interrupts_ = interrupts();
      message_.show(reported_interrupts_ == 1 ? "Ctrl-C: the width stays; again: opens slowly" : "Ctrl-C: opens slowly; again: ends here");
      view_->hurry();
      event("interrupted");
    }
  }

  /* Anything that ends it while the gripper holds, or never will. */
  bool should_end() {
    std::int64_t since_begin_us = steady_now_us() - zero_us_;
    if (!requested_ && since_begin_us > TARING_us) {
      failure_ = std::string(SIDES[has_zero_[0] ? 1 : 0]) + ": no zero yet; see that its sensors answer (fingertip info)";
    } else if (lost_fingers_ == FINGERS) {
      failure_ = "both fingertips are lost";
    }
    bool at_end = is_end_state(state()) && state_us() > TAIL_us;
    bool is_inactive = state() == GRIP_ACTIVATING && (last_->report.trouble & GRIP_GRIPPER_INACTIVE) != 0;
    inactive_since_us_ = is_inactive ? inactive_since_us_ : steady_now_us();
    bool never_active = steady_now_us() - inactive_since_us_ > INACTIVE_us;
    bool opened = state() == GRIP_OPEN && interrupts() > 1;
    return !failure_.empty() || quit_ || end_requested() || interrupts() > 2 || opened ||
           (!has_keys_ && !options_.wait && (at_end || never_active)) ||
           (options_.seconds && static_cast<double>(since_begin_us) > 1e6 * *options_.seconds);
  }

  void show() {
    for (std::size_t i = 0; i < FINGERS; i++) {
      models_[i].set_statistics(loop_.statistics(i));
    }
    Caption caption;
    caption.keys = "q end, holding" + joined(KEYS, "", [](const auto &one) { return std::string("  ") + one.key + " " + one.name; });
    caption.note = joined(std::vector{message_.text(), fault_.empty() ? trouble_ : fault_, lost_}, "  ");
    if (caption.note.empty() && recording_) {
      caption.note = has_keys_ ? "recording to " + printable(options_.recording) : "";
    }
    view_->update(models_, caption);
    while (auto key = view_->key()) {
      take_key(*key);
      view_->hurry();
    }
  }

  void take_key(Key key) {
    quit_ = quit_ || key == 'q';
    if (const auto *asked = find_in(KEYS, [&](const auto &one) { return key == one.key; })) {
      wish(asked->request, asked->name);
    }
  }

  int status_of_end() const {
    switch (state_at_end_) {
    case GRIP_MISSED: return GRASP_MISSED;
    case GRIP_DROPPED: return GRASP_DROPPED;
    case GRIP_FAULT:
    case GRIP_ACTIVATING: return GRASP_FAULT;
    default: return silent_at_end_ ? GRASP_FAULT : GRASP_DONE;
    }
  }

  /* Why the status is GRASP_FAULT; "": it is not. */
  std::string cause_of_fault() const {
    if (status_of_end() != GRASP_FAULT) {
      return "";
    }
    if (state_at_end_ == GRIP_FAULT) {
      return fault_;
    }
    if (state_at_end_ == GRIP_ACTIVATING) {
      return last_->command.motion == GRIP_ACTIVATE ? "the gripper does not become active"
                                                    : "the gripper is not active, and what it holds would fall if it were activated";
    }
    return "the gripper does not answer" + (trouble_.empty() ? "" : ": " + trouble_);
  }

  int finish() {
    std::vector<LineStatistics> statistics = {loop_.statistics(0), loop_.statistics(1)};
    std::uint64_t frames = 0;
    keep([&] {
      frames = recording_->frames(0) + recording_->frames(1);
      recording_->finish(statistics, "ended");
    });
    if (recording_) {
      std::fprintf(stderr, "%s: %llu frames of 2 fingertips, aligned to %s us or better\n", printable(options_.recording).c_str(),
                   static_cast<unsigned long long>(frames), fixed(recording_->writer().alignment_us(), 0).c_str());
    }
    const std::string cause = cause_of_fault();
    for (const std::string &text : {cause.empty() ? trouble_ : cause, lost_}) {
      if (!text.empty()) {
        std::fprintf(stderr, "%s\n", printable(text).c_str());
      }
    }
    std::string width = last_ && last_->status ? fixed(last_->status->width_mm, 1) + " mm" : "?";
    std::fprintf(stderr, "%s; the gripper keeps its position, %s (`fingertip gripper open` opens it)\n", state_text(state_at_end_).c_str(),
                 width.c_str());
    loop_.rethrow();
    if (!failure_.empty()) {
      throw Error(failure_);
    }
    int status = status_of_end();
    return status == GRASP_DONE && !lost_.empty() ? 1 : status;
  }

  const GraspOptions &options_;
  std::map<std::string, double> limits_;
  GripSettings settings_; /* at the beginning */
  std::vector<Model> models_;
  GripModel grip_;
  std::optional<LiveRecording> recording_;
  std::unique_ptr<View> view_;
  GraspLoop loop_;
  std::optional<LineServer> requests_;
  std::optional<GraspNews> last_; /* of kind step, that was kept */
  std::int64_t zero_us_ = 0, state_since_us_ = 0, inactive_since_us_ = 0;
  std::array<bool, FINGERS> has_zero_{}, touches_{};
  std::size_t lost_fingers_ = 0;
  bool requested_ = false, quit_ = false, has_keys_ = false, ending_ = false;
  bool silent_at_end_ = false;
  unsigned reported_interrupts_ = 0;
  std::uint8_t state_at_end_ = GRIP_IDLE;
  Message message_;
  std::string trouble_, fault_, lost_, failure_;
};

int run(const GraspOptions &options) {
  std::map<std::string, double> limits = options.limits;
  limits.insert(options.breaking.begin(), options.breaking.end()); // a limit of its own stays
  const GripSettings settings = typed([&] { return settings_for(gripper_traits(options.gripper.model), limits); });
  if (!options.recording.empty()) {
    check_recording(options.recording, options.overwrite);
  }
  return GraspSession(options, limits, settings).run();
}

std::string plain(double value) {
  char text[32];
  std::snprintf(text, sizeof text, value == std::floor(value) ? "%.0f" : "%.4g", value);
  return text;
}

/* The default for the usual gripper, and for a servo if it differs. */
std::string default_of(const GraspSetting &setting, const GripSettings &usual, const GripSettings &servo) {
  if (setting.name == std::string("fixed")) {
    return "";
  }
  const double value = value_of(setting, usual), other = value_of(setting, servo);
  return "; default " + plain(value) + (value == other ? "" : ", of a servo " + plain(other));
}

/* What breaks: a preset by name, or the force that breaks it. Options of single limits override it. */
void with_presets(CLI::App *command, std::map<std::string, double> &breaking) {
  const std::string names = joined(
      grasp_presets(), ", ", [](const GraspPreset &preset) { return std::string(preset.name) + " (" + plain(preset.breaks_N) + " N)"; });
  auto *preset = command->add_option_function<std::string>(
      "--preset", [&breaking](const std::string &name) { breaking = typed([&] { return preset_values(name); }); },
      "Cap, start, floor and approach for what breaks: " + names);
  preset->type_name("NAME")->group("Limits");
  with_number(
      command, "--breaks", 1, 100, "N, 1 to 100", [&breaking](double value) { breaking = breaking_values(value); },
      "The same, for an object that this force breaks")
      ->type_name("N")
      ->excludes(preset)
      ->group("Limits");
}

void with_limits(CLI::App *command, std::map<std::string, double> &limits) {
  const auto models = gripper_models();
  const GripSettings usual = settings_for(models.front(), {});
  const GripSettings servo = settings_for(models.back(), {});
  for (const GraspSetting &setting : grasp_settings()) {
    const std::string range = plain(setting.low) + " to " + plain(setting.high), unit = setting.unit;
    with_number(
        command, std::string("--") + setting.name, setting.low, setting.high, unit + (unit.empty() ? "" : ", ") + range,
        [&limits, &setting](double value) { limits[setting.name] = value; },
        std::string(setting.help) + ": " + range + default_of(setting, usual, servo))
        ->type_name(*setting.unit ? setting.unit : "X")
        ->group("Limits");
  }
}

} // namespace

void add_grasp(CommandLine &line) {
  auto options = std::make_shared<GraspOptions>();
  CLI::App *command = line.add("grasp", "Hold an object between two fingertips on a gripper", [options] { return run(*options); });
  with_value(command, "MODEL", "--gripper", options->gripper.model, gripper_model_names())->required();
  with_value(command, "PATH", "--gripper-port", options->gripper.port,
             "Its serial line, or ur:HOST for a Robotiq on a UR arm; default: the only one on USB that is no fingertip");
  with_value(command, "SERIAL|PORT", "--left", options->left, "Fingertip; default: the first of two");
  with_value(command, "SERIAL|PORT", "--right", options->right, "Fingertip; default: the other");
  command->add_flag("--activate", options->activate, "Activate a gripper that is not: it moves, and drops what it holds");
  command->add_flag("--wait", options->wait, "Grasp on request only (keys, socket), and do not end with a grasp");
  with_seconds(command, options->seconds, "End after this long, the gripper holding");
  with_value(command, "FILE.csv|FILE.mcap", "-o,--record", options->recording, "Record all of it");
  command->add_flag("--overwrite", options->overwrite, "Replace the recording if it exists");
  command->add_flag("--quiet", options->quiet, "Print only changes, on standard error");
  with_transport(command, options->transport);
  with_colour(command, options->colour);
  with_gripper_line(command, options->gripper);
  with_presets(command, options->breaking);
  with_limits(command, options->limits);
  command->footer("Keys, on a terminal: q end, holding; o open; h hold; g grasp; p place; r hand over.\n\nExit status:\n  0  as "
                  "asked, the gripper "
                  "holding or open\n  1  an error, which is named\n  2  wrong usage\n  3  it closed, and nothing was there\n  4  "
                  "the object fell\n  5  the gripper failed, was not active, or did not answer at the end");
}

} // namespace fingertip
