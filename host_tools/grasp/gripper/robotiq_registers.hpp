// The registers of Robotiq's two-finger grippers, alike for 2F-85, 2F-140 and Hand-E. Sources: Robotiq, "2F-85 & 2F-140 Instruction Manual"
// and "Hand-E Gripper Instruction Manual", sections Control (register mapping) and Modbus RTU communication.
//
// Modbus RTU, 115200 baud, 8N1, slave 9. Functions: 16 and 23 write; 23 and 4 read, in older manuals 3 instead of 4. There are no exception
// answers: the gripper does not answer what it does not know. A register is two of the maker's bytes, the first in the high half.
#pragma once

#include <cstdint>
#include <vector>

namespace fingertip::robotiq {

constexpr std::uint8_t WRITE = 16, WRITE_AND_READ = 23; // functions
constexpr std::uint8_t EXCEPTION = 0x80;                // added to one that is refused

using Bytes = std::vector<std::uint8_t>;

// Modbus' checksum; 0 of a frame with its own.
std::uint16_t crc_of(const Bytes &bytes);
Bytes with_crc(Bytes bytes);

constexpr int BAUD = 115200;
constexpr int SLAVE = 9;

constexpr int COMMAND_REGISTER = 1000; // three: action; rPR; rSP and rFR
constexpr int STATUS_REGISTER = 2000;  // three: status; gFLT and gPR; gPO and gCU
constexpr int REGISTERS = 3;

// Bits of the action, in the high byte of the first command register. Activation begins where rACT
// rises; while it is 0 the gripper is reset, which clears major faults.
enum Action : std::uint16_t {
  rACT = 1 << 8,
  rGTO = 1 << 11, // go to the position of rPR
};

// Bits of the status, in the high byte of the first status register.
enum Status : std::uint16_t {
  gACT = 1 << 8,
  gGTO = 1 << 11,
  gSTA_SHIFT = 12, // two bits
  gOBJ_SHIFT = 14, // two bits
};
enum Gsta { RESET = 0, ACTIVATING = 1, ACTIVATED = 3 };
enum Gobj { IN_MOTION = 0, STOPPED_OPENING = 1, STOPPED_CLOSING = 2, AT_REQUEST = 3 };

// The low half of the fault byte; from 10 on only a reset clears it.
enum Fault : std::uint8_t {
  NO_FAULT = 0,
  ACTION_DELAYED = 5,
  NOT_ACTIVATED = 7,
  OVERHEATED = 8,
  NO_COMMUNICATION = 9, // for a second
  UNDERVOLTAGE = 10,
  RELEASING = 11,
  INTERNAL_FAULT = 12,
  ACTIVATION_FAULT = 13,
  OVERCURRENT = 14,
  RELEASED = 15,
};

constexpr double AMPERE_PER_COUNT = 0.01; // of gCU
constexpr double SILENCE_s = 1.0;         // then NO_COMMUNICATION

// gPO at the mechanical ends, beyond which requests lead nowhere: 3 and 230 on a 2F-85 by Robotiq's
// knowledge base, "encoder bytes of the adaptive gripper"; taken for the other two as well.
constexpr int OPEN_COUNT = 3;
constexpr int CLOSED_COUNT = 230;

} // namespace fingertip::robotiq
