#include "cell/emulated_fingertip.hpp"

#include "libfingertip/command.hpp"
#include "libfingertip/names.hpp"

extern "C" {
#include "common/contact_flags.h"
#include "config/geometry.h"
}

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace fingertip::cell {
namespace {

constexpr int CLOCK_EXCHANGES = 8;

std::int32_t in_thousandths(float value) {
  return static_cast<std::int32_t>(std::lround(1e3 * static_cast<double>(value)));
}

// What no VALID flag stands for is 0 in the packet.
grip_touch touch_of(const wire_contact &contact, std::uint64_t t_us) {
  grip_touch touch{};
  touch.t_us = t_us;
  touch.flags = contact.flags;
  touch.force_mN = in_thousandths(contact.force_N);
  touch.force_sd_mN = in_thousandths(contact.force_sd_N);
  touch.x_um = in_thousandths(contact.x_mm);
  touch.y_um = in_thousandths(contact.y_mm);
  touch.location_sd_um = in_thousandths(contact.location_sd_mm);
  touch.qx_mN = in_thousandths(contact.qx_N);
  touch.qy_mN = in_thousandths(contact.qy_N);
  touch.q_sd_mN = in_thousandths(contact.q_sd_N);
  touch.vx_um_s = in_thousandths(contact.vx_mm_s);
  touch.vy_um_s = in_thousandths(contact.vy_mm_s);
  return touch;
}

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
    throw std::runtime_error("a fingertip refuses the command " + command_name(ack.command) +
                             " with result " + std::to_string(ack.result));
  }
  clock_.add({static_cast<std::int64_t>(ack.host_time_us), now_us, packet.t_us});
  awaits_ = false;
  commands_.pop_front();
}

EmulatedFingertip::Frame EmulatedFingertip::frame_of(const wire_packet &packet, double arrived_us,
                                                     std::int64_t now_us) {
  const wire_contact &contact = packet.body.contact;
  tared_ = (contact.flags & CONTACT_FLAG_TARED) != 0;
  const double measured_us =
      std::clamp(clock_.estimate()->host_at(packet.t_us), 0.0, static_cast<double>(now_us));
  return {measured_us, arrived_us,
          touch_of(contact, static_cast<std::uint64_t>(std::llround(measured_us)))};
}

double EmulatedFingertip::clock_uncertainty_us() const {
  return is_clock_known() ? clock_.estimate()->uncertainty_us : 0.0;
}

} // namespace fingertip::cell
