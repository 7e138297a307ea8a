/* The fingertip that a command talks to. */
#pragma once

#include "libfingertip/connection.hpp"
#include "libfingertip/session.hpp"
#include "tool/cli/terminal.hpp"

#include <memory>

namespace fingertip {

/* A fingertip with a session on it. Says on standard error that it waits for an answer, where that
 * takes long; ends by the signals. */
struct Device {
  std::unique_ptr<Transport> transport;
  Session session;

  explicit Device(const Choice &choice);
};

} // namespace fingertip
