// What a fingertip lacks for a grasp.
#pragma once

#include "libfingertip/wire.hpp"

#include <string>
#include <vector>

namespace fingertip {

// Throws Error, code other: it cannot take part in a grasp at all. name: of the fingertip.
void check_for_grasp(const std::string &name, const wire_info &info, const wire_health &health);

// The deficiencies that allow a grasp, a line for each with what to do. needs_load: the force follows the load.
std::vector<std::string> lacks_for_grasp(const wire_info &info, bool needs_load);

} // namespace fingertip
