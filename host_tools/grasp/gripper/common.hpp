// What all grippers check and report alike.
#pragma once

#include "grasp/gripper/gripper.hpp"

#include <cstdint>
#include <string>

namespace fingertip {

// Throws Error: bad_value.
void check_move(const GripperMove &move);

// way, completed by the model's defaults. Throws Error: bad_value; counts go from 0 to most_count.
struct GripperUsual {
  int slave, most_slave, closed_count, open_count, most_count;
};
GripperWay complete(GripperWay way, const GripperUsual &usual);

// An extra question makes sure that no older answer is on its way. It waits this much longer than any
// other question, and is then asked in another form. An answer that is late by less than that is
// never taken for another's.
constexpr int SURE_TIMEOUTS = 5;

Error silent(const GripperWay &complete);

// "; the USB adapter's latency timer ..." where that limits the rate of a command, which takes so
// many exchanges; "" where it does not.
std::string limited_by(const std::string &port, int exchanges);

} // namespace fingertip
