/* What serial port and socket have in common: a descriptor whose reads and writes never wait. */
#pragma once

#include "libfingertip/transport.hpp"

#include <string>
#include <sys/types.h>
#include <sys/un.h>
#include <unistd.h>
#include <utility>

namespace fingertip {

/* False: the path is too long for one. */
bool unix_address(const std::string &path, sockaddr_un *address);
/* A connection to a Unix socket, or -1 and errno. own_name: of this end in the abstract namespace, which keeps out
 * others that give the same; "": none. */
int connect_unix(const std::string &path, const std::string &own_name = "");

/* A file descriptor that is closed at the end. */
class Descriptor {
public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  ~Descriptor() { close(fd_); }
  Descriptor(Descriptor &&other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor &operator=(Descriptor &&other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  int get() const { return fd_; }

private:
  int fd_;
};

class DescriptorTransport : public Transport {
public:
  ~DescriptorTransport() override;
  DescriptorTransport(const DescriptorTransport &) = delete;
  DescriptorTransport &operator=(const DescriptorTransport &) = delete;

  Result read(std::uint8_t *bytes, std::size_t capacity, std::size_t *length, std::chrono::milliseconds timeout) override;
  bool write(const std::uint8_t *bytes, std::size_t length) override;
  std::string description() const override { return path_; }
  std::vector<pollfd> poll_descriptors() const override;

protected:
  explicit DescriptorTransport(const std::string &path) : path_(path) {}
  void close();

  std::string path_;
  int fd_ = -1; /* -1: gone */

private:
  /* Works like write(2). */
  virtual ssize_t put(const std::uint8_t *bytes, std::size_t length) = 0;
};

} // namespace fingertip
