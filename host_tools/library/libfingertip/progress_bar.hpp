/* The progress of a long job and, above 1 %, the time that is left, on stderr: in place on a terminal, elsewhere a line every ten seconds.
 */
#pragma once

#include "libfingertip/clock.hpp"

#include <string>

namespace fingertip {

class ProgressBar {
public:
  explicit ProgressBar(const std::string &what);
  ~ProgressBar(); /* on a terminal the next message has the line for itself */
  ProgressBar(const ProgressBar &) = delete;
  ProgressBar &operator=(const ProgressBar &) = delete;

  void show(double share); /* 0..1 */

private:
  std::string what_;
  bool in_place_;
  HostTime begun_ = host_now(), next_;
};

} // namespace fingertip
