#include "libfingertip/serial_transport.hpp"

#include "libfingertip/error.hpp"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <sys/un.h>
#include <termios.h>
#include <unistd.h>

namespace fingertip {

namespace {

Error open_error(const std::string &path, int error) {
  switch (error) {
  case ENOENT:
  case ENODEV:
  case ENXIO:
    return Error(ErrorCode::no_port, path + ": no such port");
  case EBUSY:
  case EWOULDBLOCK:
    return Error(ErrorCode::port_in_use, path + ": in use by another program");
  case EACCES:
  case EPERM:
    return Error(ErrorCode::permission_denied, path + ": permission denied");
  case ENOTTY:
    return Error(ErrorCode::not_a_port, path + ": no serial port");
  default:
    return Error(ErrorCode::cannot_open, path + ": cannot open (" + std::strerror(error) + ")");
  }
}

/* Major numbers of Unix98 pseudo-terminals, Documentation/admin-guide/devices.txt of Linux. */
bool is_pseudo_terminal(int fd) {
  struct stat status;
  return fstat(fd, &status) == 0 && major(status.st_rdev) >= 136 && major(status.st_rdev) <= 143;
}

/* A simulated port. Its name in the abstract namespace is this end's: that keeps out others. */
int open_socket(const std::string &path, int *error) {
  std::error_code none;
  std::string real = std::filesystem::canonical(path, none).string();
  sockaddr_un port = {}, own = {};
  port.sun_family = own.sun_family = AF_UNIX;
  if (real.size() + 1 >= sizeof port.sun_path) {
    *error = ENAMETOOLONG;
    return -1;
  }
  std::memcpy(port.sun_path, real.data(), real.size());
  std::memcpy(own.sun_path + 1, real.data(), real.size());
  int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0 || bind(fd, reinterpret_cast<const sockaddr *>(&own), sizeof own) != 0 ||
      connect(fd, reinterpret_cast<const sockaddr *>(&port), sizeof port) != 0) {
    *error = errno == EADDRINUSE ? EBUSY : errno == ECONNREFUSED ? ENXIO : errno;
    ::close(fd);
    return -1;
  }
  return fd;
}

int open_port(const std::string &path, int *error) {
  struct stat status;
  if (stat(path.c_str(), &status) == 0 && S_ISSOCK(status.st_mode)) {
    return open_socket(path, error);
  }
  int fd = open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) {
    *error = errno;
    return -1;
  }
  termios settings;
  bool fine = tcgetattr(fd, &settings) == 0;
  if (fine) {
    cfmakeraw(&settings);
    settings.c_cflag |= CLOCAL | CREAD | HUPCL;
    cfsetspeed(&settings, B115200);
  }
  /* The lock keeps out programs that ask for it, as root too; TIOCEXCL keeps out all others. On a
   * pseudo-terminal TIOCEXCL would outlive a killed program. */
  fine = fine && flock(fd, LOCK_EX | LOCK_NB) == 0 && tcsetattr(fd, TCSANOW, &settings) == 0 &&
         (is_pseudo_terminal(fd) || ioctl(fd, TIOCEXCL) == 0);
  if (!fine) {
    *error = errno;
    ::close(fd);
    return -1;
  }
  return fd;
}

} // namespace

SerialTransport::SerialTransport(const std::string &path, std::function<std::string()> find_again)
    : DescriptorTransport(path), find_again_(std::move(find_again)) {
  int error = 0;
  fd_ = open_port(path_, &error);
  if (fd_ < 0) {
    throw open_error(path_, error);
  }
}

ssize_t SerialTransport::put(const std::uint8_t *bytes, std::size_t length) {
  /* Not of a socket whose other end has gone, which would raise a signal. */
  ssize_t count = send(fd_, bytes, length, MSG_NOSIGNAL);
  return count < 0 && errno == ENOTSOCK ? ::write(fd_, bytes, length) : count;
}

bool SerialTransport::reopen() {
  close();
  if (find_again_) {
    std::string path = find_again_();
    if (path.empty()) {
      return false;
    }
    path_ = path;
  }
  int error = 0;
  fd_ = open_port(path_, &error);
  if (fd_ < 0 && (error == EBUSY || error == EWOULDBLOCK)) {
    throw open_error(path_, error);
  }
  return fd_ >= 0;
}

bool SerialTransport::ask_loader() {
  termios settings;
  if (fd_ < 0 || tcgetattr(fd_, &settings) != 0 || cfsetspeed(&settings, B1200) != 0 ||
      tcsetattr(fd_, TCSANOW, &settings) != 0) {
    return false;
  }
  close();
  return true;
}

void SerialTransport::check_unused(const std::string &path) {
  int error = 0;
  int fd = open_port(path, &error);
  if (fd >= 0) {
    ::close(fd);
  } else if (error == EBUSY || error == EWOULDBLOCK) {
    throw open_error(path, error);
  }
}

} // namespace fingertip
