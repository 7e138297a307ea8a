// Every fault in every state of a grasp, on every gripper and object.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>

namespace fingertip::grasp {

// A row each: what was reported, how far the fingers opened, the largest true force, whether the object was
// crushed, and which rules were broken. Of fingertips whose readings froze before they touched nothing can be
// reported: `untold`.
nlohmann::ordered_json fault_rows(std::uint64_t jobs);

} // namespace fingertip::grasp
