/* The options by which a gripper is reached, for the commands that do. */
#pragma once

#include "grasp/gripper/gripper.hpp"
#include "tool/cli/command_line.hpp"

#include <memory>

namespace fingertip {

/* What its line and its positions are, where they are not the usual. */
void with_gripper_line(CLI::App *command, GripperWay &way);

/* With an empty port the only one on USB that may be a gripper's. Throws WrongUsage, and Error with the advice in it. */
std::unique_ptr<Gripper> reach_gripper(GripperWay &way);

/* A gripper's error, with what to do. */
Error with_gripper_advice(const Error &error);

} // namespace fingertip
