#include "cli/replay.hpp"

#include "cli/view.hpp"
#include "libfingertip/decoder.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/output_file.hpp"
#include "libfingertip/recording_transport.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>
#include <cstdio>
#include <functional>
#include <optional>
#include <thread>

namespace fingertip {

namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

struct Playback {
  LineStatistics statistics;
  std::uint64_t skipped_lines = 0;
  bool cut_short = false;
};

/* Every packet of the file, until it ends or the handler throws. */
Playback play(const ReplayOptions &options,
              const std::function<void(const wire_packet &, const LineStatistics &)> &handler) {
  RecordingTransport transport(options.file, options.salvage, options.device);
  Decoder decoder;
  std::uint8_t bytes[4096];
  std::size_t length = 0;
  for (;;) {
    if (transport.read(bytes, sizeof bytes, &length, milliseconds(0)) == Transport::Result::data) {
      decoder.feed(bytes, length,
                   [&](const wire_packet &packet) { handler(packet, decoder.statistics()); });
    } else if (transport.reopen()) {
      decoder.restart();
    } else {
      return {decoder.statistics(), transport.skipped_lines(), transport.is_cut_short()};
    }
  }
}

bool is_frame(const wire_packet &packet) {
  return packet.type == WIRE_CONTACT || packet.type == WIRE_RAW;
}

void report_losses(const std::string &file, const Playback &playback) {
  if (playback.skipped_lines > 0) {
    std::fprintf(stderr, "%s: %llu damaged lines skipped\n", printable(file).c_str(),
                 static_cast<unsigned long long>(playback.skipped_lines));
  }
  if (playback.cut_short) {
    std::fprintf(stderr,
                 "%s: no end line: the recording was cut short, its recorder killed or its disk "
                 "full\n",
                 printable(file).c_str());
  }
}

int convert(const ReplayOptions &options) {
  if (is_same_file(options.file, options.to_csv)) {
    throw Error(options.to_csv + ": is the file to read; give --to-csv another name");
  }
  check_output(options.to_csv, options.overwrite);
  std::optional<wire_info> info;
  std::optional<std::uint8_t> sensor_count;
  std::uint64_t frames = 0;
  play(options, [&](const wire_packet &packet, const LineStatistics &) {
    frames += is_frame(packet);
    if (packet.type == WIRE_INFO && !info) {
      info = packet.body.info;
    } else if (packet.type == WIRE_RAW && !sensor_count) {
      sensor_count = packet.body.raw.sensor_count;
    }
  });
  if (frames == 0) {
    throw Error(options.file + ": no frames in it; give a capture of a streaming fingertip");
  }
  bool has_raw = sensor_count.has_value();
  RecordingWriter writer(
      options.to_csv, options.overwrite, info ? &*info : nullptr,
      sensor_count.value_or(info ? info->sensor_count : std::uint8_t{0}),
      {{"recorded_by", "fingertip " FINGERTIP_VERSION}, {"source", options.file}}, has_raw,
      OutputFile::Appears::when_finished);
  Playback playback = play(
      options, [&](const wire_packet &packet, const LineStatistics &) { writer.packet(packet); });
  writer.finish(playback.statistics, "converted");
  report_losses(options.file, playback);
  std::printf("%s: %llu frames, %s\n", printable(options.to_csv).c_str(),
              static_cast<unsigned long long>(writer.frames()), playback.statistics.text().c_str());
  return 0;
}

class Ended : public std::exception {};

/* Keeps the recorded pace. */
class Pace {
public:
  explicit Pace(double speed) : speed_(speed) {}

  /* When to show a frame of this device time. */
  Clock::time_point due(std::uint64_t t_us) {
    if (!zero_us_ || t_us < last_us_) {
      zero_us_ = t_us; /* begin, or the device restarted */
      zero_ = Clock::now();
    }
    last_us_ = t_us;
    return zero_ +
           std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double, std::micro>(
               static_cast<double>(t_us - *zero_us_) / speed_));
  }

private:
  double speed_;
  std::optional<std::uint64_t> zero_us_;
  std::uint64_t last_us_ = 0;
  Clock::time_point zero_;
};

int show(const ReplayOptions &options) {
  Model model;
  model.set_state(Model::State::replay);
  std::unique_ptr<View> view = make_monitor_view(options.colour);
  Pace pace(options.speed);
  Playback playback;
  std::string note = printable(options.file);
  auto update = [&] {
    view->update(model, note);
    auto key = view->key();
    if (stop_requested() || (key && *key == 'q')) {
      throw Ended();
    }
  };
  try {
    playback = play(options, [&](const wire_packet &packet, const LineStatistics &statistics) {
      if (is_frame(packet) && options.speed > 0) {
        auto due = pace.due(packet.t_us);
        while (Clock::now() < due) {
          update();
          std::this_thread::sleep_until(std::min(due, Clock::now() + milliseconds(20)));
        }
      }
      model.set_statistics(statistics);
      model.take(packet);
      update();
    });
    model.set_statistics(playback.statistics);
  } catch (const Ended &) {
  }
  view.reset();
  if (model.frames() == 0) {
    throw Error(options.file +
                ": no frames in it; give a recording or capture of a streaming fingertip");
  }
  report_losses(options.file, playback);
  std::printf("%s: %s\n", printable(options.file).c_str(), summary_text(model).c_str());
  return 0;
}

} // namespace

int run_replay(const ReplayOptions &options) {
  return options.to_csv.empty() ? show(options) : convert(options);
}

} // namespace fingertip
