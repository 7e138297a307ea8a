/* Recordings and captures: shown again, or turned from bytes into a recording. */
#pragma once

#include "cli/terminal.hpp"

#include <string>

namespace fingertip {

struct ReplayOptions {
  std::string file;
  double speed = 1; /* 0: as fast as possible */
  bool salvage = false;
  std::string device; /* of several in the file */
  std::string to_csv; /* empty: show it */
  bool overwrite = false;
  ColourMode colour = ColourMode::automatic;
};

/* Exit status. Throws Error. */
int run_replay(const ReplayOptions &options);

} // namespace fingertip
