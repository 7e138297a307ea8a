#include "cli/live.hpp"

#include "cli/view.hpp"
#include "libfingertip/command.hpp"
#include "libfingertip/output_file.hpp"
#include "libfingertip/recording.hpp"
#include "libfingertip/recording_transport.hpp"
#include "libfingertip/session.hpp"
#include "libfingertip/text.hpp"

#include <cstdio>
#include <cstring>
#include <ctime>
#include <memory>
#include <thread>

namespace fingertip {

namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds POLL{20};
constexpr milliseconds REOPEN_INTERVAL{200};
/* Without a frame for so long the streams are asked for again: the device may have restarted
 * without the port noticing. */
constexpr milliseconds REVIVE_AFTER{3000};

/* Before the port is opened, so that a wrong path costs nothing. */
void check_outputs(const LiveOptions &options) {
  for (const std::string &path : {options.recording, options.raw_bytes}) {
    if (!path.empty() && path != STANDARD_OUTPUT) {
      check_output(path, options.overwrite);
    }
  }
  if (!options.recording.empty() && !options.raw_bytes.empty() &&
      is_same_file(options.recording, options.raw_bytes)) {
    throw Error(options.raw_bytes + ": is the recording too; give --raw-bytes another name");
  }
}

class Live {
public:
  explicit Live(const LiveOptions &options)
      : options_(options), transport_(open_way(choose_way(options.choice))),
        session_(*transport_, [this] { return is_stop_wanted(); }) {
    if (!options.raw_bytes.empty()) {
      session_.on_bytes([this](const std::uint8_t *bytes, std::size_t length) {
        if (!raw_bytes_) {
          raw_bytes_ = std::make_unique<OutputFile>(options_.raw_bytes, options_.overwrite,
                                                    OutputFile::Appears::at_once);
        }
        raw_bytes_->append(bytes, length);
      });
    }
    session_.on_packet([this](const wire_packet &packet) {
      model_.take(packet);
      if (recording_ && can_write()) {
        recording_->packet(packet);
      }
    });
    model_.set_source(transport_->description());
    if (!options.recording.empty() && !to_standard_output_) {
      note_ = "recording to " + printable(options.recording);
    }
    view_ = options.monitor       ? make_monitor_view(options.colour)
            : to_standard_output_ ? make_state_view()
                                  : make_progress_view();
  }

  int run() {
    std::string reason;
    try {
      reason = stream_until_end();
    } catch (const Interrupted &) {
      reason = "interrupted";
    }
    stopping_ = true;
    if (reason != "gone") {
      stop_streams();
    }
    model_.set_statistics(session_.statistics());
    view_.reset();
    std::string summary = summary_text(model_);
    if (recording_) {
      if (can_write()) {
        recording_->finish(session_.statistics(), reason);
      }
      summary = (to_standard_output_ ? "" : printable(recording_->path()) + ": ") + summary;
    }
    std::fprintf(options_.monitor ? stdout : stderr, "%s\n", summary.c_str());
    if (model_.frames() == 0 && reason == "gone") {
      throw Error(transport_->description() + ": vanished before the first frame");
    }
    return 0;
  }

private:
  bool is_stop_wanted() {
    if (stopping_) {
      return false;
    }
    show();
    return stop_requested() || quit_ || (to_standard_output_ && !is_standard_output_read());
  }

  /* A reader of standard output that is slow is waited for, unless the end is wanted. */
  bool can_write() const { return !to_standard_output_ || wait_for_standard_output(); }

  void show() {
    model_.set_statistics(session_.statistics());
    view_->update(model_, note_);
    while (auto key = view_->key()) {
      if (*key == 'q') {
        quit_ = true;
      } else if (*key == 't' && model_.state() == Model::State::live) {
        session_.send(command_tare());
      }
    }
  }

  /* Returns once streams run. Gone if the port vanishes. */
  void connect() {
    model_.set_state(Model::State::connecting);
    session_.info();
    /* The first answer may have waited for the device to start; this one tells its clock. */
    wire_packet info = session_.info();
    streams_ = possible_streams(info.body.info, options_.streams);
    if (recording_) {
      event("back");
    } else if (!options_.recording.empty()) {
      start_recording(info);
    }
    session_.command(command_stream(streams_));
    revived_ = Clock::now();
    model_.set_state(Model::State::live);
  }

  void start_recording(const wire_packet &info) {
    Metadata extra = {{"recorded_by", "fingertip " FINGERTIP_VERSION},
                      {"started_utc", utc_now()},
                      {"port", transport_->description()}};
    if (auto clock = session_.clock()) {
      auto device_us = steady_now_us() + clock->device_minus_host_us;
      extra.emplace_back("started_device_us", std::to_string(device_us));
      extra.emplace_back("started_uncertainty_us", std::to_string(clock->uncertainty_us));
    }
    recording_ = std::make_unique<RecordingWriter>(
        options_.recording, options_.overwrite, &info.body.info, info.body.info.sensor_count, extra,
        raw_expected(),
        to_standard_output_ ? OutputFile::Appears::on_standard_output
                            : OutputFile::Appears::at_once);
    recording_->packet(info);
  }

  /* A raw packet follows each contact packet. */
  bool raw_expected() const {
    return (streams_ & WIRE_STREAM_RAW) != 0 && (streams_ & WIRE_STREAM_CONTACT) != 0;
  }

  void event(const std::string &text) {
    if (recording_ && can_write()) {
      recording_->event(text + " " + utc_now());
    }
  }

  /* Waits for the port and starts it anew. */
  void wait_for_return() {
    model_.set_state(Model::State::gone);
    event(EVENT_GONE);
    for (;;) {
      while (!session_.reopen()) {
        if (is_stop_wanted()) {
          throw Interrupted();
        }
        std::this_thread::sleep_for(REOPEN_INTERVAL);
      }
      try {
        connect();
        return;
      } catch (const Gone &) {
        model_.set_state(Model::State::gone);
      }
    }
  }

  void revive_if_stalled() {
    auto silence_s = model_.seconds_since_frame();
    auto now = Clock::now();
    if (now - revived_ > REVIVE_AFTER &&
        (!silence_s || *silence_s > std::chrono::duration<double>(REVIVE_AFTER).count())) {
      revived_ = now;
      session_.send(command_stream(streams_));
    }
  }

  /* Why it ended. */
  std::string stream_until_end() {
    bool there = true;
    try {
      connect();
    } catch (const Gone &) {
      there = false;
    }
    for (;;) {
      if (is_stop_wanted()) {
        return "interrupted";
      }
      if (options_.seconds && model_.frames() > 0 && model_.seconds() >= *options_.seconds) {
        return "seconds";
      }
      if (!there) {
        if (options_.until_gone) {
          return "gone";
        }
        wait_for_return();
        there = true;
      }
      there = session_.poll(POLL) != Transport::Result::gone;
      revive_if_stalled();
    }
  }

  void stop_streams() {
    if (model_.state() != Model::State::live) {
      return;
    }
    try {
      session_.command(command_stream(0), {milliseconds(500), 2});
    } catch (const Gone &) {
      event(EVENT_GONE);
    } catch (const Error &) {
      event("no answer to the end of the streams");
    }
  }

  const LiveOptions &options_;
  std::unique_ptr<Transport> transport_;
  Session session_;
  const bool to_standard_output_ = options_.recording == STANDARD_OUTPUT;
  std::unique_ptr<OutputFile> raw_bytes_;
  std::unique_ptr<RecordingWriter> recording_;
  Model model_;
  std::unique_ptr<View> view_;
  std::string note_;
  std::uint8_t streams_ = 0; /* of those wanted, what the firmware has */
  bool stopping_ = false;
  bool quit_ = false;
  Clock::time_point revived_{};
};

} // namespace

std::string utc_now() {
  auto now = std::chrono::system_clock::now();
  std::time_t seconds = std::chrono::system_clock::to_time_t(now);
  auto ms = std::chrono::duration_cast<milliseconds>(now.time_since_epoch()).count() % 1000;
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", &parts);
  char whole[48];
  std::snprintf(whole, sizeof whole, "%s.%03dZ", text, static_cast<int>(ms));
  return whole;
}

int run_live(const LiveOptions &options) {
  check_outputs(options);
  return Live(options).run();
}

} // namespace fingertip
