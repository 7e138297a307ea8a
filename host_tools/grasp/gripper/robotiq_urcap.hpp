// A Robotiq gripper on the wrist of a Universal Robots arm, by the socket that its URCap opens on the robot's controller: the port
// "ur:HOST", or "ur:HOST:PORT" if it is not 63352. A line of text a question, one at a time: SET POS 100 SPE 255 FOR 0 GTO 1 is answered
// with ack, GET POS with POS 97. The names are those of the registers (robotiq.hpp): ACT, GTO, STA, OBJ, POS, FLT. There is no current. An
// answer has no number, so after one that did not come in time the connection is made anew. Sources: Robotiq, "2F-85 & 2F-140 Instruction
// Manual", the names; public drivers of the socket (ur_rtde's robotiq_gripper.py and robotiq_2f_urcap_adapter), the lines. How long an
// answer takes is assumed. It was tested against a server of our own and no robot.
#pragma once

#include "grasp/gripper/robotiq.hpp"
#include "libfingertip/descriptor_transport.hpp"

namespace fingertip {

class RobotiqUrcap final : public Gripper {
public:
  static bool has(const std::string &port) { return port.rfind("ur:", 0) == 0; }
  // Also throws Error: cannot_open, the controller cannot be reached; bad_value, a slave was given.
  explicit RobotiqUrcap(const GripperWay &given);

  const GripperTraits &traits() const override { return traits_; }
  std::string line() const override { return "URCap at " + way_.port; }
  // Waits up to a second for the reset.
  void activate() override;
  GripperStatus poll() override; // five exchanges
  GripperStatus move(const GripperMove &move) override;
  std::string fault_text(std::uint8_t fault) const override { return robotiq::fault_text(fault); }

private:
  void connect();
  bool is_ready(short events) const; // within a timeout
  std::string ask(const std::string &line);
  int get(const std::string &name); // Throws Error: gripper_garbled, no number of this name
  void set(const std::string &values);

  const GripperWay way_;
  GripperTraits traits_;
  Descriptor line_;
  ErrorCode failure_ = ErrorCode::cannot_open; // of a connection; once it is open gripper_silent
  bool doubtful_ = true;                       // an answer may still come that is not expected
};

} // namespace fingertip
