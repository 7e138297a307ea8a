// Robotiq 2F-85, 2F-140 and Hand-E by Modbus RTU (robotiq_registers.hpp).
//
// The driver finds out which functions a gripper answers. To read it tries 4, then 3, when it opens. To write and read
// it tries 23, then 16 and a read, at the first moves, since only a command can show it.
//
// A move writes rPR, rSP and rFR alone. So a gripper that lost its power since the last answer stays inactive. Writing rACT again would
// activate it and drop what it holds. rGTO is written with them only if a status has just shown active without gGTO.
#pragma once

#include "grasp/gripper/common.hpp"

#include <array>

namespace fingertip {

class RobotiqGripper final : public Gripper, AskedLine {
public:
  explicit RobotiqGripper(const GripperWay &given);

  const GripperTraits &traits() const override { return traits_; }
  std::string line() const override;
  void activate() override;
  GripperStatus poll() override;
  GripperStatus move(const GripperMove &move) override;
  std::string fault_text(std::uint8_t fault) const override;

private:
  using Registers = std::array<std::uint16_t, 3>;

  Heard take(const Bytes &question, std::size_t length, Bytes *came, std::size_t *noise, Bytes *payload) override;
  std::pair<Bytes, std::size_t> sure_question(int number) const override;
  // rest: what follows the function.
  Bytes question_of(std::uint8_t function, const Bytes &rest) const;
  Bytes read_question(int count) const;
  Registers read(int count);
  GripperStatus read_status();
  GripperStatus status_of(const Registers &registers);
  void write(int address, int count, const std::uint16_t *values);

  GripperTraits traits_;
  int read_function_ = 4;
  bool both_at_once_ = true; // function 23
  int both_failed_ = 0;      // failures of both in a row, while neither has ever worked
  bool both_worked_ = false;
  bool goes_ = false, active_ = false; // by the last status
};

} // namespace fingertip
