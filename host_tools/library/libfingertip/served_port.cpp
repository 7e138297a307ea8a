#include "libfingertip/served_port.hpp"

#include <algorithm>
#include <cstdlib>
#include <fcntl.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

namespace fingertip {

/* Nothing can be waited for on a terminal that no program has open: it has to be asked. */
constexpr std::chrono::milliseconds LOOK_INTERVAL{2};

ServedPort::ServedPort(const std::string &link) : link_(link) {
  char name[64];
  fd_ = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (fd_ < 0 || grantpt(fd_) != 0 || unlockpt(fd_) != 0 || ptsname_r(fd_, name, sizeof name) != 0) {
    throw failure("no pseudo-terminal to be had");
  }
  name_ = name;
  path_ = link.empty() ? name_ : link;
  make_raw();
  if (!link.empty()) {
    char target[1];
    if (readlink(link.c_str(), target, sizeof target) >= 0) {
      unlink(link.c_str());
    }
    if (symlink(name, link.c_str()) != 0) {
      Error error = failure(link + ": cannot be made a link");
      ::close(fd_);
      throw error;
    }
  }
}

ServedPort::~ServedPort() {
  if (!link_.empty()) {
    unlink(link_.c_str());
  }
  ::close(fd_);
}

/* Opens and closes it once as well: only then does a port report a hang-up. */
void ServedPort::make_raw() {
  const int slave = open(name_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  termios settings;
  if (slave < 0 || tcgetattr(slave, &settings) != 0) {
    throw failure(name_ + ": cannot be opened");
  }
  cfmakeraw(&settings);
  tcsetattr(slave, TCSANOW, &settings);
  ::close(slave);
}

void ServedPort::look() {
  pollfd asked = {fd_, POLLIN, 0};
  ::poll(&asked, 1, 0);
  const bool was_open = is_open_;
  is_open_ = (asked.revents & POLLHUP) == 0;
  if (was_open && !is_open_) {
    make_raw(); /* the last close forgets it */
  }
}

void ServedPort::wait(HostTime until) {
  look();
  if (is_open_) {
    pollfd asked = {fd_, POLLIN, 0};
    wait_for(&asked, 1, until);
  } else {
    wait_until(std::min(until, host_now() + LOOK_INTERVAL));
  }
  look();
}

std::size_t ServedPort::read(std::uint8_t *bytes, std::size_t capacity) {
  const ssize_t count = ::read(fd_, bytes, capacity);
  return static_cast<std::size_t>(std::max<ssize_t>(count, 0));
}

std::size_t ServedPort::write(const std::uint8_t *bytes, std::size_t length) {
  look();
  if (!is_open_) {
    return length;
  }
  const ssize_t count = ::write(fd_, bytes, length);
  return static_cast<std::size_t>(std::max<ssize_t>(count, 0));
}

std::size_t ServedPort::unread() const {
  const int slave = open(name_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  int count = 0;
  ioctl(slave, FIONREAD, &count);
  ::close(slave);
  return static_cast<std::size_t>(count);
}

unsigned ServedPort::speed() const {
  termios settings;
  return tcgetattr(fd_, &settings) == 0 ? cfgetospeed(&settings) : 0;
}

} // namespace fingertip
