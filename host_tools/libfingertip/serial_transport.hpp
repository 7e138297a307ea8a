/* A fingertip on a serial port of the system: USB CDC (/dev/ttyACM*, /dev/serial/by-id/...) or a
 * pseudo-terminal; any path will do.
 *
 * The port is held exclusively while open. It is raw from the first moment, so that the system
 * neither echoes nor changes a byte.
 */
#pragma once

#include "libfingertip/transport.hpp"

namespace fingertip {

class SerialTransport : public Transport {
public:
  /* Throws Error if the port is absent, in use, not allowed, or no terminal. */
  explicit SerialTransport(const std::string &path);
  ~SerialTransport() override;
  SerialTransport(const SerialTransport &) = delete;
  SerialTransport &operator=(const SerialTransport &) = delete;

  Result read(std::uint8_t *bytes, std::size_t capacity, std::size_t *length,
              std::chrono::milliseconds timeout) override;
  bool write(const std::uint8_t *bytes, std::size_t length) override;
  /* Throws Error if the port is there but was taken by somebody else. */
  bool reopen() override;
  std::string description() const override { return path_; }

private:
  void close();

  std::string path_;
  int fd_ = -1;
};

} // namespace fingertip
