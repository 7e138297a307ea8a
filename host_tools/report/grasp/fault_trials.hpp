// Every fault in every state of a grasp, on every gripper and object: what came of it.
#pragma once

#include "simulation/cell/trial.hpp"

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace fingertip::grasp {

// Opening by less is still holding: a first grip comes down to what the load needs. A paper cup is
// the softest, and gives 1.07 mm.
constexpr double OPENS_mm = 1.2;
struct FaultTrial {
  std::string fault, state, gripper, object;
  cell::Trial trial;
  double cap_N;
  // What must be reported, of GripTrouble: each of these, one of those; and where it must end.
  std::uint32_t all_of = 0, any_of = 0;
  std::vector<std::uint8_t> ends_in; // empty: anywhere
  std::uint8_t gripper_fault = 0;
  double opens_mm;        // that it may open; infinity where it is asked to
  bool is_untold = false; // the frames are those of fingertips that nothing touches
};

// Of fingertips whose readings froze before they touched (is_untold) nothing can be reported.
std::vector<FaultTrial> fault_trials();

struct FaultOutcome {
  cell::Outcome outcome;
  bool opened, beyond_cap, unsaid;
};

// For several threads at once. cache: folder of the contact tables.
class FaultRunner {
public:
  explicit FaultRunner(const std::string &cache);
  FaultOutcome run(const FaultTrial &trial) const;

private:
  std::map<std::string, cell::Face> faces_;
};

} // namespace fingertip::grasp
