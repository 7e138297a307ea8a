// A fingertip that is an emulated board, from the host's end of its USB line: it gets its pad's
// profile first, then it streams its readings.
//
// Its clock is fitted from commands and their acknowledgements, as the tool does it, on the
// emulated time.
#pragma once

#include "grasp/control/grip.hpp"
#include "libfingertip/clock_fit.hpp"
#include "libfingertip/decoder.hpp"

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

namespace fingertip::cell {

class EmulatedFingertip {
public:
  // What it knows for good of its rubber; it streams once that is stored.
  EmulatedFingertip(const pad_profile &profile, const calibration &calibration);

  // It has obeyed and has a zero.
  bool is_ready() const { return commands_.empty() && tared_; }
  // A command whose time has come; often nothing.
  std::vector<std::uint8_t> to_send(std::int64_t now_us);

  struct Frame {
    double measured_us, arrived_us;
    GripTouch touch;
  };
  // Decodes bytes that came at arrived_us; calls the handler for each frame. Throws
  // std::runtime_error where a command is refused.
  template <typename Handler>
  void take(const std::uint8_t *bytes, std::size_t length, double arrived_us, std::int64_t now_us,
            const Handler &handler) {
    decoder_.feed(bytes, length, [&](const wire_packet &packet) {
      if (packet.type == WIRE_ACK) {
        obeyed(packet, now_us);
      } else if (packet.type == WIRE_CONTACT && is_clock_known()) {
        handler(frame_of(packet, arrived_us, now_us));
      }
    });
  }

  const LineStatistics &line() const { return decoder_.statistics(); }
  double clock_uncertainty_us() const;

private:
  bool is_clock_known() const { return clock_.estimate().has_value(); }
  void obeyed(const wire_packet &packet, std::int64_t now_us);
  Frame frame_of(const wire_packet &packet, double arrived_us, std::int64_t now_us);

  std::deque<wire_packet> commands_; // the first may be under way
  bool awaits_ = false, tared_ = false;
  std::uint16_t sequence_ = 0;
  Decoder decoder_;
  ClockFit clock_;
};

} // namespace fingertip::cell
