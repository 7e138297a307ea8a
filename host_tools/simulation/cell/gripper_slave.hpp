// What is behind a simulated gripper's line: its protocol and its registers.
#pragma once

#include "simulation/cell/gripper_server.hpp"

namespace fingertip {

class GripperServer::Slave {
public:
  using Bytes = std::vector<std::uint8_t>;
  virtual ~Slave() = default;
  virtual double baud() const = 0;
  // Takes a whole frame out of what came; false: there is none yet.
  virtual bool take_frame(Bytes *came, Bytes *frame) = 0;
  // Empty: it does not answer.
  virtual Bytes answer(const Bytes &frame, bool refuse) = 0;
  virtual Bytes of_other_slave(Bytes answer) = 0;
  // Without power all that was written is lost.
  virtual void lose_power() = 0;
  virtual void fail(std::uint8_t fault) = 0;
};

std::unique_ptr<GripperServer::Slave> robotiq_slave(GripperMotion &motion, const GripperServer::Options &options);
std::unique_ptr<GripperServer::Slave> feetech_slave(GripperMotion &motion, const GripperServer::Options &options);

} // namespace fingertip
