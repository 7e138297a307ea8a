/* Several fingertips recorded into one file on one clock, until something ends it. */
#pragma once

#include "cli/live.hpp"
#include "libfingertip/connection.hpp"

#include <vector>

namespace fingertip {

/* Exit status. Throws Error. Each fingertip has a thread of its own, so that none waits for another
 * and arrivals are timed as they happen. */
int run_joint(const LiveOptions &options, const std::vector<Way> &ways);

} // namespace fingertip
