#include "libfingertip/share_socket.hpp"

#include "libfingertip/command.hpp"
#include "libfingertip/error.hpp"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

namespace fingertip {

namespace fs = std::filesystem;

constexpr const char *SOCKET_END = ".sock";
constexpr const char *PORT_END = ".port";
constexpr const char *SIMULATED = "sim:";

/* Where everybody may make folders. */
static std::string own_folder_in_tmp() { return "/tmp/fingertip-" + std::to_string(geteuid()); }

static bool is_of_this_user(const std::string &folder) {
  struct stat status;
  return lstat(folder.c_str(), &status) == 0 && S_ISDIR(status.st_mode) && status.st_uid == geteuid();
}

/* What is in no name of a file becomes '_'. */
static std::string as_name(std::string serial) {
  std::replace_if(
      serial.begin(), serial.end(), [](unsigned char c) { return !std::isalnum(c) && c != '-' && c != '_'; }, '_');
  return serial;
}

std::string own_share_folder() {
  const char *runtime = std::getenv("XDG_RUNTIME_DIR");
  if (runtime && *runtime) {
    return std::string(runtime) + "/fingertip";
  }
  return geteuid() == 0 ? COMMON_SHARE_FOLDER : own_folder_in_tmp();
}

void make_own_folder(const std::string &path) {
  if (mkdir(path.c_str(), 0750) != 0 && errno != EEXIST) {
    throw Error(ErrorCode::cannot_share, path + ": cannot share there (" + std::strerror(errno) + ")");
  }
  if (!is_of_this_user(path)) {
    throw Error(ErrorCode::cannot_share, path + ": is no folder of this user");
  }
}

std::string simulated_folder() { return own_share_folder() + "/simulated"; }

std::string port_of(const std::string &path) {
  if (path.rfind(SIMULATED, 0) != 0) {
    return path;
  }
  const std::string name = path.substr(std::strlen(SIMULATED));
  const std::string port = simulated_folder() + "/" + (name.empty() ? "left" : name);
  std::error_code none;
  if (!fs::exists(port, none)) {
    throw Error(ErrorCode::not_simulated, path + ": nothing is simulated there");
  }
  return port;
}

std::string share_socket_name(const std::string &serial) { return as_name(serial) + SOCKET_END; }

std::string share_port_name(const std::string &serial) { return as_name(serial) + PORT_END; }

std::string grasp_socket_name(const std::string &serial) { return as_name(serial) + ".grasp"; }

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
  std::sort(all.begin(), all.end(), [](const Shared &a, const Shared &b) { return a.serial < b.serial; });
  return all;
}

bool SocketTransport::is_served(const std::string &path) {
  const int fd = connect_unix(path);
  if (fd < 0) {
    return errno == EACCES || errno == EPERM || errno == EAGAIN;
  }
  ::close(fd);
  return true;
}

SocketTransport::SocketTransport(const std::string &path) : DescriptorTransport(path) {
  fd_ = connect_unix(path);
  if (fd_ >= 0) {
    return;
  }
  if (errno == EACCES || errno == EPERM) {
    throw Error(ErrorCode::share_denied, path + ": permission denied: it is its owner's and group's");
  }
  if (errno == ENOENT || errno == ECONNREFUSED) {
    throw Error(ErrorCode::not_shared, path + ": no program shares a fingertip there");
  }
  throw Error(ErrorCode::cannot_open, path + ": cannot open (" + std::strerror(errno) + ")");
}

ssize_t SocketTransport::put(const std::uint8_t *bytes, std::size_t length) { return send(fd_, bytes, length, MSG_NOSIGNAL); }

Transport::Result SocketTransport::read(std::uint8_t *bytes, std::size_t capacity, std::size_t *length, std::chrono::milliseconds timeout) {
  const Result result = DescriptorTransport::read(bytes, capacity, length, timeout);
  if (std::string_view(reinterpret_cast<const char *>(bytes), *length) == SHARE_IS_FULL) {
    throw Error(ErrorCode::port_in_use, path_ + ": as many programs use this fingertip as can share it");
  }
  return result;
}

bool SocketTransport::reopen() {
  close();
  fd_ = connect_unix(path_);
  return fd_ >= 0;
}

bool SocketTransport::ask_loader() {
  auto bytes = frame_bytes(command_loader());
  return write(bytes.data(), bytes.size());
}

} // namespace fingertip
