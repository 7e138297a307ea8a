// Many grasps of some kinds with one controller: how they went.
#pragma once

#include "simulation/cell/kind_trial.hpp"

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace fingertip::grasp {

struct KindOptions {
  std::string kind = "usual"; // or several by turns, split by commas
  std::string gripper = gripper_models().front().model;
  // ours, textbook, fixed (15 N), paper: eq. (5) and (6) at 6 N, oracle
  std::string controller = "ours";
  std::string settings; // of ours: name=value, split by commas
  double later_s = 0.0; // delay of all frames
  std::uint64_t seed = 1, first = 0, count = 100, jobs = 2;
  bool each = false;
};

// Throws std::runtime_error for what there is not.
nlohmann::ordered_json kind_row(const KindOptions &options);
// All that is known of grasp `first`, every 2 ms.
nlohmann::ordered_json kind_trace(const KindOptions &options);

} // namespace fingertip::grasp
