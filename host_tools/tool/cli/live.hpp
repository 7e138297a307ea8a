/* Fingertips on their ports, shown and recorded until something ends it; one and many alike. */
#pragma once

#include "libfingertip/connection.hpp"
#include "tool/cli/terminal.hpp"

#include <optional>
#include <string>
#include <vector>

namespace fingertip {

inline constexpr const char *STDOUT_NAME = "-";

struct LiveOptions {
  std::optional<double> seconds; /* of device time from the first frame; of several fingertips, of
                                    the host's time from their common start */
  std::string recording;         /* empty: none; "-": standard output, if it is no monitor */
  std::string raw_bytes;         /* of one fingertip; empty: none */
  bool overwrite = false;
  bool until_gone = false; /* end when a port vanishes, instead of waiting for it */
  bool monitor = true;     /* else a line of progress */
  ColourMode colour = ColourMode::automatic;
};

/* Before a port is opened, so that a wrong path costs nothing. Throws Error. */
void check_outputs(const LiveOptions &options);

/* Exit status. Throws Error. */
int run_live(const LiveOptions &options, const std::vector<Way> &ways);

} // namespace fingertip
