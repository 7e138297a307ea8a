// A gripper of one Feetech STS3215 that turns one jaw against a fixed one, as an SO-101's.
//
// The width between the pads is that of a chord: 2 jaw sin(angle / 2). The angle counts from where the pads touch.
// Counts of the ends and the jaw's length are options (GripperWay). The defaults are a jaw of 100 mm that touches at
// 2048 and opens by a radian, 652 counts, to 96 mm. The pads are parallel only where they touch.
//
// Its force limit is a share of the stall torque, 1.9 Nm at 7.4 V by the maker's figures, over the
// jaw. This is only a guess of the force in newtons: friction in the gears is at least as large.
//
// Sources of the servo's memory and packets: Feetech, "STS Magnetic Encoding Smart Servo Protocol Manual", and "SMS/STS memory table".
// Half-duplex serial. A packet is FF FF, id, length (of the rest), instruction or error bits, parameters, checksum (~ of the sum from id
// on). Values of two bytes have the low byte first. Negative ones have a sign bit.
#pragma once

#include "grasp/gripper/common.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace fingertip::feetech {

constexpr int BAUD = 1'000'000;
constexpr int SLAVE = 6, MOST_SLAVE = 253; // the gripper of an SO-101
constexpr double COUNTS_PER_TURN = 4096.0;

enum Instruction : std::uint8_t { PING = 1, READ = 2, WRITE = 3 };

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
  GOAL_SPEED = 46,       // 2 bytes, counts a second
  TORQUE_LIMIT = 48,     // 2 bytes, 0.1 % of the stall torque
  PRESENT_POSITION = 56, // 2 bytes
  STATUS = 65,           // enum Trouble
  MOVING = 66,
  PRESENT_CURRENT = 69, // 2 bytes, 6.5 mA
  TABLE_END = 71,
};

enum Trouble : std::uint8_t { VOLTAGE = 1, SENSOR = 2, TEMPERATURE = 4, CURRENT = 8, ANGLE = 16, OVERLOAD = 32 };

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

namespace fingertip {

class Jaw {
public:
  explicit Jaw(const GripperWay &complete) : closed_(*complete.closed_count), open_(*complete.open_count), jaw_mm_(complete.jaw_mm) {}

  double stroke_mm() const { return width_mm(open_); }
  double step_mm() const { return jaw_mm_ * COUNT_rad; } // of one count, closed, where it is the largest
  // Below 0 beyond where the pads touch.
  double width_mm(double count) const {
    const double turned = open_ > closed_ ? count - closed_ : closed_ - count;
    return 2 * jaw_mm_ * std::sin(std::clamp(turned * COUNT_rad, -std::numbers::pi, std::numbers::pi) / 2);
  }
  // The count of a width from 0 to the stroke.
  double count(double width_mm) const {
    const double turned = 2 * std::asin(std::clamp(width_mm / (2 * jaw_mm_), 0.0, 1.0)) / COUNT_rad;
    return open_ > closed_ ? closed_ + turned : closed_ - turned;
  }
  // The change of width for one count, at this width.
  double slope_mm(double width_mm) const {
    const double sine = std::clamp(width_mm / (2 * jaw_mm_), 0.0, 1.0);
    return step_mm() * std::sqrt(1 - sine * sine);
  }

private:
  static constexpr double COUNT_rad = 2 * std::numbers::pi / feetech::COUNTS_PER_TURN;
  int closed_, open_;
  double jaw_mm_;
};

// What the servo can do on the jaw of this way.
GripperTraits feetech_traits(const std::string &model, const GripperWay &complete);
// Completed by the defaults. Throws Error: bad_value.
GripperWay feetech_way(const GripperWay &way);

class FeetechGripper final : public RequestLine {
public:
  explicit FeetechGripper(const GripperWay &given);

  std::string line() const override;
  // Torque on, at the position where it is.
  void activate() override;
  GripperStatus poll() override;
  GripperStatus move(const GripCommand &move) override;
  // Several bits may be set.
  std::string fault_text(std::uint8_t fault) const override;

private:
  Reply take(const Bytes &question, std::size_t length, Bytes *came, std::size_t *noise, Bytes *payload) override;
  std::pair<Bytes, std::size_t> probe(int number) const override;
  Bytes question_of(std::uint8_t instruction, const Bytes &parameters) const {
    return feetech::encoded({static_cast<std::uint8_t>(way_.slave), instruction, parameters});
  }
  Bytes read(std::uint8_t address, std::uint8_t length) { return exchange(question_of(feetech::READ, {address, length}), length); }
  void write(std::uint8_t address, const Bytes &values);
  void command(double count, int speed, int torque);

  Jaw jaw_;
  int servo_model_ = 0;
  std::int64_t commanded_us_ = 0;
  double goal_count_ = -1;
};

} // namespace fingertip
