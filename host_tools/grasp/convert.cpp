#include "grasp/convert.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip {

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

} // namespace fingertip
