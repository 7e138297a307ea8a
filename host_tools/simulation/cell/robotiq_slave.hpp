// The registers of a simulated Robotiq gripper (gripper/robotiq_registers.hpp) over its motion.
//
// After the manuals: activation begins where rACT rises and takes its time; a move before gives
// gFLT 7, one while it goes on gFLT 5 and is done afterwards; rATR opens or closes slowly (gFLT 11)
// and then needs a reset (gFLT 15). Assumed, for nothing is public: gFLT 9 is reported once, by the
// first answer after a second of silence, and what moves goes on; a move begins where a register of
// it changes or rGTO rises.
#pragma once

#include "grasp/gripper/robotiq_registers.hpp"
#include "simulation/cell/gripper_motion.hpp"

#include <array>
#include <cstdint>

namespace fingertip {

class RobotiqSlave {
public:
  // Takes model and time from the motion; the model must be a Robotiq's.
  explicit RobotiqSlave(GripperMotion &motion);

  // A frame for this slave came.
  void heard();
  // address: of a register from COMMAND_REGISTER on.
  void write(int address, std::uint16_t value);
  // Carries out the writes of a frame, after all of them.
  void update();
  // The content of the status registers. answered: an answer has them.
  std::array<std::uint16_t, robotiq::REGISTERS> status() const;
  void answered();

  // Without power all that was written is lost.
  void lose_power();
  // A fault that stays until the next activation; of enum Fault.
  void fail(std::uint8_t fault) { failed_ = fault; }

private:
  std::uint8_t fault() const;
  bool has(std::uint16_t bit) const { return (command_[0] & bit) != 0; }
  GripperMove wanted() const;

  GripperMotion &motion_;
  std::array<std::uint16_t, robotiq::REGISTERS> command_{}, done_{};
  double heard_s_ = 0.0;
  bool silence_ = false; // a second of it, not reported yet
  bool released_ = false;
  std::uint8_t failed_ = robotiq::NO_FAULT;
};

} // namespace fingertip
