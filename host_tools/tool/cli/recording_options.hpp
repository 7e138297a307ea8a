/* The options that monitor and record share. */
#pragma once

#include "tool/cli/command_line.hpp"
#include "tool/cli/live.hpp"

namespace fingertip {

/* Which fingertips: one, several, or all. */
struct Several {
  Choice choice; /* without the device */
  std::vector<std::string> devices;
  bool all = false;

  bool is_several() const { return all || devices.size() > 1; }
};

void with_several(CLI::App *command, Several &several);
/* Throws Error if there is none, or it is not clear which. */
std::vector<Way> ways_of(const Several &several);

void with_seconds(CLI::App *command, std::optional<double> &seconds, const std::string &help);
void with_recording(CLI::App *command, LiveOptions &options);

} // namespace fingertip
