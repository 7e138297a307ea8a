#include "tool/cli/calibrate_device.hpp"

#include "libfingertip/clock.hpp"
#include "libfingertip/command.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/text.hpp"
#include "tool/cli/names_of_values.hpp"

#include <cstdio>
#include <cstring>
#include <poll.h>
#include <unistd.h>

namespace fingertip {

namespace {

constexpr std::chrono::milliseconds DEVICE_POLL{20};
constexpr std::int64_t PATIENCE_us = 5000000;        /* without a frame */
constexpr std::chrono::milliseconds ASKED_STOP{100}; /* between two checks for a stop */

} // namespace

void ask(const CalibrateOptions &options, const std::string &question, const std::string &otherwise) {
  if (options.yes) {
    return;
  }
  if (!isatty(STDIN_FILENO)) {
    throw Error(otherwise + "; give --yes without a terminal");
  }
  std::printf("\n%s [y/N] ", question.c_str());
  std::fflush(stdout);
  char line[64] = "";
  pollfd waiting = {STDIN_FILENO, POLLIN, 0};
  while (wait_for(&waiting, 1, host_now() + ASKED_STOP) <= 0) {
    if (stop_requested()) {
      throw Interrupted();
    }
  }
  if (!std::fgets(line, sizeof line, stdin) || (line[0] != 'y' && line[0] != 'Y')) {
    throw Error(otherwise);
  }
}

CalibratedDevice::CalibratedDevice(const CalibrateOptions &options)
    : transport_(open_way(choose_way(options.choice))),
      session_(*transport_, [this] { return !ending_ && stop_requested(); }), info_(session_.info().body.info) {}

CalibratedDevice::~CalibratedDevice() {
  if (streaming_) {
    session_.send(command_stream(0));
  }
}

void CalibratedDevice::check_sensors() {
  const std::uint32_t missing = missing_sensors(session_.health().body.health.sensors_present, info_.sensor_count);
  if (missing) {
    throw Error(name() + ": sensors do not answer: " + sensors_text(missing) +
                "; mend their wiring first, a calibration is of all of them");
  }
}

void CalibratedDevice::check_is(const wire_info &recorded, const std::string &recording) const {
  if (std::strncmp(recorded.serial, info_.serial, WIRE_TEXT_BYTES) != 0) {
    throw Error(printable(recording) + ": is of fingertip " + text_field(recorded.serial) + ", and this is " +
                text_field(info_.serial) + "; calibrate each by its own");
  }
}

void CalibratedDevice::follow(std::uint8_t streams, std::uint8_t of_frames,
                              const std::function<void(const wire_packet &)> &take,
                              const std::function<bool()> &goes_on) {
  std::int64_t last_frame_us = steady_now_us();
  session_.on_packet([&](const wire_packet &packet) {
    if (packet.type == of_frames) {
      last_frame_us = steady_now_us();
      take(packet);
    }
  });
  session_.command(command_stream(streams));
  streaming_ = true;
  while (goes_on()) {
    if (stop_requested()) {
      throw Interrupted();
    }
    if (session_.poll(DEVICE_POLL) == Transport::Result::gone) {
      throw Error(name() + ": vanished; nothing was written, plug it in and try again");
    }
    if (steady_now_us() - last_frame_us > PATIENCE_us) {
      throw Error(name() + ": sends no frames; see that its sensors answer (fingertip info)");
    }
  }
  session_.on_packet({});
  streaming_ = false;
  session_.command(command_stream(0));
}

void CalibratedDevice::send(const wire_packet &command) {
  ending_ = true;
  session_.command(command);
  info_ = session_.info().body.info;
}

void CalibratedDevice::write(const calibration &made) {
  send(command_calibrate(made, info_.sensor_count));
  if (!(info_.stored & WIRE_STORED_CALIBRATION) || info_.calibration.date_s != made.date_s) {
    throw Error(name() + ": did not keep the calibration; see fingertip info");
  }
}

void CalibratedDevice::write(const pad_profile &pad) {
  send(command_pad(pad));
  if (!(info_.stored & WIRE_STORED_PAD) || info_.pad.tangential_scale != pad.tangential_scale) {
    throw Error(name() + ": did not keep the pad's profile; see fingertip info");
  }
}

} // namespace fingertip
