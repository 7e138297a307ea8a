/* Several fingertips while they are recorded: a line a second on standard error, renewed in place
 * if that is a terminal. */
#pragma once

#include "libfingertip/clock.hpp"
#include "tool/cli/model.hpp"

#include <chrono>
#include <vector>

namespace fingertip {

class JointProgress {
public:
  ~JointProgress();
  /* Called often. */
  void update(const std::vector<Model> &models, double seconds, double alignment_us);

private:
  HostTime next_{};
  bool shown_ = false;
};

} // namespace fingertip
