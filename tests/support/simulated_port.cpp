// libfingertip's served port where time is simulated: a socket, whose bytes are there for the other
// end the moment they are written. SerialTransport opens it by its path.
#include "libfingertip/descriptor_transport.hpp"
#include "libfingertip/served_port.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <linux/sockios.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include <utility>

namespace fingertip {

static std::string own_name() {
  static std::atomic<unsigned> number{0};
  const char *folder = std::getenv("TMPDIR");
  return std::string(folder ? folder : "/tmp") + "/port-" + std::to_string(getpid()) + "-" + std::to_string(number++);
}

ServedPort::ServedPort(const std::string &link) : path_(link.empty() ? own_name() : link), link_(link), name_(path_) {
  unlink(path_.c_str());
  make_raw();
}

ServedPort::~ServedPort() {
  unlink(path_.c_str());
  for (const int fd : {fd_, listener_}) {
    if (fd >= 0) {
      ::close(fd);
    }
  }
}

void ServedPort::make_raw() {
  sockaddr_un address;
  unlink(path_.c_str());
  listener_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (!unix_address(path_, &address) || bind(listener_, reinterpret_cast<const sockaddr *>(&address), sizeof address) != 0 ||
      listen(listener_, 8) != 0) {
    throw failure(path_);
  }
}

void ServedPort::look() {
  if (is_open_) {
    char byte;
    const ssize_t count = recv(fd_, &byte, 1, MSG_PEEK | MSG_DONTWAIT);
    if (count == 0 || (count < 0 && errno != EAGAIN)) {
      ::close(std::exchange(fd_, -1));
      is_open_ = false; // the next client shows at the next look: who serves sees either change
    }
  } else {
    fd_ = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    is_open_ = fd_ >= 0;
  }
}

void ServedPort::wait(HostTime until) {
  const bool was_open = is_open_;
  look();
  if (is_open_ != was_open) {
    return;
  }
  pollfd asked = {is_open_ ? fd_ : listener_, POLLIN, 0};
  wait_for(&asked, 1, until);
  look();
}

std::size_t ServedPort::read(std::uint8_t *bytes, std::size_t capacity) {
  const ssize_t count = is_open_ ? recv(fd_, bytes, capacity, MSG_DONTWAIT) : 0;
  return static_cast<std::size_t>(std::max<ssize_t>(count, 0));
}

std::size_t ServedPort::write(const std::uint8_t *bytes, std::size_t length) {
  look();
  if (!is_open_) {
    return length;
  }
  const ssize_t count = send(fd_, bytes, length, MSG_DONTWAIT | MSG_NOSIGNAL);
  return count < 0 && errno != EAGAIN ? length : static_cast<std::size_t>(std::max<ssize_t>(count, 0));
}

std::size_t ServedPort::unread() const {
  int count = 0;
  return is_open_ && ioctl(fd_, SIOCOUTQ, &count) == 0 ? static_cast<std::size_t>(count) : 0;
}

unsigned ServedPort::speed() const { return 0; }

} // namespace fingertip
