#include "support/gripper_lines.hpp"

#include "gripper/robotiq_registers.hpp"
#include "gripper/serial_line.hpp"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <fcntl.h>
#include <modbus.h>
#include <poll.h>
#include <stdexcept>
#include <termios.h>
#include <unistd.h>

namespace fingertip {

namespace {

using Bytes = std::vector<std::uint8_t>;

std::string digits(const Bytes &bytes) {
  std::string text;
  char two[4];
  for (std::uint8_t byte : bytes) {
    std::snprintf(two, sizeof two, "%02X", byte);
    text += (text.empty() ? "" : " ") + std::string(two);
  }
  return text;
}

Bytes bytes_of(const std::string &text) {
  Bytes bytes;
  for (std::size_t at = 0; at + 1 < text.size(); at += 3) {
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(text.substr(at, 2), nullptr, 16)));
  }
  return bytes;
}

/* Raw, and open as long as its master is. */
std::string open_pair(int *master, int *held_open) {
  char name[64];
  termios settings;
  *master = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  if (*master < 0 || grantpt(*master) != 0 || unlockpt(*master) != 0 ||
      ptsname_r(*master, name, sizeof name) != 0 ||
      (*held_open = open(name, O_RDWR | O_NOCTTY | O_CLOEXEC)) < 0 ||
      tcgetattr(*held_open, &settings) != 0) {
    throw std::runtime_error("no pseudo-terminal");
  }
  cfmakeraw(&settings);
  tcsetattr(*held_open, TCSANOW, &settings);
  return name;
}

bool comes(int fd, int milliseconds) {
  pollfd waiting = {fd, POLLIN, 0};
  return poll(&waiting, 1, milliseconds) > 0;
}

} // namespace

Served::Served(const GripperServer::Options &options)
    : motion_(GripperServer::mechanics(options.model)), server_(motion_, options), thread_([this] {
        while (!stop_) {
          { std::lock_guard<std::mutex> turn(turn_); }
          std::lock_guard<std::mutex> lock(mutex_);
          server_.step(std::chrono::microseconds(200));
        }
      }) {}

Served::~Served() {
  stop_ = true;
  thread_.join();
}

void Served::pass(double seconds) {
  with([&](GripperServer &, GripperMotion &motion) {
    const double end_s = motion.time_s() + seconds;
    while (motion.time_s() < end_s) {
      motion.step(0.001);
    }
  });
}

Tape::Tape(std::vector<std::pair<std::string, std::string>> exchanges)
    : exchanges_(std::move(exchanges)), port_(open_pair(&master_, &held_open_)),
      thread_([this] { play(); }) {}

Tape::~Tape() {
  stop_ = true;
  thread_.join();
  close(held_open_);
  close(master_);
}

void Tape::play() {
  for (const auto &[question, answer] : exchanges_) {
    const std::size_t length = bytes_of(question).size();
    Bytes came;
    while (came.size() < length) {
      if (stop_) {
        return;
      }
      if (comes(master_, 10)) {
        Bytes some(length - came.size());
        const ssize_t count = read(master_, some.data(), some.size());
        came.insert(came.end(), some.begin(), some.begin() + std::max<ssize_t>(count, 0));
      }
    }
    if (digits(came) != question) {
      complaint_ = "instead of " + question + " came " + digits(came);
      return;
    }
    const Bytes bytes = bytes_of(answer);
    if (!bytes.empty() && write(master_, bytes.data(), bytes.size()) < 0) {
      return;
    }
    played_++;
  }
}

std::string Tape::complaint() {
  stop_ = true;
  thread_.join();
  thread_ = std::thread([] {});
  if (complaint_.empty() && played_ != exchanges_.size()) {
    complaint_ = "never came " + exchanges_[played_].first;
  }
  if (complaint_.empty() && comes(master_, 0)) {
    complaint_ = "more came";
  }
  return complaint_;
}

std::string with_crc(const std::string &bytes) {
  /* Modbus over serial line, specification and implementation guide V1.02, appendix B. */
  unsigned crc = 0xFFFF;
  Bytes all = bytes_of(bytes);
  for (std::uint8_t byte : all) {
    crc ^= byte;
    for (int bit = 0; bit < 8; bit++) {
      const unsigned out = crc & 1;
      crc = (crc >> 1) ^ (out ? 0xA001u : 0u);
    }
  }
  all.push_back(static_cast<std::uint8_t>(crc & 0xFF));
  all.push_back(static_cast<std::uint8_t>(crc >> 8));
  return digits(all);
}

std::string asked(const std::string &port, const std::string &question, std::size_t answer_length) {
  SerialLine line(port, 115200);
  const Bytes sent = bytes_of(question);
  line.transport().write(sent.data(), sent.size());
  Bytes came;
  while (came.size() < answer_length) {
    std::uint8_t bytes[64];
    std::size_t length = 0;
    if (line.transport().read(bytes, sizeof bytes, &length, std::chrono::milliseconds(2000)) !=
        Transport::Result::data) {
      break;
    }
    came.insert(came.end(), bytes, bytes + length);
  }
  return digits(came);
}

struct PlainSlave::Mapped {
  modbus_t *modbus = modbus_new_rtu("/dev/null", 115200, 'N', 8, 1);
  modbus_mapping_t *mapping = modbus_mapping_new_start_address(
      0, 0, 0, 0, robotiq::COMMAND_REGISTER, 1003, robotiq::STATUS_REGISTER, 3);
  ~Mapped() {
    modbus_mapping_free(mapping);
    modbus_free(modbus);
  }
  void put(std::uint16_t status) {
    for (std::uint16_t *registers : {mapping->tab_input_registers, mapping->tab_registers + 1000}) {
      registers[0] = status;
      registers[2] = 100 << 8 | 42;
    }
  }
};

PlainSlave::PlainSlave()
    : port_(open_pair(&master_, &held_open_)), mapped_(std::make_unique<Mapped>()) {
  modbus_set_slave(mapped_->modbus, 9);
  modbus_set_socket(mapped_->modbus, master_);
  mapped_->put(0xF900);
  thread_ = std::thread([this] {
    while (!stop_) {
      if (!comes(master_, 10)) {
        continue;
      }
      std::uint8_t query[MODBUS_RTU_MAX_ADU_LENGTH];
      const int length = modbus_receive(mapped_->modbus, query);
      std::lock_guard<std::mutex> lock(mutex_);
      if (length > 0) {
        modbus_reply(mapped_->modbus, query, length, mapped_->mapping);
        if (query[1] == 16) {
          mapped_->put((mapped_->mapping->tab_registers[0] & 0x100) ? 0x1100 : 0);
        }
      }
    }
  });
}

PlainSlave::~PlainSlave() {
  stop_ = true;
  thread_.join();
  close(held_open_);
  close(master_);
}

std::array<int, 3> PlainSlave::command() {
  std::lock_guard<std::mutex> lock(mutex_);
  const std::uint16_t *registers = mapped_->mapping->tab_registers;
  return {registers[0], registers[1], registers[2]};
}

} // namespace fingertip
