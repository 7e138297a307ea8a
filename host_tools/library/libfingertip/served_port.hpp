/* The serving end of a port: simulated fingertips and grippers speak through it. It is a pseudo-terminal, raw from the
 * first moment, which SerialTransport opens like a serial port. Under simulated time a Unix socket takes its place,
 * because a thread of the kernel passes on the bytes of a pseudo-terminal, in real time.
 *
 * One program at a time can open it. The next program finds none of the bytes that the last one left unread. */
#pragma once

#include "libfingertip/clock.hpp"
#include "libfingertip/error.hpp"

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>

namespace fingertip {

class ServedPort {
public:
  /* link: a symbolic link to the port, which replaces one of that name; "": none. Throws Error. */
  explicit ServedPort(const std::string &link);
  /* The port vanishes, with all bytes that were not read yet. */
  ~ServedPort();
  ServedPort(const ServedPort &) = delete;
  ServedPort &operator=(const ServedPort &) = delete;

  /* What to open: the link, or the port itself where there is none. */
  const std::string &path() const { return path_; }
  /* Waits until bytes come, or a program opens or closes the port. May return early. */
  void wait(HostTime until);
  bool is_open() const { return is_open_; }
  /* The number of bytes that were there to read; 0: none now. Never waits. */
  std::size_t read(std::uint8_t *bytes, std::size_t capacity);
  /* The number of bytes that were taken, perhaps not all. While no program has the port open, all are taken and lost. Never waits. */
  std::size_t write(const std::uint8_t *bytes, std::size_t length);
  /* How many written bytes the other program has not read yet; 0 or more: a socket counts its own overhead too. */
  std::size_t unread() const;
  /* The speed that the other program has set, a constant of termios; 0 for a socket. */
  unsigned speed() const;

private:
  static Error failure(const std::string &what) { return Error(ErrorCode::cannot_open, what + " (" + std::strerror(errno) + ")"); }
  void look();
  void make_raw();

  std::string path_, link_, name_;
  int fd_ = -1; /* master of the terminal, or the connection */
  int listener_ = -1;
  bool is_open_ = false;
};

} // namespace fingertip
