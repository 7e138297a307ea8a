// A simulated Robotiq gripper: a Modbus slave and registers (gripper/robotiq.hpp) over its motion. After the manuals: activation begins
// where rACT rises and takes its time; a move before gives gFLT 7, one while it goes on gFLT 5 and is done afterwards. Assumed, for nothing
// is public: gFLT 9 is reported once, by the first answer after a second of silence, and what moves goes on; a move begins where a register
// of it changes or rGTO rises. Left out: automatic release, which the driver never asks for.
#include "grasp/gripper/robotiq.hpp"
#include "simulation/cell/gripper_server.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace fingertip {

using namespace robotiq;

namespace {

constexpr double FULL_CURRENT_A = 1.0;

constexpr std::uint8_t ILLEGAL_FUNCTION = 1;

class RobotiqSlave : public GripperServer::Slave {
public:
  RobotiqSlave(GripperMotion &motion, const GripperServer::Options &options)
      : motion_(motion), functions_(options.functions), slave_(static_cast<std::uint8_t>(options.slave == 0 ? SLAVE : options.slave)) {
    command_[0] = done_[0] = motion.active() ? rACT : 0;
  }

  double baud() const override { return BAUD; }

  bool take_frame(Bytes *came, Bytes *frame) override {
    if (came->size() < 8) {
      return false;
    }
    const std::size_t counted = (*came)[1] == WRITE ? 6 : (*came)[1] == WRITE_AND_READ ? 10 : 0;
    const std::size_t size = counted == 0 ? 8 : counted < came->size() ? counted + (*came)[counted] + 3u : counted + 1;
    if (came->size() < size) {
      return false;
    }
    frame->assign(came->begin(), came->begin() + static_cast<std::ptrdiff_t>(size));
    came->erase(came->begin(), came->begin() + static_cast<std::ptrdiff_t>(size));
    return true;
  }

  Bytes answer(const Bytes &frame, bool refuse) override {
    if (frame[0] != slave_ || crc_of(frame) != 0) {
      return {}; // another's, or damaged
    }
    silence_ = silence_ || motion_.time_s() - heard_s_ >= SILENCE_s;
    heard_s_ = motion_.time_s();
    if (refuse) {
      return with_crc({slave_, static_cast<std::uint8_t>(frame[1] | EXCEPTION), ILLEGAL_FUNCTION});
    }
    const Bytes answer = obey(frame);
    silence_ = silence_ && answer.empty();
    return answer.empty() ? answer : with_crc(answer);
  }

  Bytes of_other_slave(Bytes answer) override {
    answer[0]++;
    return with_crc({answer.begin(), answer.end() - 2});
  }
  void lose_power() override {
    command_ = done_ = {};
    silence_ = false;
    failed_ = NO_FAULT;
    heard_s_ = motion_.time_s();
    motion_.power_off();
  }
  // A fault that stays until the next activation; of enum Fault.
  void fail(std::uint8_t fault) override { failed_ = fault; }

private:
  using Registers = std::array<std::uint16_t, REGISTERS>;

  // Its answer without the checksum; empty to a function or register that it does not know.
  Bytes obey(const Bytes &frame) {
    const auto word = [&](std::size_t at) { return frame[at] << 8 | frame[at + 1]; };
    const auto all_in = [](int address, int count, int first) {
      return count > 0 && address >= first && address + count <= first + REGISTERS;
    };
    const int function = frame[1];
    const bool writes = function == WRITE || function == WRITE_AND_READ, reads = function != WRITE;
    const std::size_t at = reads ? 6 : 2;
    if (std::find(functions_.begin(), functions_.end(), function) == functions_.end() ||
        (reads && !all_in(word(2), word(4), STATUS_REGISTER)) ||
        (writes && !(all_in(word(at), word(at + 2), COMMAND_REGISTER) && frame[at + 4] == 2 * word(at + 2)))) {
      return {};
    }
    for (int i = 0; writes && i < word(at + 2); i++) {
      command_.at(static_cast<std::size_t>(word(at) + i - COMMAND_REGISTER)) =
          static_cast<std::uint16_t>(word(at + 5 + 2 * static_cast<std::size_t>(i)));
    }
    update();
    if (!reads) {
      return {frame.begin(), frame.begin() + 6};
    }
    const Registers registers = status();
    Bytes answer = {slave_, frame[1], static_cast<std::uint8_t>(2 * word(4))};
    for (int i = word(2) - STATUS_REGISTER; i < word(2) - STATUS_REGISTER + word(4); i++) {
      const std::uint16_t value = registers[static_cast<std::size_t>(i)];
      answer.insert(answer.end(), {static_cast<std::uint8_t>(value >> 8), static_cast<std::uint8_t>(value & 0xFF)});
    }
    return answer;
  }

  bool has(std::uint16_t bit) const { return (command_[0] & bit) != 0; }

  GripCommand wanted() const {
    const GripperTraits &traits = motion_.mechanics().traits;
    const auto scaled = [](int value, double least, double most) { return least + (most - least) * value / 255.0; };
    const double step_mm = traits.stroke_mm / (CLOSED_COUNT - OPEN_COUNT);
    return {.width_mm = (CLOSED_COUNT - (command_[1] & 0xFF)) * step_mm,
            .speed_mm_s = scaled(command_[2] >> 8, traits.speed_min_mm_s, traits.speed_max_mm_s),
            .force_N = scaled(command_[2] & 0xFF, traits.force_min_N, traits.force_max_N)};
  }

  // Carries out the writes of a frame, after all of them.
  void update() {
    const bool was_active = (done_[0] & rACT) != 0, went = (done_[0] & rGTO) != 0;
    if (!has(rACT)) {
      motion_.power_off();
    } else if (!was_active) {
      failed_ = NO_FAULT;
      motion_.activate();
    }
    if (has(rACT) && motion_.active() && failed_ == NO_FAULT) {
      if (has(rGTO) && (!went || command_ != done_)) {
        motion_.move(wanted());
      } else if (!has(rGTO) && went) {
        motion_.stop();
      }
      done_ = command_;
    } else {
      // What moves is done once activation is complete.
      done_[0] = has(rACT) ? rACT : 0;
    }
  }

  std::uint8_t fault() const {
    if (failed_ != NO_FAULT) {
      return failed_;
    }
    if (has(rGTO) && !has(rACT)) {
      return NOT_ACTIVATED;
    }
    if (has(rGTO) && motion_.activating()) {
      return ACTION_DELAYED;
    }
    return silence_ ? NO_COMMUNICATION : NO_FAULT;
  }

  Registers status() const {
    const GripperTraits &traits = motion_.mechanics().traits;
    const bool goes = has(rGTO) && motion_.active() && failed_ == NO_FAULT;
    const int gsta = !has(rACT) || failed_ != NO_FAULT ? RESET : motion_.active() ? ACTIVATED : ACTIVATING;
    const int gobj = !goes || motion_.moving() ? IN_MOTION
                     : motion_.blocked() > 0   ? STOPPED_OPENING
                     : motion_.blocked() < 0   ? STOPPED_CLOSING
                                               : AT_REQUEST;
    const long count = CLOSED_COUNT - std::lround(motion_.reported_width_mm() / traits.stroke_mm * (CLOSED_COUNT - OPEN_COUNT));
    const long current = std::lround(motion_.effort() * FULL_CURRENT_A / AMPERE_PER_COUNT);
    return {static_cast<std::uint16_t>((has(rACT) ? gACT : 0) | (goes ? gGTO : 0) | gsta << gSTA_SHIFT | gobj << gOBJ_SHIFT),
            static_cast<std::uint16_t>(fault() << 8 | (command_[1] & 0xFF)), static_cast<std::uint16_t>(count << 8 | current)};
  }

  GripperMotion &motion_;
  Registers command_{}, done_{};
  double heard_s_ = 0.0;
  bool silence_ = false; // a second of it, not reported yet
  std::uint8_t failed_ = NO_FAULT;
  std::vector<int> functions_;
  std::uint8_t slave_;
};

} // namespace

std::unique_ptr<GripperServer::Slave> robotiq_slave(GripperMotion &motion, const GripperServer::Options &options) {
  return std::make_unique<RobotiqSlave>(motion, options);
}

} // namespace fingertip
