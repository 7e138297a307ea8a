/* The options that monitor and record share. */
#pragma once

#include "cli/command_line.hpp"
#include "cli/live.hpp"

namespace fingertip {

void with_recording(CLI::App *command, LiveOptions &options);

} // namespace fingertip
