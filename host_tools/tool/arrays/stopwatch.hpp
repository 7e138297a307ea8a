#pragma once

#include <time.h>

namespace fingertip::measure {

// Processor time of this thread: what others run meanwhile does not count.
class Stopwatch {
public:
  double us() const { return now_us() - begun_us_; }

private:
  static double now_us() {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
  }
  double begun_us_ = now_us();
};

} // namespace fingertip::measure
