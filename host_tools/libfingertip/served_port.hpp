/* The other end of a port: what simulated fingertips and grippers speak through. A pseudo-terminal,
 * raw from the first moment, that SerialTransport opens as it opens a serial port. (Where time is
 * simulated too a socket takes its place: a pseudo-terminal passes bytes on by a thread of the
 * kernel, in real time.)
 *
 * One program at a time has it open; who opens it next finds nothing of what the last one left.
 */
#pragma once

#include "libfingertip/clock.hpp"

#include <cstddef>
#include <cstdint>
#include <string>

namespace fingertip {

class ServedPort {
public:
  /* link: made to it, in place of a link that is there; "": none. Throws Error. */
  explicit ServedPort(const std::string &link);
  /* The port goes, and with it what was not read yet. */
  ~ServedPort();
  ServedPort(const ServedPort &) = delete;
  ServedPort &operator=(const ServedPort &) = delete;

  /* Its link gets another name. */
  void rename(const std::string &link);
  /* What to open: the link, or the port itself where there is none. */
  const std::string &path() const { return path_; }
  /* Waits until there are bytes or somebody opens or closes it; perhaps less long. */
  void wait(HostTime until);
  bool is_open() const { return is_open_; }
  /* Those that have come; 0: none now. */
  std::size_t read(std::uint8_t *bytes, std::size_t capacity);
  /* As many as it takes now; all where nobody has it open, who get lost. */
  std::size_t write(const std::uint8_t *bytes, std::size_t length);
  /* Those that were written and not read yet. */
  std::size_t unread() const;
  /* Speed that the one who has it open has set, as termios has it; 0 where there is none. */
  unsigned speed() const;

private:
  void look();
  void make_raw();

  std::string path_, link_, name_;
  int fd_ = -1; /* master of the terminal, or the connection */
  int listener_ = -1;
  bool is_open_ = false;
};

} // namespace fingertip
