// Every fault in every state of a grasp, on every gripper and object.
#pragma once

#include "simulation/cell/face.hpp"

#include <cstdint>
#include <nlohmann/json.hpp>

namespace fingertip::grasp {

// A row each. `untold`: readings froze before they touched, so nothing can be reported.
nlohmann::ordered_json fault_rows(const cell::Face &face, std::uint64_t jobs);

} // namespace fingertip::grasp
