// Robotiq 2F-85, 2F-140 and Hand-E by Modbus RTU (robotiq_registers.hpp), through libmodbus.
//
// The driver finds out which functions a gripper answers. To read it tries 4, then 3, when it
// opens. To write and read it tries 23, then 16 and a read, at the first moves, since only a
// command can show it.
//
// A move writes rPR, rSP and rFR alone. So a gripper that lost its power since the last answer
// stays inactive. Writing rACT again would activate it and drop what it holds. rGTO is written with
// them only if a status has just shown active without gGTO.
#pragma once

#include "grasp/gripper/gripper.hpp"
#include "grasp/gripper/serial_line.hpp"
#include "libfingertip/clock.hpp"

#include <array>
#include <cstdint>
#include <vector>

using modbus_t = struct _modbus;

namespace fingertip {

class RobotiqGripper : public Gripper {
public:
  explicit RobotiqGripper(const GripperWay &given);
  ~RobotiqGripper() override;

  const GripperTraits &traits() const override { return traits_; }
  std::string line() const override;
  void activate() override;
  GripperStatus poll() override;
  GripperStatus move(const GripperMove &move) override;
  std::string fault_text(std::uint8_t fault) const override;

private:
  using Registers = std::array<std::uint16_t, 3>;

  using Bytes = std::vector<std::uint8_t>;

  // request: the function and what belongs to it. Returns what follows the function in the answer,
  // which has this number of bytes.
  Bytes exchange(const Bytes &request, std::size_t length);
  HostTime ask(const Bytes &request); // until when to wait
  Bytes hear(const Bytes &request, std::size_t length, HostTime until);
  Bytes read_request(int count) const;
  std::chrono::microseconds timeout() const;
  void make_sure();
  void meet(); // the first question, which finds an echo
  void drop_echo(std::size_t length, HostTime until);
  Registers read(int count);
  GripperStatus read_status();
  GripperStatus status_of(const Registers &registers);
  void write(int address, int count, const std::uint16_t *values);

  GripperTraits traits_;
  GripperWay way_; // complete
  SerialLine line_;
  modbus_t *modbus_;
  int read_function_ = 4;
  bool both_at_once_ = true; // function 23
  int both_failed_ = 0;      // failures of both in a row, while neither has ever worked
  bool both_worked_ = false;
  bool echoes_ = false;
  bool doubtful_ = false;              // an answer may still come that is not expected
  int sure_count_ = 0;                 // registers that make_sure has asked for, 0: none yet,
  HostTime sure_until_{};              // and still waits for
  bool goes_ = false, active_ = false; // by the last status
  std::int64_t began_us_ = 0;
};

} // namespace fingertip
