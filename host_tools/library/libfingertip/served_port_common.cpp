/* Of served_port.hpp, what terminal and socket share. */
#include "libfingertip/error.hpp"
#include "libfingertip/served_port.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>

namespace fingertip {

Error ServedPort::failure(const std::string &what) { return Error(ErrorCode::cannot_open, what + " (" + std::strerror(errno) + ")"); }

void ServedPort::rename(const std::string &link) {
  if (std::rename(link_.c_str(), link.c_str()) != 0) {
    throw failure(link);
  }
  path_ = link_ = link;
}

} // namespace fingertip
