#include "simulation/cell/emulated_fingertip.hpp"

#include "grasp/convert.hpp"
#include "libfingertip/command.hpp"
#include "libfingertip/names.hpp"

extern "C" {
#include "common/contact_flags.h"
#include "config/geometry.h"
}

#include <algorithm>
#include <stdexcept>

namespace fingertip::cell {
namespace {

constexpr int CLOCK_EXCHANGES = 8;

} // namespace

EmulatedFingertip::EmulatedFingertip(const pad_profile &profile, const calibration &calibration)
    : commands_{command_pad(profile), command_calibrate(calibration, geometry.sensor_count)} {
  commands_.insert(commands_.end(), CLOCK_EXCHANGES, command_stream(0));
  commands_.push_back(command_stream(WIRE_STREAM_CONTACT));
}

std::vector<std::uint8_t> EmulatedFingertip::to_send(std::int64_t now_us) {
  if (commands_.empty() || awaits_ || now_us <= 0) {
    return {};
  }
  awaits_ = true;
  wire_packet command = commands_.front();
  command.sequence = ++sequence_;
  command.t_us = static_cast<std::uint64_t>(now_us);
  return frame_bytes(command);
}

void EmulatedFingertip::obeyed(const wire_packet &packet, std::int64_t now_us) {
  const wire_ack &ack = packet.body.ack;
  if (!awaits_ || ack.sequence != sequence_) {
    return;
  }
  if (ack.result != WIRE_RESULT_DONE) {
    throw std::runtime_error("a fingertip refuses the command " + command_name(ack.command) + " with result " +
                             std::to_string(ack.result));
  }
  clock_.add({static_cast<std::int64_t>(ack.host_time_us), now_us, packet.t_us});
  awaits_ = false;
  commands_.pop_front();
}

EmulatedFingertip::Frame EmulatedFingertip::frame_of(const wire_packet &packet, double arrived_us,
                                                     std::int64_t now_us) {
  tared_ = (packet.body.contact.flags & CONTACT_FLAG_TARED) != 0;
  const double measured_us = std::clamp(clock_.estimate()->host_at(packet.t_us), 0.0, static_cast<double>(now_us));
  return {measured_us, arrived_us, touch_from_packet(packet, measured_us)};
}

double EmulatedFingertip::clock_uncertainty_us() const {
  return is_clock_known() ? clock_.estimate()->uncertainty_us : 0.0;
}

} // namespace fingertip::cell
