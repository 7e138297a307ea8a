/* A fingertip on a serial port of the system: USB CDC (/dev/ttyACM*, /dev/serial/by-id/...) or a pseudo-terminal; any path will do.
 *
 * The port is held exclusively while open. It is raw from the first moment, so that the system neither echoes nor changes a byte. */
#pragma once

#include "libfingertip/descriptor_transport.hpp"

#include <functional>

namespace fingertip {

class SerialTransport : public DescriptorTransport {
public:
  /* find_again: the path where it is back after it was gone, empty while it is not; without it, the
   * same path. Throws Error if the port is absent, in use, not allowed, or no terminal. */
  explicit SerialTransport(const std::string &path, std::function<std::string()> find_again = {});
  /* Throws Error if the port is there but was taken by somebody else. */
  bool reopen() override;
  bool ask_loader() override;

  /* Throws Error if another program has the port. */
  static void check_unused(const std::string &path);

private:
  ssize_t put(const std::uint8_t *bytes, std::size_t length) override;

  std::function<std::string()> find_again_;
};

} // namespace fingertip
