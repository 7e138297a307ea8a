// Robotiq 2F-85, 2F-140 and Hand-E by Modbus RTU.
//
// The driver finds out which functions a gripper answers. To read it tries 4, then 3, when it opens. To write and read
// it tries 23, then 16 and a read, at the first moves, since only a command can show it.
//
// A move writes rPR, rSP and rFR alone. So a gripper that lost its power since the last answer stays inactive. Writing rACT again would
// activate it and drop what it holds. rGTO is written with them only if a status has just shown active without gGTO.
//
// Sources: Robotiq, "2F-85 & 2F-140 Instruction Manual" and "Hand-E Gripper Instruction Manual", sections Control (register mapping) and
// Modbus RTU communication. Functions: 16 and 23 write; 23 and 4 read, in older manuals 3 instead of 4. There are no exception answers: the
// gripper does not answer what it does not know. A register is two of the maker's bytes, the first in the high half.
#pragma once

#include "grasp/gripper/common.hpp"

#include <array>

namespace fingertip::robotiq {

constexpr std::uint8_t WRITE = 16, WRITE_AND_READ = 23; // functions
constexpr std::uint8_t EXCEPTION = 0x80;                // added to one that is refused

using Bytes = std::vector<std::uint8_t>;

// Modbus' checksum; 0 of a frame with its own.
std::uint16_t crc_of(const Bytes &bytes);
Bytes with_crc(Bytes bytes);

constexpr int BAUD = 115200, SLAVE = 9;

constexpr int COMMAND_REGISTER = 1000; // three: action; rPR; rSP and rFR
constexpr int STATUS_REGISTER = 2000;  // three: status; gFLT and gPR; gPO and gCU
constexpr int REGISTERS = 3;

// Bits of the action, in the high byte of the first command register. Activation begins where rACT
// rises; while it is 0 the gripper is reset, which clears major faults. rGTO: go to the position of rPR.
enum Action : std::uint16_t { rACT = 1 << 8, rGTO = 1 << 11 };
// Bits of the status, in the high byte of the first status register; the latter two have two bits.
enum Status : std::uint16_t { gACT = 1 << 8, gGTO = 1 << 11, gSTA_SHIFT = 12, gOBJ_SHIFT = 14 };
enum Gsta { RESET = 0, ACTIVATING = 1, ACTIVATED = 3 };
enum Gobj { IN_MOTION = 0, STOPPED_OPENING = 1, STOPPED_CLOSING = 2, AT_REQUEST = 3 };

// Of the low half of the fault byte (RobotiqGripper::fault_text has the others); from 10 on only a reset clears it.
enum Fault : std::uint8_t { NO_FAULT = 0, ACTION_DELAYED = 5, NOT_ACTIVATED = 7, NO_COMMUNICATION = 9, OVERCURRENT = 14 };

constexpr double AMPERE_PER_COUNT = 0.01; // of gCU
constexpr double SILENCE_s = 1.0;         // then NO_COMMUNICATION

// gPO at the mechanical ends, beyond which requests lead nowhere: 3 and 230 on a 2F-85 by Robotiq's
// knowledge base, "encoder bytes of the adaptive gripper"; taken for the other two as well.
constexpr int OPEN_COUNT = 3, CLOSED_COUNT = 230;

// What the registers and the names of a URCap (robotiq_urcap.hpp) have in common.
GripperWay complete_way(const GripperWay &given); // Throws Error: bad_value
double step_mm(const GripperWay &complete, const GripperTraits &traits);
struct Request {
  int position, speed, force; // rPR, rSP, rFR
};
Request request_of(const GripCommand &move, const GripperWay &complete, const GripperTraits &traits); // Throws Error: bad_value
struct Answer {
  bool active, goes;
  int gsta, gobj, gpo, gflt;
};
GripperStatus status_of(const Answer &answer, std::int64_t asked_us, const GripperWay &complete, const GripperTraits &traits);
std::string fault_text(std::uint8_t fault);

} // namespace fingertip::robotiq

namespace fingertip {

class RobotiqGripper final : public RequestLine {
public:
  explicit RobotiqGripper(const GripperWay &given);

  std::string line() const override;
  void activate() override;
  GripperStatus poll() override { return status_of(registers_of(read_question(robotiq::REGISTERS), robotiq::REGISTERS)); }
  GripperStatus move(const GripCommand &move) override;
  std::string fault_text(std::uint8_t fault) const override { return robotiq::fault_text(fault); }

private:
  using Registers = std::array<std::uint16_t, robotiq::REGISTERS>;

  Reply take(const Bytes &question, std::size_t length, Bytes *came, std::size_t *noise, Bytes *payload) override;
  std::pair<Bytes, std::size_t> probe(int number) const override;
  // rest: what follows the function.
  Bytes question_of(int function, const Bytes &rest) const;
  Bytes read_question(int count) const;
  Registers registers_of(const Bytes &question, int count); // of its answer
  GripperStatus status_of(const Registers &registers);
  void write(const Registers &command, int from = 0); // from this one of the three on

  int read_function_ = 4;
  bool both_at_once_ = true; // function 23
  int both_failed_ = 0;      // failures of both in a row, while neither has ever worked
  bool both_worked_ = false;
  bool goes_ = false; // by the last status
};

} // namespace fingertip
