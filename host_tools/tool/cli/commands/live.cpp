/* monitor and record: fingertips on their ports, shown and recorded until something ends it; one and many alike. */
#include "libfingertip/clock.hpp"
#include "libfingertip/command.hpp"
#include "libfingertip/connection.hpp"
#include "libfingertip/device_loop.hpp"
#include "libfingertip/names.hpp"
#include "libfingertip/output_file.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/packet_file.hpp"
#include "libfingertip/text.hpp"
#include "tool/cli/command_line.hpp"
#include "tool/cli/live_recording.hpp"
#include "tool/cli/names_of_values.hpp"
#include "tool/cli/terminal.hpp"
#include "tool/cli/view.hpp"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <unistd.h>
#include <vector>

namespace fingertip {

namespace {

using std::chrono::milliseconds;

constexpr milliseconds POLL{20};

struct LiveOptions {
  Choice choice; /* without the device */
  std::vector<std::string> devices;
  bool all = false;
  std::optional<double> seconds; /* of device time from the first frame; of several fingertips, of
                                    the host's time from their common start */
  std::string recording;         /* empty: none; "-": standard output, if it is no monitor */
  std::string raw_bytes;         /* of one fingertip; empty: none */
  bool overwrite = false;
  bool until_gone = false; /* end when a port vanishes, instead of waiting for it */
  bool monitor = true;     /* else a line of progress */
  ColourMode colour = ColourMode::automatic;
};

class Live {
public:
  Live(const LiveOptions &options, const std::vector<Endpoint> &endpoints)
      : options_(options), models_(endpoints.size()), ready_(endpoints.size()), taring_(endpoints.size()), accepted_(endpoints.size()),
        reported_missing_(endpoints.size()) {
    DeviceLoop::Options wanted;
    wanted.streams = WIRE_STREAM_ALL;
    wanted.follow_clock = several();
    wanted.bytes = !options.raw_bytes.empty();
    wanted.wait_for_back = !options.until_gone;
    for (std::size_t i = 0; i < models_.size(); i++) {
      loops_.push_back(std::make_unique<DeviceLoop>(i, endpoints[i], wanted, feed_));
      models_[i].set_source(loops_[i]->name());
    }
    running_ = loops_.size();
    if (!options.recording.empty() && !to_standard_output_) {
      note_ = "recording to " + printable(options.recording);
    }
    view_ = options.monitor ? make_monitor_view(options.colour) : to_standard_output_ ? make_state_view() : make_progress_view();
  }

  int run() {
    while (running_ > 0) {
      take_updates();
      show();
      if (reason_.empty()) {
        reason_ = reason_to_end();
        if (!reason_.empty()) {
          stop();
        }
      }
    }
    update_statistics();
    view_.reset();
    for (const auto &loop : loops_) {
      loop->rethrow();
    }
    if (!begun_ && stop_requested()) {
      throw Interrupted();
    }
    finish();
    if (raw_failure_) {
      throw *raw_failure_;
    }
    if (!several() && models_[0].frames() == 0 && reason_ == "gone") {
      throw Gone(loops_[0]->name() + ": vanished before the first frame");
    }
    for (std::size_t i = 0; i < models_.size(); i++) {
      if (models_[i].is_without_sensors()) {
        throw Error(loops_[i]->name() + ": none of its sensors answers; see their wiring and supply (fingertip info)");
      }
    }
    return 0;
  }

private:
  bool several() const { return models_.size() > 1; }

  void take_updates() {
    /* Asked first: what was read until then is in the feed. A row waits for those of a fingertip whose thread got no time to read them. */
    double settled_us = static_cast<double>(steady_now_us());
    for (const auto &loop : loops_) {
      settled_us = std::min(settled_us, loop->read_until_us());
    }
    for (DeviceUpdate &update : feed_.take(POLL)) {
      take(update);
    }
    if (RecordingWriter *recording = joint_recording()) {
      recording->settle(settled_us - SETTLE_us);
    }
  }

  void take(DeviceUpdate &update) {
    using Kind = DeviceUpdate::Kind;
    Model &model = models_[update.device];
    switch (update.kind) {
    case Kind::packet:
      model.take(update.packet);
      if (update.packet.type == WIRE_HEALTH) {
        report_missing(update.device);
      }
      take_answer(update.device, update.packet);
      if (recording_) {
        recording_->packet(update);
      }
      break;
    case Kind::ready:
      ready_[update.device] = std::move(update);
      if (std::all_of(ready_.begin(), ready_.end(), [](const auto &each) { return each; })) {
        begin();
      }
      break;
    case Kind::back:
      model.set_state(Model::State::live);
      event(update.device, EVENT_BACK);
      break;
    case Kind::gone:
      model.set_state(Model::State::gone);
      any_gone_ = true;
      event(update.device, EVENT_GONE);
      break;
    case Kind::mute: event(update.device, "no answer to the end of the streams"); break;
    case Kind::bytes:
      keep([&] {
        if (!raw_bytes_) {
          raw_bytes_ = std::make_unique<QueuedSink>(options_.raw_bytes, options_.overwrite);
        }
        raw_bytes_->append(update.bytes.data(), update.bytes.size());
      });
      break;
    case Kind::clock:
      if (RecordingWriter *recording = joint_recording()) {
        recording->clock(update.device, update.estimate, update.jumps);
      }
      break;
    case Kind::ended:
      running_--;
      stop(); /* the others end too; what was written stays */
      break;
    }
  }

  /* Bytes of the line, until they cannot be written: the recording goes on, and run ends with that error. */
  template <typename Action> void keep(const Action &action) {
    try {
      if (!raw_failure_) {
        action();
      }
    } catch (const Error &error) {
      raw_failure_ = error;
      note_ += "  no bytes in " + printable(options_.raw_bytes) + " from now on";
    }
  }

  /* Every one of them has answered. */
  void begin() {
    std::vector<DeviceUpdate> ready;
    for (std::size_t i = 0; i < loops_.size(); i++) {
      const char *serial = ready_[i]->packet.body.info.serial;
      for (const DeviceUpdate &other : ready) {
        if (std::memcmp(other.packet.body.info.serial, serial, WIRE_TEXT_BYTES) == 0) {
          throw Error(loops_[i]->name() + ": is the same fingertip as another; name each once");
        }
      }
      ready.push_back(*ready_[i]);
    }
    zero_us_ = steady_now_us();
    if (!options_.recording.empty()) {
      recording_.emplace(options_.recording, options_.overwrite, ready, loops_[0]->name(), zero_us_);
    }
    begun_ = true;
    for (std::size_t i = 0; i < loops_.size(); i++) {
      models_[i].set_state(Model::State::live);
      loops_[i]->start();
    }
  }

  RecordingWriter *joint_recording() { return recording_ && several() ? &recording_->writer() : nullptr; }

  void event(std::size_t device, const std::string &text) {
    if (recording_) {
      recording_->event(device, text);
    }
  }

  void stop() {
    for (const auto &loop : loops_) {
      loop->stop();
    }
  }

  double seconds() const { return several() ? static_cast<double>(steady_now_us() - zero_us_) / 1e6 : models_[0].seconds(); }

  /* "" to go on. */
  std::string reason_to_end() const {
    if (options_.until_gone && any_gone_) {
      return "gone";
    }
    if (stop_requested() || quit_ || ((to_standard_output_ || options_.monitor) && !is_standard_output_read())) {
      return "interrupted";
    }
    if (begun_ && options_.seconds && models_[0].frames() > 0 && seconds() >= *options_.seconds) {
      return "seconds";
    }
    return "";
  }

  void update_statistics() {
    for (std::size_t i = 0; i < loops_.size(); i++) {
      models_[i].set_statistics(loops_[i]->statistics());
    }
  }

  void show() {
    update_statistics();
    if (options_.monitor || begun_ || !several()) {
      view_->update(models_, caption());
    }
    auto now = host_now();
    while (auto key = view_->key()) {
      take_key(*key, now);
      view_->hurry();
    }
    tare_.expire(now);
  }

  void take_key(Key key, HostTime now) {
    if (tare_.is_asked()) {
      if (tare_.answer(key, now)) {
        taring_.assign(loops_.size(), true);
        for (const auto &loop : loops_) {
          loop->send(command_tare());
        }
        message_.show("taring");
      } else {
        message_.show("not tared");
      }
    } else if (key == 'q') {
      quit_ = true;
    } else if (key == 't' &&
               std::all_of(models_.begin(), models_.end(), [](const Model &model) { return model.state() == Model::State::live; })) {
      tare_.ask(now);
    }
  }

  /* Takes the answers to a key: a tare is done once the frames of all fingertips report it. */
  void take_answer(std::size_t device, const wire_packet &packet) {
    if (packet.type == WIRE_ACK && packet.body.ack.command == WIRE_CMD_TARE) {
      accepted_[device] = packet.body.ack.result == WIRE_RESULT_DONE;
      if (!accepted_[device]) {
        taring_[device] = false;
        message_.show((is_refused() ? message_.text() + "; " : "") + name_of(device) +
                      "not tared: " + refusal(device, packet.body.ack.result));
      }
    } else if (accepted_[device] && is_frame(packet) && (flags_of(packet) & CONTACT_FLAG_TARED)) {
      accepted_[device] = taring_[device] = false;
      if (!is_refused() && std::none_of(taring_.begin(), taring_.end(), [](bool each) { return each; })) {
        message_.show("tared");
      }
    }
  }

  std::string refusal(std::size_t device, std::uint8_t result) const {
    const auto &contact = models_[device].contact();
    return result == WIRE_RESULT_NOT_NOW && contact && (contact->flags & CONTACT_FLAG_CONTACT) ? "it reports a contact, let go of the pad"
                                                                                               : result_text(result);
  }

  bool is_refused() const { return message_.text().find("not tared: ") != std::string::npos; }

  /* Which of several. */
  std::string name_of(std::size_t device) const {
    const Model &model = models_[device];
    return !several() || !model.info() ? "" : text_field(model.info()->serial) + ": ";
  }

  Caption caption() {
    Caption caption;
    caption.keys = "q quit  t tare";
    if (tare_.is_asked()) {
      caption.question = several() ? "tare all, pads free? y/n" : "tare, pad free? y/n";
    }
    std::vector<std::string> notes = {message_.text()};
    for (std::size_t i = 0; i < models_.size(); i++) {
      sensor_map missing = models_[i].missing_sensors();
      notes.push_back(missing ? name_of(i) + "sensors missing: " + sensors_text(missing) : "");
    }
    if (const RecordingWriter *recording = joint_recording(); recording && !options_.monitor) {
      notes.push_back("aligned to " + fixed(recording->alignment_us(), 0) + " us");
    }
    notes.push_back(note_);
    caption.note = joined(notes, "  ");
    return caption;
  }

  /* For programs and log files: once, and when it changes. */
  void report_missing(std::size_t device) {
    sensor_map missing = models_[device].missing_sensors();
    if (options_.monitor || missing == reported_missing_[device]) {
      return;
    }
    reported_missing_[device] = missing;
    std::fprintf(stderr, "%s%s: %s\n", isatty(STDERR_FILENO) ? "\r\x1b[K" : "", printable(loops_[device]->name()).c_str(),
                 missing ? ("sensors missing: " + sensors_text(missing) + "; see their wiring (fingertip info)").c_str()
                         : "all sensors answer");
  }

  void finish() {
    std::vector<LineStatistics> statistics;
    LineStatistics sum;
    for (const Model &model : models_) {
      statistics.push_back(model.statistics());
      sum += model.statistics();
    }
    if (recording_) {
      recording_->finish(statistics, reason_);
    }
    if (raw_bytes_) {
      keep([&] { raw_bytes_->finish(); });
    }
    std::string name = recording_ && !to_standard_output_ ? printable(options_.recording) + ": " : "";
    if (!several()) {
      std::fprintf(options_.monitor ? stdout : stderr, "%s%s\n", name.c_str(), summary_text(models_[0]).c_str());
      return;
    }
    const RecordingWriter *joint = joint_recording();
    if (!joint) {
      for (std::size_t i = 0; i < models_.size(); i++) {
        std::printf("%s%s\n", name_of(i).c_str(), summary_text(models_[i]).c_str());
      }
      return;
    }
    std::uint64_t frames = 0;
    std::string edges;
    for (std::size_t i = 0; i < models_.size(); i++) {
      frames += joint->frames(i);
      edges += edges_text(models_[i]);
    }
    const double edges_us = joint->edges_alignment_us();
    const std::string by_edges = edges_us > 0 ? ", by edges to " + fixed(edges_us, 1) + " us" : "";
    std::fprintf(stderr, "%s%llu frames of %zu fingertips, aligned to %s us or better%s, %llu packets dropped, %llu CRC errors%s\n",
                 name.c_str(), static_cast<unsigned long long>(frames), models_.size(), fixed(joint->alignment_us(), 0).c_str(),
                 by_edges.c_str(), static_cast<unsigned long long>(sum.dropped_packets), static_cast<unsigned long long>(sum.crc_errors),
                 edges.c_str());
  }

  const LiveOptions &options_;
  const bool to_standard_output_ = options_.recording == STDOUT_NAME;
  DeviceFeed feed_;
  std::vector<Model> models_;
  std::vector<std::optional<DeviceUpdate>> ready_;
  std::unique_ptr<ByteSink> raw_bytes_;
  std::optional<Error> raw_failure_;
  std::optional<LiveRecording> recording_;
  std::unique_ptr<View> view_;
  std::string note_;
  Message message_;
  Confirmation tare_;
  std::vector<bool> taring_, accepted_; /* asked for, and not refused; under way */
  std::vector<sensor_map> reported_missing_;
  std::string reason_;
  std::int64_t zero_us_ = 0;
  std::size_t running_ = 0;
  bool begun_ = false;
  bool any_gone_ = false;
  bool quit_ = false;
  std::vector<std::unique_ptr<DeviceLoop>> loops_; /* end first: their threads use the feed */
};

/* Before a port is opened, so that a wrong path costs nothing. Throws Error. */
void check_outputs(const LiveOptions &options) {
  if (!options.recording.empty() && options.recording != STDOUT_NAME) {
    check_recording(options.recording, options.overwrite);
  }
  if (!options.raw_bytes.empty()) {
    check_output(options.raw_bytes, options.overwrite);
  }
  if (!options.recording.empty() && !options.raw_bytes.empty() && is_same_file(options.recording, options.raw_bytes)) {
    throw Error(options.raw_bytes + ": is the recording too; give --raw-bytes another name");
  }
}

/* Throws Error if there is no fingertip, or it is not clear which. */
std::vector<Endpoint> endpoints_of(const LiveOptions &options) {
  std::vector<Endpoint> endpoints;
  if (options.all) {
    endpoints = all_endpoints(options.choice.transport);
  }
  if (!endpoints.empty()) {
    return endpoints;
  }
  for (const std::string &device : options.devices) {
    endpoints.push_back(choose_endpoint({options.choice.port, device, options.choice.transport}));
  }
  if (endpoints.empty()) {
    endpoints.push_back(choose_endpoint(options.choice));
  }
  return endpoints;
}

int run(const LiveOptions &options) {
  if (options.recording == STDOUT_NAME && options.monitor) {
    throw WrongUsage("monitor shows on standard output; give --record a file, or use `fingertip record -`");
  }
  if (options.recording == STDOUT_NAME && (options.all || options.devices.size() > 1)) {
    throw WrongUsage("several fingertips need a file; for - run one `fingertip record - --device SERIAL` for each");
  }
  if (options.raw_bytes == STDOUT_NAME) {
    throw WrongUsage("--raw-bytes needs a file; give it a name");
  }
  check_outputs(options);
  const std::vector<Endpoint> endpoints = endpoints_of(options);
  if (endpoints.size() > 1 && !options.raw_bytes.empty()) {
    throw Error("--raw-bytes keeps one fingertip's line; leave it out, or choose one fingertip");
  }
  return Live(options, endpoints).run();
}

CLI::App *add(CommandLine &line, const std::string &name, const std::string &help, const std::shared_ptr<LiveOptions> &options) {
  CLI::App *command = line.add(name, help, [options] { return run(*options); });
  command->add_option("--device", options->devices, "Serial number of the fingertip; several are taken on one clock")
      ->take_all()
      ->expected(1)
      ->type_name("SERIAL");
  with_port_only(command, options->choice);
  command->add_flag("--all", options->all, "Every fingertip there is, on one clock")
      ->excludes(command->get_option("--device"), command->get_option("--port"));
  with_seconds(command, options->seconds, "End after this much device time");
  with_value(command, "FILE.ftr", "--raw-bytes", options->raw_bytes, "Also keep the bytes of the line as they came");
  command->add_flag("--overwrite", options->overwrite, "Replace files that exist");
  command->add_flag("--until-gone", options->until_gone, "End when the port vanishes, instead of waiting for it");
  return command;
}

} // namespace

void add_monitor(CommandLine &line) {
  auto options = std::make_shared<LiveOptions>();
  CLI::App *command = add(line, "monitor", "Show live what fingertips feel", options);
  command->footer("Example: fingertip monitor --record press.mcap");
  with_value(command, "FILE.csv|FILE.mcap", "--record", options->recording, "Record at the same time");
  with_colour(command, options->colour);
}

void add_record(CommandLine &line) {
  auto options = std::make_shared<LiveOptions>();
  options->monitor = false;
  CLI::App *command = add(line, "record", "Record every frame to a CSV or MCAP file, until Ctrl-C", options);
  with_value(command, "FILE.csv|FILE.mcap|-", "file", options->recording,
             "The recording to write, CSV or MCAP by its name; -: standard output, each row as it comes")
      ->required();
  command->footer("Example: fingertip record press.csv --seconds 10");
}

} // namespace fingertip
