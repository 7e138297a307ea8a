// A file that is only in memory, for parsers that open one by its path.
#pragma once

#include "fuzz.h"

#include <string>
#include <sys/mman.h>
#include <unistd.h>

namespace fuzz {

class MemoryFile {
public:
  MemoryFile() : fd_(memfd_create("fuzz", MFD_CLOEXEC)) { FUZZ_CHECK(fd_ >= 0); }
  MemoryFile(const void *bytes, std::size_t length) : MemoryFile() {
    FUZZ_CHECK(write(fd_, bytes, length) == static_cast<ssize_t>(length));
  }
  ~MemoryFile() { close(fd_); }
  MemoryFile(const MemoryFile &) = delete;
  MemoryFile &operator=(const MemoryFile &) = delete;

  std::string path() const { return "/proc/self/fd/" + std::to_string(fd_); }

private:
  int fd_;
};

} // namespace fuzz
