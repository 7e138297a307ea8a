/* What follows from clock.hpp's few functions, whichever clock they are of. */
#include "libfingertip/clock.hpp"

#include <cerrno>
#include <sys/eventfd.h>
#include <system_error>
#include <unistd.h>

namespace fingertip {

std::int64_t steady_now_us() { return std::chrono::duration_cast<std::chrono::microseconds>(host_now().time_since_epoch()).count(); }

void wait_until(HostTime until) { wait_for(nullptr, 0, until); }

Wake::Wake() : fd_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (fd_ < 0) {
    throw std::system_error(errno, std::generic_category(), "eventfd");
  }
}

Wake::~Wake() { close(fd_); }

void Wake::set() { eventfd_write(fd_, 1); }

void Wake::clear() {
  eventfd_t count;
  eventfd_read(fd_, &count);
}

bool Wake::wait(HostTime until) {
  pollfd woken = {fd_, POLLIN, 0};
  const bool is_set = wait_for(&woken, 1, until) > 0;
  clear();
  return is_set;
}

} // namespace fingertip
