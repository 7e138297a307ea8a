/* Where the bytes of a fingertip come from: a serial port or pseudo-terminal
 * (serial_transport.hpp), libusb (usb_transport.hpp), or its server (share_socket.hpp). */
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <poll.h>
#include <string>
#include <vector>

#pragma GCC visibility push(default)
namespace fingertip {

class Transport {
public:
  enum class Result {
    data,    /* at least one byte */
    timeout, /* none came in time */
    gone,    /* the other end vanished */
  };

  virtual ~Transport() = default;

  /* Waits at most this long for the first byte. Throws Error only where waiting for the other end to come back could not help. */
  virtual Result read(std::uint8_t *bytes, std::size_t capacity, std::size_t *length, std::chrono::milliseconds timeout) = 0;

  /* Writes all of the bytes, or returns false: the other end is gone or takes nothing. */
  virtual bool write(const std::uint8_t *bytes, std::size_t length) = 0;

  /* After gone: true if it is there again. Never blocks; ask again later. */
  virtual bool reopen() = 0;

  /* Asks for the USB loader without a packet, as any firmware of ours understands it, of whatever
   * protocol version: 1200 baud, then DTR down. False: not possible here. */
  virtual bool ask_loader() { return false; }

  /* Descriptors to wait for several: once poll(2) reports one of these, read may have something. Ask for them
   * again before each wait, after reading everything. None while it is gone. */
  virtual std::vector<pollfd> poll_descriptors() const { return {}; }

  /* What this is, for people. */
  virtual std::string description() const = 0;
};

} // namespace fingertip
#pragma GCC visibility pop
