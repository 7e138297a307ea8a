// A fingertip as a grasp takes it: its reports, and what it lacks.
#pragma once

#include "grasp/control/grip.hpp"
#include "libfingertip/wire.hpp"

#include <string>
#include <vector>

namespace fingertip {

// A contact as the controller takes it. host_us: when the frame was measured. What is no number counts as 0.
GripTouch touch_from_packet(const wire_packet &contact, double host_us);

// Throws Error, code other: it cannot take part in a grasp at all. name: of the fingertip.
void check_for_grasp(const std::string &name, const wire_info &info, const wire_health &health);

// The deficiencies that allow a grasp, a line for each with what to do. needs_load: the force follows the load.
std::vector<std::string> lacks_for_grasp(const wire_info &info, bool needs_load);

} // namespace fingertip
