// The serial line of a gripper, and how its adapter limits its rate.
#pragma once

#include "libfingertip/serial_transport.hpp"

#include <optional>
#include <string>
#include <vector>

namespace fingertip {

class SerialLine : public SerialTransport {
public:
  // 8N1, held exclusively; baud: 115200 or 1000000. Throws Error: the port is absent, in use, not allowed, or no serial port.
  SerialLine(const std::string &path, unsigned baud);

  // Forgets what came and was not read.
  void drop_input();
};

// Milliseconds that a USB adapter holds back an answer that does not fill a packet; empty where its driver does not report it. 16 is usual:
// an exchange then takes as long, which allows 62 a second. root: where to look for sys/, "/" except in tests.
std::optional<int> latency_timer_ms(const std::string &port, const std::string &root = "/");

struct GripperPort {
  std::string path;    // the stable name where there is one
  std::string adapter; // maker and product from USB; empty: unknown
  std::optional<int> latency_timer_ms;
};

// Serial ports on USB that are no fingertip, sorted by path. Nothing is opened.
std::vector<GripperPort> find_gripper_ports(const std::string &root = "/");

} // namespace fingertip
