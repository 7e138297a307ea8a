#include "libfingertip/progress_bar.hpp"

#include "libfingertip/text.hpp"

#include <algorithm>
#include <cstdio>
#include <unistd.h>

namespace fingertip {

ProgressBar::ProgressBar(const std::string &what)
    : what_(printable(what)), in_place_(isatty(STDERR_FILENO) != 0), next_(begun_ + std::chrono::milliseconds(in_place_ ? 0 : 10000)) {}

ProgressBar::~ProgressBar() { std::fputs(in_place_ && next_ != begun_ ? "\r\x1b[K" : "", stderr); }

void ProgressBar::show(double share) {
  const HostTime now = host_now();
  if (now < next_) {
    return;
  }
  next_ = now + std::chrono::milliseconds(in_place_ ? 200 : 10000);
  const double spent_s = std::chrono::duration<double>(now - begun_).count();
  std::fprintf(stderr, in_place_ ? "\r\x1b[K%s %.0f %%" : "%s %.0f %%", what_.c_str(), 100 * std::clamp(share, 0.0, 1.0));
  if (spent_s > 2 && share > 0.01) {
    std::fprintf(stderr, ", %.0f s left", spent_s * (1 / std::min(share, 1.0) - 1));
  }
  std::fputs(in_place_ ? "" : "\n", stderr);
}

} // namespace fingertip
