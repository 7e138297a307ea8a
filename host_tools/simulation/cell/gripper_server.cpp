#include "simulation/cell/gripper_server.hpp"

#include "grasp/gripper/common.hpp"
#include "simulation/cell/feetech_slave.hpp"
#include "simulation/cell/robotiq_slave.hpp"

#include <algorithm>
#include <cmath>
#include <modbus.h>
#include <sys/socket.h>
#include <unistd.h>

namespace fingertip {

namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::chrono::milliseconds FRAME_GAP{20}; // what is no whole frame by then is none
constexpr double BITS_PER_BYTE = 10;
// While a machine stalls for longer, the gripper's time stops: no command could have reached it.
constexpr double STALL_s = 0.1;
constexpr double LONGEST_STEP_s = 0.01; // of the motion

std::uint16_t modbus_crc(const Bytes &bytes, std::size_t count) {
  std::uint16_t crc = 0xFFFF;
  for (std::size_t i = 0; i < count; i++) {
    crc ^= bytes[i];
    for (int bit = 0; bit < 8; bit++) {
      crc = static_cast<std::uint16_t>(crc & 1 ? crc >> 1 ^ 0xA001 : crc >> 1);
    }
  }
  return crc;
}

} // namespace

class GripperServer::Slave {
public:
  virtual ~Slave() = default;
  virtual double baud() const = 0;
  // Takes a whole frame out of what came; false: there is none yet.
  virtual bool take_frame(Bytes *came, Bytes *frame) = 0;
  // Empty: it does not answer.
  virtual Bytes answer(const Bytes &frame, bool refuse) = 0;
  virtual Bytes of_other_slave(Bytes answer) = 0;
  virtual void lose_power() = 0;
  virtual void fail(std::uint8_t fault) = 0;
};

namespace {

// libmodbus sits at one end of a pair of sockets, so that its answers can be kept and spoilt.
class ModbusSlave : public GripperServer::Slave {
public:
  ModbusSlave(GripperMotion &motion, const GripperServer::Options &options)
      : registers_(motion), functions_(options.functions),
        modbus_(modbus_new_rtu("/dev/null", robotiq::BAUD, 'N', 8, 1)),
        mapping_(modbus_mapping_new_start_address(0, 0, 0, 0, robotiq::COMMAND_REGISTER, MAPPED,
                                                  robotiq::STATUS_REGISTER, robotiq::REGISTERS)) {
    if (modbus_ == nullptr || mapping_ == nullptr || socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, ends_) != 0) {
      throw std::bad_alloc();
    }
    modbus_set_slave(modbus_, options.slave == 0 ? robotiq::SLAVE : options.slave);
    modbus_set_socket(modbus_, ends_[0]);
    modbus_set_indication_timeout(modbus_, 0, 1000);
    modbus_set_byte_timeout(modbus_, 0, 1000);
  }
  ~ModbusSlave() override {
    modbus_mapping_free(mapping_);
    modbus_free(modbus_);
    close(ends_[0]);
    close(ends_[1]);
  }

  double baud() const override { return robotiq::BAUD; }

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
    registers_.heard();
    if (refuse) {
      modbus_reply_exception(modbus_, query.data(), MODBUS_EXCEPTION_ILLEGAL_FUNCTION);
    } else {
      if (!obey(query)) {
        return {};
      }
      modbus_reply(modbus_, query.data(), length, mapping_);
      registers_.answered();
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
  void lose_power() override { registers_.lose_power(); }
  void fail(std::uint8_t fault) override { registers_.fail(fault); }

private:
  static constexpr int MAPPED = robotiq::STATUS_REGISTER + robotiq::REGISTERS - robotiq::COMMAND_REGISTER;

  // False: a function or register that it does not know, which it does not answer.
  bool obey(const Bytes &query) {
    const auto word = [&](std::size_t at) { return query[at] << 8 | query[at + 1]; };
    const auto all_in = [](int address, int count, int first) {
      return count > 0 && address >= first && address + count <= first + robotiq::REGISTERS;
    };
    const int function = query[1];
    if (std::find(functions_.begin(), functions_.end(), function) == functions_.end()) {
      return false;
    }
    if (function != 16 && !all_in(word(2), word(4), robotiq::STATUS_REGISTER)) {
      return false;
    }
    if (function == 16 || function == 23) {
      const std::size_t at = function == 16 ? 2 : 6, values = function == 16 ? 7 : 11;
      if (!all_in(word(at), word(at + 2), robotiq::COMMAND_REGISTER)) {
        return false;
      }
      for (int i = 0; i < word(at + 2); i++) {
        registers_.write(word(at) + i, static_cast<std::uint16_t>(word(values + 2 * static_cast<std::size_t>(i))));
      }
    }
    registers_.update();
    const auto status = registers_.status();
    std::copy(status.begin(), status.end(), mapping_->tab_input_registers);
    std::copy(status.begin(), status.end(),
              mapping_->tab_registers + robotiq::STATUS_REGISTER - robotiq::COMMAND_REGISTER);
    return true;
  }

  RobotiqSlave registers_;
  std::vector<int> functions_;
  modbus_t *modbus_;
  modbus_mapping_t *mapping_;
  int ends_[2] = {-1, -1};
};

class FeetechBus : public GripperServer::Slave {
public:
  FeetechBus(GripperMotion &motion, const GripperServer::Options &options)
      : servo_(motion, feetech_way({.model = options.model, .slave = options.slave})) {}

  double baud() const override { return feetech::BAUD; }

  bool take_frame(Bytes *came, Bytes *frame) override {
    std::size_t skipped = 0;
    const std::optional<feetech::Packet> packet = feetech::take_packet(came, &skipped);
    *frame = packet ? feetech::encoded(*packet) : Bytes();
    return packet.has_value();
  }

  Bytes answer(const Bytes &frame, bool refuse) override {
    Bytes bytes = frame;
    std::size_t skipped = 0;
    const std::optional<feetech::Packet> question = feetech::take_packet(&bytes, &skipped);
    std::optional<feetech::Packet> answer = servo_.answer(*question);
    if (!answer) {
      return {};
    }
    if (refuse) {
      answer->code |= feetech::OVERLOAD;
    }
    return feetech::encoded(*answer);
  }

  Bytes of_other_slave(Bytes answer) override {
    std::size_t skipped = 0;
    feetech::Packet packet = *feetech::take_packet(&answer, &skipped);
    packet.id++;
    return feetech::encoded(packet);
  }
  void lose_power() override { servo_.lose_power(); }
  void fail(std::uint8_t fault) override { servo_.fail(fault); }

private:
  FeetechSlave servo_;
};

} // namespace

GripperMechanics GripperServer::mechanics(const std::string &model) {
  GripperMechanics mechanics = gripper_mechanics(gripper_traits(model).model);
  if (mechanics.traits.driver == GripperDriver::feetech) {
    mechanics.traits.step_mm = 0.0;
  }
  return mechanics;
}

GripperServer::GripperServer(GripperMotion &motion, const Options &options)
    : motion_(motion), real_time_(options.real_time), port_(options.link), stepped_at_(host_now()) {
  switch (gripper_traits(options.model).driver) {
  case GripperDriver::robotiq:
    slave_ = std::make_unique<ModbusSlave>(motion, options);
    break;
  case GripperDriver::feetech:
    slave_ = std::make_unique<FeetechBus>(motion, options);
    break;
  }
}

GripperServer::~GripperServer() = default;

void GripperServer::trouble(const LineTrouble &trouble) { trouble_ = trouble; }

void GripperServer::power(bool on) {
  if (power_ != on) {
    slave_->lose_power();
  }
  power_ = on;
}

void GripperServer::fail(std::uint8_t fault) { slave_->fail(fault); }

void GripperServer::take() {
  Bytes frame;
  while (slave_->take_frame(&came_, &frame)) {
    if (!power_) {
      continue;
    }
    const bool has_fault = trouble_.answers != 0;
    const LineFault fault = has_fault ? trouble_.fault : LineFault::none;
    Bytes bytes = slave_->answer(frame, fault == LineFault::refused);
    if (bytes.empty()) {
      continue;
    }
    switch (fault) {
    case LineFault::silent:
      bytes.clear();
      break;
    case LineFault::garbage:
      for (std::size_t i = 0; i < bytes.size(); i++) {
        bytes[i] = static_cast<std::uint8_t>(17 + 91 * i);
      }
      break;
    case LineFault::damaged:
      bytes.back() ^= 0x10;
      break;
    case LineFault::other_slave:
      bytes = slave_->of_other_slave(bytes);
      break;
    default:
      break;
    }
    const auto seconds = [](double time_s) {
      return std::chrono::duration_cast<HostTime::duration>(std::chrono::duration<double>(time_s));
    };
    const std::size_t crossing = frame.size() + bytes.size();
    HostTime due = came_at_ + seconds(static_cast<double>(crossing) * BITS_PER_BYTE / slave_->baud());
    if (has_fault) {
      due += seconds(trouble_.late_s);
    }
    if (trouble_.latency_timer_s > 0) {
      const HostTime::duration tick = seconds(trouble_.latency_timer_s);
      due = HostTime((due.time_since_epoch() / tick + 1) * tick);
    }
    if (has_fault && trouble_.answers > 0) {
      trouble_.answers--;
    }
    if (!bytes.empty()) {
      answers_.push_back({due, bytes});
    }
  }
}

void GripperServer::send_due() {
  while (!answers_.empty() && answers_.front().due <= host_now()) {
    const Bytes bytes = answers_.front().bytes;
    answers_.pop_front();
    // A port that is not read fills up; what does not fit is lost, as on any line.
    port_.write(bytes.data(), bytes.size());
  }
}

void GripperServer::step(std::chrono::microseconds longest_wait) {
  HostTime until = host_now() + longest_wait;
  if (!answers_.empty()) {
    until = std::min(until, answers_.front().due);
  }
  port_.wait(until);
  const HostTime now = host_now();
  if (real_time_) {
    const double late_s = std::chrono::duration<double>(now - stepped_at_).count();
    double passed_s = std::min(late_s, std::chrono::duration<double>(longest_wait).count() + STALL_s);
    for (; passed_s > 0; passed_s -= LONGEST_STEP_s) {
      motion_.step(std::min(passed_s, LONGEST_STEP_s));
    }
  }
  stepped_at_ = now;
  if (!came_.empty() && now - came_at_ > FRAME_GAP) {
    came_.clear();
  }
  std::uint8_t bytes[512];
  if (const std::size_t count = port_.read(bytes, sizeof bytes)) {
    came_.insert(came_.end(), bytes, bytes + count);
    came_at_ = now;
    take();
  }
  send_due();
}

} // namespace fingertip
