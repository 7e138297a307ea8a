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
#include <termios.h>
#include <unistd.h>

namespace fingertip {

static Error open_error(const std::string &path, int error) {
  switch (error) {
  case ENOENT:
  case ENODEV:
  case ENXIO: return Error(ErrorCode::no_port, path + ": no such port");
  case EBUSY:
  case EWOULDBLOCK: return Error(ErrorCode::port_in_use, path + ": in use by another program");
  case EACCES:
  case EPERM: return Error(ErrorCode::permission_denied, path + ": permission denied");
  case ENOTTY: return Error(ErrorCode::not_a_port, path + ": no serial port");
  default: return Error(ErrorCode::cannot_open, path + ": cannot open (" + std::strerror(error) + ")");
  }
}

/* Major numbers of Unix98 pseudo-terminals, Documentation/admin-guide/devices.txt of Linux. */
static bool is_pseudo_terminal(int fd) {
  struct stat status;
  return fstat(fd, &status) == 0 && major(status.st_rdev) >= 136 && major(status.st_rdev) <= 143;
}

/* Or -1 and errno. */
static int open_port(const std::string &path) {
  struct stat status;
  if (stat(path.c_str(), &status) == 0 && S_ISSOCK(status.st_mode)) { /* simulated */
    std::error_code none;
    const std::string real = std::filesystem::canonical(path, none).string();
    const int fd = connect_unix(real, real);
    errno = errno == EADDRINUSE ? EBUSY : errno == ECONNREFUSED ? ENXIO : errno;
    return fd;
  }
  int fd = open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  termios settings;
  bool fine = fd >= 0 && tcgetattr(fd, &settings) == 0;
  if (fine) {
    cfmakeraw(&settings);
    settings.c_cflag |= CLOCAL | CREAD | HUPCL;
    cfsetspeed(&settings, B115200);
  }
  /* The lock keeps out programs that ask for it, as root too; TIOCEXCL keeps out all others. On a
   * pseudo-terminal TIOCEXCL would outlive a killed program. */
  fine = fine && flock(fd, LOCK_EX | LOCK_NB) == 0 && tcsetattr(fd, TCSANOW, &settings) == 0 &&
         (is_pseudo_terminal(fd) || ioctl(fd, TIOCEXCL) == 0);
  if (!fine && fd >= 0) {
    const int error = errno;
    ::close(fd);
    errno = error;
  }
  return fine ? fd : -1;
}

static bool is_taken() { return errno == EBUSY || errno == EWOULDBLOCK; }

SerialTransport::SerialTransport(const std::string &path, std::function<std::string()> find_again)
    : DescriptorTransport(path), find_again_(std::move(find_again)) {
  fd_ = open_port(path_);
  if (fd_ < 0) {
    throw open_error(path_, errno);
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
  fd_ = open_port(path_);
  if (fd_ < 0 && is_taken()) {
    throw open_error(path_, errno);
  }
  return fd_ >= 0;
}

bool SerialTransport::ask_loader() {
  termios settings;
  if (fd_ < 0 || tcgetattr(fd_, &settings) != 0 || cfsetspeed(&settings, B1200) != 0 || tcsetattr(fd_, TCSANOW, &settings) != 0) {
    return false;
  }
  close();
  return true;
}

void SerialTransport::check_unused(const std::string &path) {
  const int fd = open_port(path);
  if (fd >= 0) {
    ::close(fd);
  } else if (is_taken()) {
    throw open_error(path, errno);
  }
}

} // namespace fingertip
