#include "libfingertip/output_file.hpp"

#include "libfingertip/error.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace fingertip {

namespace fs = std::filesystem;

[[noreturn]] void fail(const std::string &path, int error) {
  switch (error) {
  case EEXIST: throw Error(ErrorCode::file_exists, path + ": exists already");
  case EISDIR: throw Error(ErrorCode::is_folder, path + ": is a folder");
  default: throw Error(ErrorCode::cannot_write, path + ": " + std::strerror(error));
  }
}

/* While an OutputFile grows it is locked: two recorders would mix their lines. */
static void fail_if_recorded(const std::string &path, int fd) {
  struct stat status;
  if (fd >= 0 && fstat(fd, &status) == 0 && S_ISREG(status.st_mode) && flock(fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    close(fd);
    throw Error(ErrorCode::cannot_write, path + ": is being recorded");
  }
}

static fs::path without_links(const std::string &path) {
  std::error_code error;
  fs::path plain = fs::weakly_canonical(fs::absolute(path, error), error);
  return error ? fs::path(path) : plain;
}

void check_output(const std::string &path, bool replace) {
  std::string folder = fs::path(path).parent_path().string();
  struct stat status;
  bool exists = stat(path.c_str(), &status) == 0;
  if ((exists && S_ISDIR(status.st_mode)) || path.empty() || path.back() == '/') {
    fail(path, EISDIR);
  }
  if (exists && !replace) {
    fail(path, EEXIST);
  }
  if (exists ? access(path.c_str(), W_OK) != 0 : access(folder.empty() ? "." : folder.c_str(), W_OK | X_OK) != 0) {
    fail(path, errno);
  }
}

bool is_same_file(const std::string &a, const std::string &b) {
  std::error_code absent;
  return fs::equivalent(a, b, absent) || without_links(a) == without_links(b);
}

OutputFile::OutputFile(const std::string &path, bool replace, Appears appears)
    : path_(path), replace_(replace), to_standard_output_(appears == Appears::on_standard_output) {
  if (to_standard_output_) {
    fd_ = fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 0);
    if (fd_ < 0) {
      fail(path, errno);
    }
    return;
  }
  check_output(path, replace);
  target_ = without_links(path).string();
  struct stat old;
  bool exists = stat(path.c_str(), &old) == 0;
  if (appears == Appears::when_finished && (!exists || S_ISREG(old.st_mode))) {
    const int replaced = exists ? open(path.c_str(), O_RDONLY | O_CLOEXEC) : -1;
    fail_if_recorded(path, replaced);
    close(replaced);
    temporary_ = target_ + ".XXXXXX";
    fd_ = mkostemp(temporary_.data(), O_CLOEXEC);
    if (fd_ >= 0) {
      mode_t mask = umask(0);
      umask(mask);
      fchmod(fd_, exists ? old.st_mode & 07777 : 0666 & ~mask);
    }
  } else {
    fd_ = open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | (replace ? 0 : O_EXCL), 0666);
    fail_if_recorded(path, fd_);
    is_new_ = !exists;
    if (exists && S_ISREG(old.st_mode) && fd_ >= 0 && ftruncate(fd_, 0) != 0) {
      close(fd_);
      fd_ = -1;
    }
  }
  if (fd_ < 0) {
    fail(path, errno);
  }
}

OutputFile::~OutputFile() {
  close(fd_);
  if (!temporary_.empty() || (is_new_ && length_ == 0)) {
    unlink((temporary_.empty() ? target_ : temporary_).c_str());
  }
}

void OutputFile::append(const void *bytes, std::size_t length) {
  auto next = static_cast<const char *>(bytes);
  std::size_t left = length;
  while (left > 0) {
    ssize_t count = write(fd_, next, left);
    if (count < 0 && errno == EINTR) {
      continue;
    }
    if (count < 0 && errno == EPIPE && to_standard_output_) {
      return;
    }
    if (count <= 0) {
      int error = count == 0 ? ENOSPC : errno;
      std::string what = path_ + ": " + std::strerror(error);
      if (!temporary_.empty() || (is_new_ && length_ == 0 && ftruncate(fd_, 0) == 0)) {
        throw Error(ErrorCode::write_undone, what + "; nothing was changed");
      }
      if (to_standard_output_ || ftruncate(fd_, length_) != 0) {
        throw Error(ErrorCode::write_torn, what + "; its last line is torn");
      }
      throw Error(ErrorCode::write_cut, what + "; what was written until now stays readable");
    }
    next += count;
    left -= static_cast<std::size_t>(count);
  }
  length_ += static_cast<std::int64_t>(length);
}

void OutputFile::finish() {
  if (temporary_.empty()) {
    return;
  }
  if (fsync(fd_) != 0) {
    fail(path_, errno);
  }
  /* Some file systems cannot refuse to replace: EINVAL. */
  if (renameat2(AT_FDCWD, temporary_.c_str(), AT_FDCWD, target_.c_str(), replace_ ? 0 : RENAME_NOREPLACE) != 0 &&
      (errno != EINVAL || rename(temporary_.c_str(), target_.c_str()) != 0)) {
    fail(path_, errno);
  }
  temporary_.clear();
}

} // namespace fingertip
