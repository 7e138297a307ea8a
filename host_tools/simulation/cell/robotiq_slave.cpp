// A simulated Robotiq gripper: libmodbus as a slave, and registers (gripper/robotiq_registers.hpp) over its motion.
//
// After the manuals: activation begins where rACT rises and takes its time; a move before gives gFLT 7, one while
// it goes on gFLT 5 and is done afterwards. Assumed, for nothing is public: gFLT 9 is reported once, by the first
// answer after a second of silence, and what moves goes on; a move begins where a register of it changes or rGTO
// rises. Left out: automatic release, which the driver never asks for.
#include "grasp/gripper/robotiq_registers.hpp"
#include "simulation/cell/gripper_slave.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <modbus.h>
#include <new>
#include <sys/socket.h>
#include <unistd.h>

namespace fingertip {

using namespace robotiq;

namespace {

constexpr double FULL_CURRENT_A = 1.0;

std::uint16_t modbus_crc(const std::vector<std::uint8_t> &bytes, std::size_t count) {
  std::uint16_t crc = 0xFFFF;
  for (std::size_t i = 0; i < count; i++) {
    crc ^= bytes[i];
    for (int bit = 0; bit < 8; bit++) {
      crc = static_cast<std::uint16_t>(crc & 1 ? crc >> 1 ^ 0xA001 : crc >> 1);
    }
  }
  return crc;
}

// libmodbus sits at one end of a pair of sockets, so that its answers can be kept and spoilt.
class RobotiqSlave : public GripperServer::Slave {
public:
  RobotiqSlave(GripperMotion &motion, const GripperServer::Options &options)
      : motion_(motion), functions_(options.functions), modbus_(modbus_new_rtu("/dev/null", BAUD, 'N', 8, 1)),
        mapping_(modbus_mapping_new_start_address(0, 0, 0, 0, COMMAND_REGISTER, MAPPED, STATUS_REGISTER, REGISTERS)) {
    if (modbus_ == nullptr || mapping_ == nullptr || socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, ends_) != 0) {
      throw std::bad_alloc();
    }
    modbus_set_slave(modbus_, options.slave == 0 ? SLAVE : options.slave);
    modbus_set_socket(modbus_, ends_[0]);
    modbus_set_indication_timeout(modbus_, 0, 1000);
    modbus_set_byte_timeout(modbus_, 0, 1000);
  }
  ~RobotiqSlave() override {
    modbus_mapping_free(mapping_);
    modbus_free(modbus_);
    close(ends_[0]);
    close(ends_[1]);
  }

  double baud() const override { return BAUD; }

  bool take_frame(Bytes *came, Bytes *frame) override {
    std::size_t size = 8;
    if (came->size() < 2) {
      return false;
    }
    const std::size_t counted = (*came)[1] == 16 ? 6 : (*came)[1] == 23 ? 10 : 0;
    if (counted != 0) {
      if (came->size() <= counted) {
        return false;
      }
      size = counted + (*came)[counted] + 3u;
    }
    if (came->size() < size) {
      return false;
    }
    frame->assign(came->begin(), came->begin() + static_cast<std::ptrdiff_t>(size));
    came->erase(came->begin(), came->begin() + static_cast<std::ptrdiff_t>(size));
    return true;
  }

  Bytes answer(const Bytes &frame, bool refuse) override {
    Bytes bytes(MODBUS_RTU_MAX_ADU_LENGTH);
    while (recv(ends_[0], bytes.data(), bytes.size(), 0) > 0) {
    }
    if (send(ends_[1], frame.data(), frame.size(), 0) != static_cast<ssize_t>(frame.size())) {
      return {};
    }
    Bytes query(MODBUS_RTU_MAX_ADU_LENGTH);
    const int length = modbus_receive(modbus_, query.data());
    if (length <= 0) {
      return {}; // damaged, or another's
    }
    silence_ = silence_ || motion_.time_s() - heard_s_ >= SILENCE_s;
    heard_s_ = motion_.time_s();
    if (refuse) {
      modbus_reply_exception(modbus_, query.data(), MODBUS_EXCEPTION_ILLEGAL_FUNCTION);
    } else {
      if (!obey(query)) {
        return {};
      }
      modbus_reply(modbus_, query.data(), length, mapping_);
      silence_ = false;
    }
    const ssize_t size = recv(ends_[1], bytes.data(), bytes.size(), 0);
    bytes.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
    return bytes;
  }

  Bytes of_other_slave(Bytes answer) override {
    answer[0]++;
    const std::uint16_t crc = modbus_crc(answer, answer.size() - 2);
    answer[answer.size() - 2] = static_cast<std::uint8_t>(crc & 0xFF);
    answer[answer.size() - 1] = static_cast<std::uint8_t>(crc >> 8);
    return answer;
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
  static constexpr int MAPPED = STATUS_REGISTER + REGISTERS - COMMAND_REGISTER;

  // False: a function or register that it does not know, which it does not answer.
  bool obey(const Bytes &query) {
    const auto word = [&](std::size_t at) { return query[at] << 8 | query[at + 1]; };
    const auto all_in = [](int address, int count, int first) {
      return count > 0 && address >= first && address + count <= first + REGISTERS;
    };
    const int function = query[1];
    if (std::find(functions_.begin(), functions_.end(), function) == functions_.end()) {
      return false;
    }
    if (function != 16 && !all_in(word(2), word(4), STATUS_REGISTER)) {
      return false;
    }
    if (function == 16 || function == 23) {
      const std::size_t at = function == 16 ? 2 : 6, values = function == 16 ? 7 : 11;
      if (!all_in(word(at), word(at + 2), COMMAND_REGISTER)) {
        return false;
      }
      for (int i = 0; i < word(at + 2); i++) {
        command_.at(static_cast<std::size_t>(word(at) + i - COMMAND_REGISTER)) =
            static_cast<std::uint16_t>(word(values + 2 * static_cast<std::size_t>(i)));
      }
    }
    update();
    const Registers status = this->status();
    std::copy(status.begin(), status.end(), mapping_->tab_input_registers);
    std::copy(status.begin(), status.end(), mapping_->tab_registers + STATUS_REGISTER - COMMAND_REGISTER);
    return true;
  }

  bool has(std::uint16_t bit) const { return (command_[0] & bit) != 0; }

  GripperMove wanted() const {
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
    const long count =
        CLOSED_COUNT - std::lround(motion_.reported_width_mm() / traits.stroke_mm * (CLOSED_COUNT - OPEN_COUNT));
    const long current = std::lround(std::abs(motion_.effort()) * FULL_CURRENT_A / AMPERE_PER_COUNT);
    return {static_cast<std::uint16_t>((has(rACT) ? gACT : 0) | (goes ? gGTO : 0) | gsta << gSTA_SHIFT |
                                       gobj << gOBJ_SHIFT),
            static_cast<std::uint16_t>(fault() << 8 | (command_[1] & 0xFF)),
            static_cast<std::uint16_t>(count << 8 | current)};
  }

  GripperMotion &motion_;
  Registers command_{}, done_{};
  double heard_s_ = 0.0;
  bool silence_ = false; // a second of it, not reported yet
  std::uint8_t failed_ = NO_FAULT;
  std::vector<int> functions_;
  modbus_t *modbus_;
  modbus_mapping_t *mapping_;
  int ends_[2] = {-1, -1};
};

} // namespace

std::unique_ptr<GripperServer::Slave> robotiq_slave(GripperMotion &motion, const GripperServer::Options &options) {
  return std::make_unique<RobotiqSlave>(motion, options);
}

} // namespace fingertip
