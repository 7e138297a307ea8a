#include "grasp/fingertip.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip {

// At this frame rate an object at 0.1 m/s slides by a millimetre between two frames.
constexpr std::uint32_t RATE_mHz = 100000;

GripTouch touch_from_packet(const wire_packet &packet, double host_us) {
  const wire_contact &contact = packet.body.contact;
  const std::uint32_t flags = contact.flags;
  const auto under = [flags](contact_flag flag, float value) {
    return (flags & flag) != 0 && std::isfinite(value) ? static_cast<double>(value) : 0.0;
  };
  GripTouch touch;
  touch.t_s = 1e-6 * std::max(host_us, 0.0);
  touch.flags = flags;
  touch.force_N = under(CONTACT_FLAG_FIT_VALID, contact.force_N);
  touch.x_mm = under(CONTACT_FLAG_FIT_VALID, contact.x_mm);
  touch.y_mm = under(CONTACT_FLAG_FIT_VALID, contact.y_mm);
  touch.force_sd_N = under(CONTACT_FLAG_UNCERTAINTY_VALID, contact.force_sd_N);
  touch.sigma_mm = under(CONTACT_FLAG_FIT_VALID, contact.sigma_mm);
  touch.qx_N = under(CONTACT_FLAG_TANGENTIAL_VALID, contact.qx_N);
  touch.qy_N = under(CONTACT_FLAG_TANGENTIAL_VALID, contact.qy_N);
  touch.q_sd_N = under(CONTACT_FLAG_TANGENTIAL_VALID, contact.q_sd_N);
  touch.speed_x_mm_s = under(CONTACT_FLAG_VELOCITY_VALID, contact.vx_mm_s);
  touch.speed_y_mm_s = under(CONTACT_FLAG_VELOCITY_VALID, contact.vy_mm_s);
  return touch;
}

void check_for_grasp(const std::string &name, const wire_info &info, const wire_health &health) {
  if ((info.capabilities & WIRE_CAPABILITY_FIT) == 0) {
    throw Error(name + ": firmware of scene " + text_field(info.scene) + " reports no force; flash scene grasp");
  }
  if ((health.sensors_present & first_sensors(info.sensor_count)) == 0) {
    throw Error(name + ": none of its sensors answers; see their wiring and supply (fingertip info)");
  }
}

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
  if (info.rate_mHz != 0 && info.rate_mHz < RATE_mHz) {
    lacks.push_back("sees slides late at " + fixed(info.rate_mHz / 1e3, 1) + " frames a second: fingertip set rate=max");
  }
  return lacks;
}

} // namespace fingertip
