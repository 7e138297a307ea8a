// The memory of a simulated Feetech STS3215 (gripper/feetech.hpp) over its jaw's motion, and what it
// answers to the maker's instructions PING, READ and WRITE.
#include "grasp/gripper/feetech.hpp"
#include "simulation/cell/gripper_server.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace fingertip {

using namespace feetech;

namespace {

constexpr double STALL_A = 2.7;

class FeetechSlave : public GripperServer::Slave {
public:
  FeetechSlave(GripperMotion &motion, const GripperWay &complete)
      : motion_(motion), jaw_(complete), id_(static_cast<std::uint8_t>(complete.slave)) {
    const bool is_active = motion.active();
    FeetechSlave::lose_power();
    if (is_active) {
      memory_[TORQUE_ENABLE] = 1;
      motion.activate();
    }
  }

  double baud() const override { return BAUD; }

  bool take_frame(Bytes *came, Bytes *frame) override {
    std::size_t skipped = 0;
    const std::optional<Packet> packet = take_packet(came, &skipped);
    *frame = packet ? encoded(*packet) : Bytes();
    return packet.has_value();
  }

  Bytes answer(const Bytes &frame, bool refuse) override {
    const Packet question = packet_of(frame);
    const Bytes &given = question.parameters;
    const bool is_known = question.code == PING || question.code == WRITE || (question.code == READ && given.size() == 2);
    if (question.id != id_ || !is_known) {
      return {};
    }
    if (question.code == WRITE) {
      write(given);
    }
    Packet answer = question.code == READ ? read(given) : Packet{.id = id_, .code = trouble_};
    answer.code |= refuse ? std::uint8_t{OVERLOAD} : std::uint8_t{0};
    return encoded(answer);
  }

  Bytes of_other_slave(Bytes answer) override {
    Packet packet = packet_of(answer);
    packet.id++;
    return encoded(packet);
  }

  void lose_power() override {
    motion_.power_off();
    memory_ = {};
    trouble_ = 0;
    put(MODEL, STS3215);
    memory_[ID] = id_;
    put(MOST_ANGLE, 4095);
    put(MOST_TORQUE, 1000);
    put(TORQUE_LIMIT, 1000);
    refresh();
    put(GOAL_POSITION, word(PRESENT_POSITION));
  }

  // Bits of enum Trouble.
  void fail(std::uint8_t trouble) override { trouble_ = trouble; }

private:
  // Of a whole one.
  static Packet packet_of(Bytes bytes) {
    std::size_t skipped = 0;
    return *take_packet(&bytes, &skipped);
  }

  int word(std::size_t at) const { return memory_[at] | memory_[at + 1] << 8; }
  void put(std::size_t at, int value) {
    memory_[at] = static_cast<std::uint8_t>(value & 0xFF);
    memory_[at + 1] = static_cast<std::uint8_t>(value >> 8);
  }

  void refresh() {
    put(PRESENT_POSITION, static_cast<int>(std::lround(jaw_.count(motion_.reported_width_mm()))));
    memory_[STATUS] = trouble_;
    memory_[MOVING] = motion_.moving() ? 1 : 0;
    put(PRESENT_CURRENT, static_cast<int>(std::lround(motion_.effort() * STALL_A / AMPERE_PER_COUNT)));
  }

  // given: an address and how much from there on.
  Packet read(const Bytes &given) {
    refresh();
    Packet answer = {.id = id_, .code = trouble_};
    for (std::size_t i = given[0]; i < std::size_t{given[0]} + given[1]; i++) {
      answer.parameters.push_back(i < memory_.size() ? memory_[i] : 0);
    }
    return answer;
  }

  // given: an address and what goes there. Then it does what its memory asks for.
  void write(const Bytes &given) {
    if (given.size() < 2) {
      return;
    }
    for (std::size_t i = 1; i < given.size(); i++) {
      const std::size_t at = given[0] + i - 1;
      if (at > MODEL + 1 && at < PRESENT_POSITION) {
        memory_[at] = given[i];
      }
    }
    if (memory_[TORQUE_ENABLE] == 0) {
      motion_.power_off();
      return;
    }
    if (!motion_.active()) {
      motion_.activate();
      trouble_ &= static_cast<std::uint8_t>(~OVERLOAD);
    }
    const GripperTraits &traits = motion_.mechanics().traits;
    const double width_mm = jaw_.width_mm(std::clamp(word(GOAL_POSITION), word(LEAST_ANGLE), word(MOST_ANGLE)));
    const int speed = word(GOAL_SPEED);
    motion_.move({.width_mm = width_mm,
                  .speed_mm_s = speed == 0 ? traits.speed_max_mm_s : speed * jaw_.slope_mm(width_mm),
                  .force_N = std::min(word(TORQUE_LIMIT), word(MOST_TORQUE)) * traits.force_max_N / 1000});
  }

  GripperMotion &motion_;
  Jaw jaw_;
  std::uint8_t id_;
  std::array<std::uint8_t, 128> memory_{};
  std::uint8_t trouble_ = 0;
};

} // namespace

std::unique_ptr<GripperServer::Slave> feetech_slave(GripperMotion &motion, const GripperServer::Options &options) {
  return std::make_unique<FeetechSlave>(motion, feetech_way({.model = options.model, .slave = options.slave}));
}

} // namespace fingertip
