#include "tool/cli/validate_live.hpp"

#include "libfingertip/command.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/output_file.hpp"
#include "libfingertip/recording.hpp"
#include "libfingertip/text.hpp"
#include "tool/calibration/gain_session.hpp"
#include "tool/cli/device.hpp"
#include "tool/cli/ink.hpp"
#include "tool/validation/pull_figures.hpp"
#include "tool/validation/walk.hpp"

#include <algorithm>
#include <cstdio>
#include <cstring>

namespace fingertip {
namespace {

using validating::Step;
using validating::Walk;

constexpr std::chrono::milliseconds DEVICE_POLL{20}, REDRAW{200};
constexpr std::int64_t PATIENCE_us = 5000000; /* without a frame */

/* What to do, on the whole screen or as lines. */
class Guide {
public:
  explicit Guide(ColourMode mode) {
    if (const auto depth = screen_depth(mode)) {
      screen_.emplace(*depth);
    }
  }

  void update(const Walk &walk) {
    const std::string advice = walk.advice();
    if (!screen_) {
      /* Seconds that go by are no news. */
      const std::string news = advice.substr(0, advice.find(": "));
      if (news != told_) {
        std::printf("%s\n", advice.c_str());
        std::fflush(stdout);
        told_ = news;
      }
      return;
    }
    if (host_now() < next_) {
      return;
    }
    next_ = host_now() + REDRAW;
    Canvas canvas(screen_->columns(), screen_->rows());
    const int bar = std::max(screen_->columns() - 4, 10);
    const int done = static_cast<int>(walk.progress() * bar);
    canvas.text(2, 1, "fingertip validate", text_style(INK, true));
    canvas.text(2, 3, advice, text_style(WHITE, true));
    canvas.text(2, 5, std::string(static_cast<std::size_t>(done), '='), text_style(GOOD));
    canvas.text(2 + done, 5, std::string(static_cast<std::size_t>(bar - done), '-'), text_style(RULE));
    canvas.text(2, screen_->rows() - 1, "q quit   u take the last one back", text_style(FAINT));
    screen_->draw(canvas);
  }
  std::optional<Key> key() { return screen_ ? screen_->key() : std::nullopt; }

private:
  std::optional<Screen> screen_;
  std::string told_;
  HostTime next_{};
};

/* Frames come at the validation's rate for as long as this lives. */
class Rate {
public:
  Rate(Session &session, const wire_info &info) : session_(session), before_mHz_(info.rate_mHz) {
    session.command(command_rate_mHz(static_cast<std::uint32_t>(1000.0 * validating::RATE_Hz)));
  }
  ~Rate() {
    session_.send(command_stream(0));
    session_.send(command_rate_mHz(before_mHz_));
  }
  Rate(const Rate &) = delete;
  Rate &operator=(const Rate &) = delete;

private:
  Session &session_;
  const std::uint32_t before_mHz_;
};

} // namespace

validating::Measured validate_live(const ValidateOptions &options) {
  check_output(options.recording, options.overwrite);
  Device device(options.choice);
  wire_info info = device.session.info().body.info;
  const std::string name = device.transport->description();
  Rate rate(device.session, info);
  wire_packet ready = device.session.info();
  info = ready.body.info;
  calibrating::check_firmware(info, name);
  if (const std::string why = validating::why_no_pull(info); options.pulling.weight_g > 0.0 && !why.empty()) {
    std::fprintf(stderr, "fingertip: %s\n", why.c_str());
  }
  if (!options.serial) {
    std::memset(info.serial, 0, sizeof info.serial);
  }
  Walk walk(info, options.weight_g, options.skin_mm, options.pulling);
  /* Nothing but what was measured: no port, no place, no name. */
  RecordingWriter writer(options.recording, options.overwrite, &info, info.sensor_count,
                         Metadata{{"recorded_by", "fingertip " FINGERTIP_VERSION}}, true, OutputFile::Appears::at_once);
  ready.body.info = info;
  writer.packet(ready);
  Guide guide(options.colour);
  std::int64_t last_frame_us = steady_now_us();
  const auto keep = [&](const std::vector<Step> &begun) {
    for (const Step &step : begun) {
      writer.event(validating::event_of(step));
    }
  };
  device.session.on_packet([&](const wire_packet &packet) {
    if (packet.type == WIRE_RAW) {
      last_frame_us = steady_now_us();
    }
    if (!walk.is_done() && (packet.type == WIRE_RAW || packet.type == WIRE_CONTACT)) {
      writer.packet(packet);
      keep(walk.take(packet));
    }
  });
  device.session.command(command_stream(WIRE_STREAM_CONTACT | WIRE_STREAM_RAW));
  const auto finish = [&](const char *reason) {
    device.session.on_packet({});
    writer.finish(device.session.statistics(), reason);
  };
  while (!walk.is_done()) {
    guide.update(walk);
    bool is_ended = stop_requested();
    while (const auto key = guide.key()) {
      is_ended = is_ended || *key == 'q';
      if (*key == 'u') {
        keep(walk.take_back());
      }
    }
    if (is_ended) {
      finish("interrupted");
      throw Interrupted();
    }
    if (device.session.poll(DEVICE_POLL) == Transport::Result::gone) {
      finish("gone");
      throw Error(name + ": vanished; plug it in and validate again");
    }
    if (steady_now_us() - last_frame_us > PATIENCE_us) {
      finish("silent");
      throw Error(name + ": sends no frames; see that its sensors answer (fingertip info)");
    }
  }
  finish("done");
  return walk.finish();
}

} // namespace fingertip
