#include "libfingertip/descriptor_transport.hpp"

#include "libfingertip/clock.hpp"

#include <cerrno>
#include <cstring>
#include <sys/socket.h>
#include <unistd.h>

namespace fingertip {

constexpr std::chrono::milliseconds WRITE_TIMEOUT{1000};

bool unix_address(const std::string &path, sockaddr_un *address) {
  *address = {};
  address->sun_family = AF_UNIX;
  if (path.size() >= sizeof address->sun_path) {
    errno = ENAMETOOLONG;
    return false;
  }
  std::memcpy(address->sun_path, path.data(), path.size());
  return true;
}

int connect_unix(const std::string &path, const std::string &own_name) {
  sockaddr_un port, own;
  if (!unix_address(path, &port) || !unix_address(std::string(1, '\0') + own_name, &own)) {
    return -1;
  }
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd >= 0 && (own_name.empty() || bind(fd, reinterpret_cast<const sockaddr *>(&own), sizeof own) == 0) &&
      connect(fd, reinterpret_cast<const sockaddr *>(&port), sizeof port) == 0) {
    return fd;
  }
  const int error = errno;
  ::close(fd);
  errno = error;
  return -1;
}

DescriptorTransport::~DescriptorTransport() { close(); }

void DescriptorTransport::close() {
  if (fd_ >= 0) {
    ::close(fd_);
    fd_ = -1;
  }
}

Transport::Result DescriptorTransport::read(std::uint8_t *bytes, std::size_t capacity, std::size_t *length,
                                            std::chrono::milliseconds timeout) {
  *length = 0;
  if (fd_ < 0) {
    return Result::gone;
  }
  pollfd waiting = {fd_, POLLIN, 0};
  int ready = wait_for(&waiting, 1, host_now() + timeout);
  if (ready <= 0) {
    return Result::timeout;
  }
  if (waiting.revents & POLLIN) {
    ssize_t count = ::read(fd_, bytes, capacity);
    if (count > 0) {
      *length = static_cast<std::size_t>(count);
      return Result::data;
    }
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) {
      return Result::timeout;
    }
  }
  close();
  return Result::gone;
}

bool DescriptorTransport::write(const std::uint8_t *bytes, std::size_t length) {
  while (length > 0) {
    if (fd_ < 0) {
      return false;
    }
    ssize_t count = put(bytes, length);
    if (count >= 0) {
      bytes += count;
      length -= static_cast<std::size_t>(count);
    } else if (errno == EAGAIN) {
      pollfd waiting = {fd_, POLLOUT, 0};
      if (wait_for(&waiting, 1, host_now() + WRITE_TIMEOUT) <= 0) {
        return false;
      }
    } else if (errno != EINTR) {
      return false;
    }
  }
  return true;
}

std::vector<pollfd> DescriptorTransport::poll_descriptors() const {
  return fd_ < 0 ? std::vector<pollfd>() : std::vector<pollfd>{{fd_, POLLIN, 0}};
}

} // namespace fingertip
