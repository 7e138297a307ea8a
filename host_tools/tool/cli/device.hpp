/* The fingertip that a command talks to. */
#pragma once

#include "libfingertip/connection.hpp"
#include "libfingertip/session.hpp"
#include "tool/cli/terminal.hpp"

#include <memory>

namespace fingertip {

/* A fingertip with a session on it. Reports on standard error if it waits long for an answer; the
 * signals end it. */
struct Device {
  std::unique_ptr<Transport> transport;
  Session session;

  explicit Device(const Choice &choice);
};

} // namespace fingertip
