// A Robotiq gripper on the wrist of a Universal Robots arm, by the socket that its URCap opens on the robot's controller: the port
// "ur:HOST", or "ur:HOST:PORT" if it is not 63352. It was tested against a server of our own, and no robot.
//
//   SET POS 100 SPE 255 FOR 0 GTO 1    ack
//   GET POS                            POS 97
//
// A line of text a question, one at a time. The names are those of the registers (robotiq.hpp); there is no current. `ack` only states that
// the controller has the values, so a move is under way until PRE, the gripper's own goal, is the one that was sent. An answer has no
// number, so after one that did not come in time it connects again. How long an answer takes is assumed.
//
// Sources: Robotiq, "2F-85 & 2F-140 Instruction Manual", the names; public drivers of the socket (ur_rtde's robotiq_gripper.py and
// robotiq_2f_urcap_adapter), the lines.
#pragma once

#include "grasp/gripper/robotiq.hpp"
#include "libfingertip/descriptor_transport.hpp"

#include <netinet/in.h>

namespace fingertip {

class RobotiqUrcap final : public Gripper {
public:
  static bool has(const std::string &port) { return port.rfind("ur:", 0) == 0; }
  // Also throws Error: no_port, no such host; bad_value, a slave was given.
  explicit RobotiqUrcap(const GripperWay &given);

  const GripperTraits &traits() const override { return traits_; }
  std::string line() const override { return "URCap at " + way_.port; }
  void activate() override;      // waits half a second after the reset
  GripperStatus poll() override; // six exchanges
  // Seven exchanges; of a gripper that was not active thirteen.
  GripperStatus move(const GripCommand &move) override;
  std::string fault_text(std::uint8_t fault) const override { return robotiq::fault_text(fault); }

private:
  void connect();
  HostTime until() const; // a timeout from now
  bool is_ready(short events, HostTime until) const;
  std::string ask(const std::string &line);
  int get(const std::string &name); // Throws Error: gripper_garbled, no number of this name
  void set(const std::string &values);

  const GripperWay way_;
  GripperTraits traits_;
  sockaddr_in controller_{};
  Descriptor line_;
  std::optional<int> asked_; // position of the last move
  bool active_ = false;      // by the last status
  bool doubtful_ = false;    // an answer may still come that is not expected
};

} // namespace fingertip
