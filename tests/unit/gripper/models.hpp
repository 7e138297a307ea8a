/* What the tests of all models share. */
#pragma once

#include "support/gripper_lines.hpp"

#include <gtest/gtest.h>

namespace fingertip::test {

inline GripperServer::Options served(const std::string &model, std::vector<int> functions = {3, 4, 16, 23}) {
  return {.model = model, .functions = std::move(functions)};
}

inline std::unique_ptr<Gripper> opened(const std::string &model, const std::string &port) {
  return open_gripper({.model = model, .port = port});
}

/* Less than a second passes from one poll to the next: it would be a fault. */
template <typename Until> GripperStatus wait_for(Served &simulated, Gripper &gripper, Until until) {
  for (int i = 0; i < 100; i++) {
    const GripperStatus status = gripper.poll();
    if (until(status)) {
      return status;
    }
    simulated.pass(0.3);
  }
  ADD_FAILURE() << "it never came";
  return {};
}

inline bool rests(const GripperStatus &status) { return !status.moving; }

inline bool is_active(const GripperStatus &status) { return status.active; }

inline std::unique_ptr<Gripper> activated(const std::string &model, Served &simulated) {
  std::unique_ptr<Gripper> gripper = opened(model, simulated.port());
  gripper->activate();
  wait_for(simulated, *gripper, is_active);
  return gripper;
}

inline GripperStatus moved(Served &simulated, Gripper &gripper, const GripCommand &move) {
  const GripperStatus first = gripper.move(move);
  EXPECT_TRUE(first.active);
  EXPECT_FALSE(first.moving && first.object);
  return wait_for(simulated, gripper, rests);
}

template <typename Act> ErrorCode code_of(Act act) {
  try {
    act();
  } catch (const Error &error) {
    EXPECT_NE(std::string(error.what()), "");
    return error.code();
  }
  ADD_FAILURE() << "nothing was thrown";
  return ErrorCode::other;
}

} // namespace fingertip::test
