#include "libfingertip/share_socket.hpp"

#include "libfingertip/command.hpp"
#include "libfingertip/error.hpp"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

namespace fingertip {

namespace {

namespace fs = std::filesystem;

constexpr int WRITE_TIMEOUT_ms = 1000;
constexpr const char *SOCKET_END = ".sock";
constexpr const char *PORT_END = ".port";

/* The connection, or -1 and why not. */
int connect_to(const std::string &path, int *error) {
  sockaddr_un address = {};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) {
    *error = ENAMETOOLONG;
    return -1;
  }
  std::memcpy(address.sun_path, path.data(), path.size());
  int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0 || connect(fd, reinterpret_cast<const sockaddr *>(&address), sizeof address) != 0) {
    *error = errno;
    if (fd >= 0) {
      ::close(fd);
    }
    return -1;
  }
  return fd;
}

/* Where everybody may make folders. */
std::string own_folder_in_tmp() {
  return "/tmp/fingertip-" + std::to_string(geteuid());
}

bool is_of_this_user(const std::string &folder) {
  struct stat status;
  return lstat(folder.c_str(), &status) == 0 && S_ISDIR(status.st_mode) &&
         status.st_uid == geteuid();
}

/* What is in no name of a file becomes '_'. */
std::string as_name(std::string serial) {
  std::replace_if(
      serial.begin(), serial.end(),
      [](unsigned char c) { return !std::isalnum(c) && c != '-' && c != '_'; }, '_');
  return serial;
}

} // namespace

std::string own_share_folder() {
  const char *runtime = std::getenv("XDG_RUNTIME_DIR");
  if (runtime && *runtime) {
    return std::string(runtime) + "/fingertip";
  }
  return geteuid() == 0 ? COMMON_SHARE_FOLDER : own_folder_in_tmp();
}

std::string share_socket_name(const std::string &serial) {
  return as_name(serial) + SOCKET_END;
}

std::string share_port_name(const std::string &serial) {
  return as_name(serial) + PORT_END;
}

std::vector<Shared> find_shared() {
  std::vector<std::string> folders = {own_share_folder()};
  if (folders[0] != COMMON_SHARE_FOLDER) {
    folders.push_back(COMMON_SHARE_FOLDER);
  }
  std::vector<Shared> all;
  for (const std::string &folder : folders) {
    std::error_code none;
    if (folder == own_folder_in_tmp() && !is_of_this_user(folder)) {
      continue;
    }
    for (const auto &entry : fs::directory_iterator(folder, none)) {
      fs::path path = entry.path();
      if (path.extension() == SOCKET_END && SocketTransport::is_served(path.string())) {
        fs::path port = path;
        port.replace_extension(PORT_END);
        all.push_back({path.stem().string(), path.string(), fs::read_symlink(port, none).string()});
      }
    }
  }
  std::sort(all.begin(), all.end(),
            [](const Shared &a, const Shared &b) { return a.serial < b.serial; });
  return all;
}

bool SocketTransport::is_served(const std::string &path) {
  int error = 0;
  int fd = connect_to(path, &error);
  if (fd >= 0) {
    ::close(fd);
  }
  return fd >= 0 || error == EACCES || error == EPERM || error == EAGAIN;
}

SocketTransport::SocketTransport(const std::string &path) : path_(path) {
  int error = 0;
  fd_ = connect_to(path, &error);
  if (fd_ >= 0) {
    return;
  }
  if (error == EACCES || error == EPERM) {
    throw Error(ErrorCode::share_denied,
                path + ": permission denied: it is its owner's and group's");
  }
  if (error == ENOENT || error == ECONNREFUSED) {
    throw Error(ErrorCode::not_shared, path + ": nobody shares a fingertip there");
  }
  throw Error(ErrorCode::cannot_open, path + ": cannot open (" + std::strerror(error) + ")");
}

SocketTransport::~SocketTransport() {
  close();
}

void SocketTransport::close() {
  if (fd_ >= 0) {
    ::close(fd_);
    fd_ = -1;
  }
}

Transport::Result SocketTransport::read(std::uint8_t *bytes, std::size_t capacity,
                                        std::size_t *length, std::chrono::milliseconds timeout) {
  *length = 0;
  if (fd_ < 0) {
    return Result::gone;
  }
  pollfd waiting = {fd_, POLLIN, 0};
  if (poll(&waiting, 1, static_cast<int>(timeout.count())) <= 0) {
    return Result::timeout;
  }
  ssize_t count = recv(fd_, bytes, capacity, 0);
  if (count > 0) {
    *length = static_cast<std::size_t>(count);
    return Result::data;
  }
  if (count < 0 && (errno == EAGAIN || errno == EINTR)) {
    return Result::timeout;
  }
  close();
  return Result::gone;
}

bool SocketTransport::write(const std::uint8_t *bytes, std::size_t length) {
  while (length > 0) {
    if (fd_ < 0) {
      return false;
    }
    ssize_t count = send(fd_, bytes, length, MSG_NOSIGNAL);
    if (count >= 0) {
      bytes += count;
      length -= static_cast<std::size_t>(count);
    } else if (errno == EAGAIN) {
      pollfd waiting = {fd_, POLLOUT, 0};
      if (poll(&waiting, 1, WRITE_TIMEOUT_ms) <= 0) {
        return false;
      }
    } else if (errno != EINTR) {
      return false;
    }
  }
  return true;
}

bool SocketTransport::reopen() {
  close();
  int error = 0;
  fd_ = connect_to(path_, &error);
  return fd_ >= 0;
}

bool SocketTransport::ask_loader() {
  auto bytes = frame_bytes(command_loader());
  return write(bytes.data(), bytes.size());
}

std::vector<pollfd> SocketTransport::poll_descriptors() const {
  return fd_ < 0 ? std::vector<pollfd>() : std::vector<pollfd>{{fd_, POLLIN, 0}};
}

} // namespace fingertip
