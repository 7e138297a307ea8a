// The reports of fingertips and grippers as the controller's core takes them: integers, on the
// host's steady clock in us. Numbers beyond a field's range end at its limits.
#pragma once

#include "grasp/core.hpp"
#include "grasp/gripper/gripper.hpp"
#include "libfingertip/wire.hpp"

namespace fingertip {

// host_us: when the frame was measured.
grip_touch touch_from_packet(const wire_packet &contact, double host_us);

grip_traits core_traits(const GripperTraits &traits);
grip_status core_status(const GripperStatus &status);
GripperMove gripper_move(const grip_command &command);

} // namespace fingertip
