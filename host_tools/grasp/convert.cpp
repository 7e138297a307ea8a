#include "grasp/convert.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip {

namespace {

constexpr double LIMIT = 2e9;

std::int32_t thousandths(double value) {
  return static_cast<std::int32_t>(std::lround(std::clamp(1e3 * value, -LIMIT, LIMIT)));
}

std::int32_t millionths(double value) {
  return static_cast<std::int32_t>(std::lround(std::clamp(1e6 * value, -LIMIT, LIMIT)));
}

} // namespace

grip_touch touch_from_packet(const wire_packet &packet, double host_us) {
  const wire_contact &contact = packet.body.contact;
  const std::uint32_t flags = contact.flags;
  const auto under = [flags](contact_flag flag, float value) {
    return (flags & flag) != 0 ? thousandths(static_cast<double>(value)) : 0;
  };
  grip_touch touch{};
  touch.t_us = static_cast<std::uint64_t>(std::max(host_us, 0.0));
  touch.flags = flags;
  touch.force_mN = under(CONTACT_FLAG_FIT_VALID, contact.force_N);
  touch.x_um = under(CONTACT_FLAG_FIT_VALID, contact.x_mm);
  touch.y_um = under(CONTACT_FLAG_FIT_VALID, contact.y_mm);
  touch.force_sd_mN = under(CONTACT_FLAG_UNCERTAINTY_VALID, contact.force_sd_N);
  touch.sigma_um = under(CONTACT_FLAG_FIT_VALID, contact.sigma_mm);
  touch.qx_mN = under(CONTACT_FLAG_TANGENTIAL_VALID, contact.qx_N);
  touch.qy_mN = under(CONTACT_FLAG_TANGENTIAL_VALID, contact.qy_N);
  touch.q_sd_mN = under(CONTACT_FLAG_TANGENTIAL_VALID, contact.q_sd_N);
  touch.vx_um_s = under(CONTACT_FLAG_VELOCITY_VALID, contact.vx_mm_s);
  touch.vy_um_s = under(CONTACT_FLAG_VELOCITY_VALID, contact.vy_mm_s);
  return touch;
}

grip_traits core_traits(const GripperTraits &traits) {
  grip_traits core{};
  core.stroke_um = thousandths(traits.stroke_mm);
  core.step_um = thousandths(traits.step_mm);
  core.deadband_um = thousandths(traits.deadband_mm);
  core.speed_min_um_s = thousandths(traits.speed_min_mm_s);
  core.speed_max_um_s = thousandths(traits.speed_max_mm_s);
  core.force_min_mN = thousandths(traits.force_min_N);
  core.force_max_mN = thousandths(traits.force_max_N);
  core.latency_us = millionths(traits.latency_s);
  core.poll_us = millionths(traits.poll_s);
  return core;
}

grip_status core_status(const GripperStatus &status) {
  grip_status core{};
  core.t_us = static_cast<std::uint64_t>(std::max<std::int64_t>(status.host_us, 0));
  core.width_um = thousandths(status.width_mm);
  core.is_active = status.active;
  core.is_moving = status.moving;
  core.object = !status.object   ? GRIP_OBJECT_UNKNOWN
                : *status.object ? GRIP_OBJECT_HELD
                                 : GRIP_OBJECT_NONE;
  core.fault = status.fault;
  return core;
}

GripperMove gripper_move(const grip_command &command) {
  return {command.width_um / 1e3, command.speed_um_s / 1e3, command.force_mN / 1e3};
}

} // namespace fingertip
