// A fingertip's report as the controller of a grasp takes it.
#pragma once

#include "grasp/control/grip.hpp"
#include "libfingertip/wire.hpp"

namespace fingertip {

// host_us: when the frame was measured. What is no number counts as 0.
GripTouch touch_from_packet(const wire_packet &contact, double host_us);

} // namespace fingertip
