/* A fingertip on its port, shown and recorded until something ends it. */
#pragma once

#include "cli/terminal.hpp"
#include "libfingertip/connection.hpp"

#include <cstdint>
#include <optional>
#include <string>

namespace fingertip {

inline constexpr const char *STANDARD_OUTPUT = "-";

struct LiveOptions {
  Choice choice;
  std::uint8_t streams = 0;
  std::optional<double> seconds; /* of device time, counted from the first frame */
  std::string recording;         /* empty: none; "-": standard output, if it is no monitor */
  std::string raw_bytes;         /* empty: none */
  bool overwrite = false;
  bool until_gone = false; /* end when the port vanishes, instead of waiting for it */
  bool monitor = true;     /* else a line of progress */
  ColourMode colour = ColourMode::automatic;
};

/* Now, as recordings write it. */
std::string utc_now();

/* Exit status. Throws Error. */
int run_live(const LiveOptions &options);

} // namespace fingertip
