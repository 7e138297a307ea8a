// The memory of a simulated Feetech STS3215 (gripper/feetech_table.hpp) over its jaw's motion, and
// what it answers to packets: ping, read, write, write and action, sync write, sync read.
#pragma once

#include "grasp/gripper/feetech.hpp"
#include "grasp/gripper/feetech_table.hpp"
#include "simulation/cell/gripper_motion.hpp"

#include <array>
#include <cstdint>
#include <optional>

namespace fingertip {

class FeetechSlave {
public:
  // complete: with counts and slave (feetech_way). Time is the motion's.
  FeetechSlave(GripperMotion &motion, const GripperWay &complete);

  // Nothing where it is for another, for all, or for none.
  std::optional<feetech::Packet> answer(const feetech::Packet &question);
  void lose_power();
  // Bits of enum Trouble.
  void fail(std::uint8_t trouble) { trouble_ = trouble; }

private:
  int word(int address) const;
  void put(int address, int value);
  void refresh();
  void write(std::uint8_t address, const std::uint8_t *bytes, std::size_t count);
  void obey();
  feetech::Packet telling(std::uint8_t address, std::uint8_t length);

  GripperMotion &motion_;
  Jaw jaw_;
  std::uint8_t id_;
  std::array<std::uint8_t, 128> memory_{};
  feetech::Bytes waiting_; // of REG_WRITE
  std::uint8_t trouble_ = 0;
};

} // namespace fingertip
