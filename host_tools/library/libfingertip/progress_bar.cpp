#include "libfingertip/progress_bar.hpp"

#include "libfingertip/text.hpp"

#include <algorithm>
#include <cstdio>
#include <unistd.h>

namespace fingertip {

ProgressBar::ProgressBar(const std::string &what, Lines lines)
    : what_(printable(what)), terminal_(isatty(STDERR_FILENO) != 0), step_percent_(terminal_                ? 1
                                                                                   : lines == Lines::tenths ? 10
                                                                                                            : 0) {}

ProgressBar::~ProgressBar() {
  if (terminal_ && shown_percent_ >= 0) {
    std::fprintf(stderr, "\r\x1b[K");
  }
}

void ProgressBar::show(double share) {
  if (step_percent_ == 0) {
    return;
  }
  const int percent = static_cast<int>(100.0 * std::clamp(share, 0.0, 1.0)) / step_percent_ * step_percent_;
  if (percent == shown_percent_) {
    return;
  }
  shown_percent_ = percent;
  if (!terminal_) {
    std::fprintf(stderr, "%s %d %%\n", what_.c_str(), percent);
    return;
  }
  constexpr int WIDTH = 40;
  const int full = WIDTH * percent / 100;
  std::fprintf(stderr, "\r%s [%s%s] %3d %%", what_.c_str(), std::string(full, '#').c_str(), std::string(WIDTH - full, '.').c_str(),
               percent);
  std::fflush(stderr);
}

} // namespace fingertip
