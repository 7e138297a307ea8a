// The memory of Feetech's STS servos, as far as a gripper needs it, and their packets. Sources:
// Feetech, "STS Magnetic Encoding Smart Servo Protocol Manual", and "SMS/STS memory table".
//
// Half-duplex serial, 1 Mbit/s, 8N1. A packet is FF FF, id, length (of the rest), instruction or error bits, parameters, checksum (~ of the
// sum from id on). Values of two bytes have the low byte first. Negative ones have a sign bit.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace fingertip::feetech {

constexpr int BAUD = 1'000'000;
constexpr int SLAVE = 6; // the gripper of an SO-101
constexpr int MOST_SLAVE = 253;
constexpr std::uint8_t BROADCAST = 254;
constexpr double COUNTS_PER_TURN = 4096.0;

enum Instruction : std::uint8_t {
  PING = 1,
  READ = 2,
  WRITE = 3,
  REG_WRITE = 4, // done on ACTION
  ACTION = 5,
  SYNC_READ = 0x82,
  SYNC_WRITE = 0x83,
};

enum Address : std::uint8_t {
  MODEL = 3, // 2 bytes
  ID = 5,
  LEAST_ANGLE = 9,     // 2 bytes
  MOST_ANGLE = 11,     // 2 bytes
  MOST_TORQUE = 16,    // 2 bytes, 0.1 %
  OPERATING_MODE = 33, // 0: position
  TORQUE_ENABLE = 40,
  ACCELERATION = 41,
  GOAL_POSITION = 42,    // 2 bytes
  GOAL_TIME = 44,        // 2 bytes
  GOAL_SPEED = 46,       // 2 bytes, counts a second
  TORQUE_LIMIT = 48,     // 2 bytes, 0.1 % of the stall torque
  PRESENT_POSITION = 56, // 2 bytes
  STATUS = 65,           // enum Trouble
  MOVING = 66,
  PRESENT_CURRENT = 69, // 2 bytes, 6.5 mA
  TABLE_END = 71,
};

enum Trouble : std::uint8_t {
  VOLTAGE = 1 << 0,
  SENSOR = 1 << 1,
  TEMPERATURE = 1 << 2,
  CURRENT = 1 << 3,
  ANGLE = 1 << 4,
  OVERLOAD = 1 << 5,
};

constexpr double AMPERE_PER_COUNT = 0.0065;
constexpr int SIGN = 1 << 15;
constexpr int STS3215 = 777; // MODEL

using Bytes = std::vector<std::uint8_t>;

struct Packet {
  std::uint8_t id = 0;
  std::uint8_t code = 0; // an instruction, or of an answer bits of enum Trouble
  Bytes parameters = {};
};

Bytes encoded(const Packet &packet);

// The first whole packet, taken out of the bytes together with what was before it. skipped counts
// bytes that belong to none: noise, or a packet whose checksum is wrong.
std::optional<Packet> take_packet(Bytes *bytes, std::size_t *skipped);

} // namespace fingertip::feetech
