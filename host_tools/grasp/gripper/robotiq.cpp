#include "grasp/gripper/robotiq.hpp"

#include "grasp/gripper/common.hpp"
#include "grasp/gripper/robotiq_registers.hpp"
#include "libfingertip/clock.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <modbus.h>
#include <optional>
#include <unistd.h>
#include <utility>

namespace fingertip {

using namespace robotiq;

namespace {

constexpr std::uint32_t GAP_us = 20'000; // within an answer: more than a latency timer of 16 ms
// The manuals ask for 5 ms between commands.
constexpr std::chrono::milliseconds PAUSE{5};
constexpr std::uint8_t WRITE = 16, WRITE_AND_READ = 23; // functions
constexpr int RESET_READS = 10;
constexpr int BOTH_TRIES = 2;

constexpr GripperUsual USUAL = {
    .slave = SLAVE, .most_slave = 247, .closed_count = CLOSED_COUNT, .open_count = OPEN_COUNT, .most_count = 255};

Error gripper_error(const GripperWay &way, int error) {
  const std::string &port = way.port;
  switch (error) {
  case ETIMEDOUT:
    return silent(way);
  case EMBBADCRC:
    return Error(ErrorCode::gripper_garbled, port + ": an answer is damaged (CRC)");
  case EMBBADSLAVE:
    return Error(ErrorCode::gripper_garbled, port + ": another slave answers");
  case EMBBADDATA:
  case EMBMDATA:
  case EMBBADEXC:
    return Error(ErrorCode::gripper_garbled, port + ": an answer is not one to the question, or none of a gripper");
  case EIO:
  case EBADF:
  case ENXIO:
  case ENODEV:
  case ECONNRESET:
    return Error(ErrorCode::gone, port + ": gone");
  default:
    if (error > MODBUS_ENOBASE) {
      return Error(ErrorCode::gripper_refused, port + ": refused with Modbus exception " +
                                                   std::to_string(error - MODBUS_ENOBASE) + " (" +
                                                   modbus_strerror(error) + ")");
    }
    return Error(ErrorCode::gone, port + ": " + modbus_strerror(error));
  }
}

using Bytes = std::vector<std::uint8_t>;

void put_word(Bytes *to, int value) {
  to->push_back(static_cast<std::uint8_t>(value >> 8));
  to->push_back(static_cast<std::uint8_t>(value & 0xFF));
}

void put_range(Bytes *to, int address, int count) {
  put_word(to, address);
  put_word(to, count);
}

void put_values(Bytes *to, int count, const std::uint16_t *values) {
  to->push_back(static_cast<std::uint8_t>(2 * count));
  for (int i = 0; i < count; i++) {
    put_word(to, values[i]);
  }
}

// Length of the answer to a read: the count of bytes, and the registers.
std::size_t answer_length(int count) { return 1 + 2 * static_cast<std::size_t>(count); }

std::array<std::uint16_t, 3> registers_of(const Bytes &answer, int count) {
  std::array<std::uint16_t, 3> registers{};
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); i++) {
    registers[i] = static_cast<std::uint16_t>(answer[1 + 2 * i] << 8 | answer[2 + 2 * i]);
  }
  return registers;
}

constexpr int CRC = 2;

std::uint16_t share(double value, double least, double most) {
  const double clamped = std::clamp(value, least, most);
  return static_cast<std::uint16_t>(std::lround((clamped - least) / (most - least) * 255.0));
}

GripperWay robotiq_way(const GripperWay &given) {
  const GripperWay way = complete(given, USUAL);
  if (way.open_count > way.closed_count) {
    throw Error(ErrorCode::bad_value, "the count of a Robotiq gripper grows while it closes");
  }
  return way;
}

} // namespace

RobotiqGripper::RobotiqGripper(const GripperWay &given)
    : traits_(gripper_traits(given.model)), way_(robotiq_way(given)), line_(way_.port, BAUD),
      modbus_(modbus_new_rtu(way_.port.c_str(), BAUD, 'N', 8, 1)) {
  if (modbus_ == nullptr) {
    throw std::bad_alloc();
  }
  traits_.step_mm = traits_.stroke_mm / (*way_.closed_count - *way_.open_count);
  modbus_set_slave(modbus_, way_.slave);
  modbus_set_socket(modbus_, line_.descriptor());
  const auto timeout_us = static_cast<std::uint32_t>(way_.timeout_s * 1e6);
  modbus_set_response_timeout(modbus_, timeout_us / 1'000'000, timeout_us % 1'000'000);
  modbus_set_byte_timeout(modbus_, 0, GAP_us);
  try {
    std::optional<Error> garbled;
    for (const int function : {4, 3}) {
      read_function_ = function;
      try {
        meet();
        return;
      } catch (const Error &error) {
        if (error.code() == ErrorCode::gripper_garbled && !garbled) {
          garbled = error;
        }
        if (function == 3 || error.code() == ErrorCode::gone) {
          throw garbled && error.code() == ErrorCode::gripper_silent ? *garbled : error;
        }
      }
    }
  } catch (...) {
    modbus_free(modbus_);
    throw;
  }
}

// Some adapters hear themselves: the question comes back before the answer.
void RobotiqGripper::meet() {
  try {
    read_status();
  } catch (const Error &error) {
    if (error.code() != ErrorCode::gripper_garbled) {
      throw;
    }
    echoes_ = true;
    try {
      read_status();
    } catch (const Error &) {
      echoes_ = false;
      throw error;
    }
  }
}

void RobotiqGripper::drop_echo(std::size_t length, HostTime until) {
  for (std::uint8_t byte = 0; length > 0; length--) {
    pollfd coming = {line_.descriptor(), POLLIN, 0};
    while (wait_for(&coming, 1, until) == 0) {
      if (host_now() >= until) {
        throw gripper_error(way_, ETIMEDOUT);
      }
    }
    if (::read(line_.descriptor(), &byte, 1) != 1) {
      throw gripper_error(way_, EIO);
    }
  }
}

RobotiqGripper::~RobotiqGripper() {
  modbus_free(modbus_); // the descriptor is the line's
}

RobotiqGripper::Bytes RobotiqGripper::exchange(const Bytes &request, std::size_t length) {
  const HostTime until = ask(request);
  doubtful_ = true; // until it is answered: who answers late answers the next question
  sure_count_ = 0;
  Bytes answer = hear(request, length, until);
  doubtful_ = false;
  return answer;
}

// libmodbus makes and checks the frames. The wait for an answer is not its own: it would be one of
// real time.
HostTime RobotiqGripper::ask(const Bytes &request) {
  if (line_.descriptor() < 0) {
    throw gripper_error(way_, EIO);
  }
  line_.drop_input();
  began_us_ = steady_now_us();
  Bytes asked = {static_cast<std::uint8_t>(way_.slave)};
  asked.insert(asked.end(), request.begin(), request.end());
  if (modbus_send_raw_request(modbus_, asked.data(), static_cast<int>(asked.size())) < 0) {
    throw gripper_error(way_, errno);
  }
  const HostTime until = HostTime(std::chrono::microseconds(began_us_)) + timeout();
  drop_echo(echoes_ ? asked.size() + CRC : 0, until);
  return until;
}

RobotiqGripper::Bytes RobotiqGripper::hear(const Bytes &request, std::size_t length, HostTime until) {
  pollfd coming = {line_.descriptor(), POLLIN, 0};
  while (wait_for(&coming, 1, until) == 0) {
    if (host_now() >= until) {
      throw gripper_error(way_, ETIMEDOUT);
    }
  }
  Bytes answer(MODBUS_RTU_MAX_ADU_LENGTH);
  const int size = modbus_receive_confirmation(modbus_, answer.data());
  if (size < 0) {
    throw gripper_error(way_, errno);
  }
  constexpr int EXCEPTION = 0x80, HEAD = 2;
  if (size == 0 || answer[0] != way_.slave) {
    throw gripper_error(way_, EMBBADSLAVE);
  }
  if (answer[1] == (request[0] | EXCEPTION) && size == HEAD + 1 + CRC) {
    throw gripper_error(way_, MODBUS_ENOBASE + answer[2]);
  }
  if (answer[1] != request[0] || static_cast<std::size_t>(size) != HEAD + length + CRC) {
    throw gripper_error(way_, EMBBADDATA);
  }
  return {answer.begin() + HEAD, answer.begin() + size - CRC};
}

std::chrono::microseconds RobotiqGripper::timeout() const {
  return std::chrono::microseconds(static_cast<std::int64_t>(way_.timeout_s * 1e6));
}

// Answers have no number: a late one to a read of three registers would pass for that to the next.
// But they come in the order of the questions. So one or two registers are asked for, once, and
// answers before that one are not expected. Where it is lost the other number is
// asked for, lest the first come after all.
void RobotiqGripper::make_sure() {
  if (!doubtful_) {
    return;
  }
  if (sure_count_ == 0 || host_now() >= sure_until_) {
    sure_count_ = sure_count_ == 1 ? 2 : 1;
    sure_until_ = host_now() + SURE_TIMEOUTS * timeout();
    ask(read_request(sure_count_));
  }
  std::optional<Error> garbled;
  for (const HostTime until = host_now() + timeout(); doubtful_;) {
    try {
      hear(read_request(sure_count_), answer_length(sure_count_), until);
      doubtful_ = false;
    } catch (const Error &error) {
      if (error.code() == ErrorCode::gripper_garbled) {
        garbled = error;
      }
      if (error.code() != ErrorCode::gripper_garbled || host_now() >= until) {
        throw error.code() == ErrorCode::gripper_silent && garbled ? *garbled : error;
      }
    }
  }
}

RobotiqGripper::Bytes RobotiqGripper::read_request(int count) const {
  Bytes request = {static_cast<std::uint8_t>(read_function_)};
  put_range(&request, STATUS_REGISTER, count);
  return request;
}

RobotiqGripper::Registers RobotiqGripper::read(int count) {
  return registers_of(exchange(read_request(count), answer_length(count)), count);
}

GripperStatus RobotiqGripper::read_status() {
  make_sure();
  return status_of(read(REGISTERS));
}

GripperStatus RobotiqGripper::status_of(const Registers &registers) {
  const int gsta = registers[0] >> gSTA_SHIFT & 3, gobj = registers[0] >> gOBJ_SHIFT & 3;
  goes_ = (registers[0] & gGTO) != 0;
  active_ = (registers[0] & gACT) != 0 && gsta == ACTIVATED;
  GripperStatus status;
  status.host_us = (began_us_ + steady_now_us()) / 2;
  status.active = active_;
  status.moving = gsta == ACTIVATING || (active_ && goes_ && gobj == IN_MOTION);
  if (active_ && goes_ && gobj != IN_MOTION) {
    status.object = gobj != AT_REQUEST;
  }
  const int count = registers[2] >> 8;
  status.width_mm = std::clamp((*way_.closed_count - count) * traits_.step_mm, 0.0, traits_.stroke_mm);
  status.current_A = (registers[2] & 0xFF) * AMPERE_PER_COUNT;
  status.fault = static_cast<std::uint8_t>(registers[1] >> 8 & 0xF);
  // Whose answer it is proves that it is over.
  if (status.fault == NO_COMMUNICATION) {
    status.fault = NO_FAULT;
    status.was_left_alone = true;
  }
  return status;
}

void RobotiqGripper::write(int address, int count, const std::uint16_t *values) {
  Bytes request = {WRITE};
  put_range(&request, address, count);
  const Bytes range(request.begin() + 1, request.end());
  put_values(&request, count, values);
  if (exchange(request, range.size()) != range) {
    doubtful_ = true;
    throw gripper_error(way_, EMBBADDATA);
  }
}

void RobotiqGripper::activate() {
  make_sure();
  const Registers reset = {0, 0, 0}, set = {rACT, 0, 0};
  write(COMMAND_REGISTER, REGISTERS, reset.data());
  // Only a rise of rACT activates: it must have seen the reset.
  std::uint16_t status = gACT;
  for (int i = 0; i < RESET_READS && (status & gACT); i++) {
    wait_until(host_now() + PAUSE);
    status = read(1)[0];
  }
  if (status & gACT) {
    throw Error(ErrorCode::gripper_refused, line_.path() + ": does not reset");
  }
  write(COMMAND_REGISTER, REGISTERS, set.data());
  goes_ = active_ = false;
}

GripperStatus RobotiqGripper::poll() { return read_status(); }

GripperStatus RobotiqGripper::move(const GripperMove &move) {
  check_move(move);
  // At an end all that there is: its count differs from one gripper to the next.
  const int count = move.width_mm <= 0 ? 255
                    : move.width_mm >= traits_.stroke_mm
                        ? 0
                        : static_cast<int>(std::lround(*way_.closed_count - move.width_mm / traits_.step_mm));
  const Registers command = {
      rACT | rGTO, static_cast<std::uint16_t>(count),
      static_cast<std::uint16_t>(share(move.speed_mm_s, traits_.speed_min_mm_s, traits_.speed_max_mm_s) << 8 |
                                 share(move.force_N, traits_.force_min_N, traits_.force_max_N))};
  make_sure();
  if (!goes_) {
    const GripperStatus now = read_status();
    if (!active_) {
      return now;
    }
    if (!goes_) {
      write(COMMAND_REGISTER, REGISTERS, command.data());
      return read_status();
    }
  }
  if (both_at_once_) {
    try {
      Bytes request = {WRITE_AND_READ};
      put_range(&request, STATUS_REGISTER, REGISTERS);
      put_range(&request, COMMAND_REGISTER + 1, REGISTERS - 1);
      put_values(&request, REGISTERS - 1, command.data() + 1);
      const Registers registers = registers_of(exchange(request, answer_length(REGISTERS)), REGISTERS);
      both_worked_ = true;
      return status_of(registers);
    } catch (const Error &error) {
      const bool refused = error.code() == ErrorCode::gripper_refused;
      if (both_worked_ || !(refused || error.code() == ErrorCode::gripper_silent)) {
        throw;
      }
      both_failed_++;
    }
    make_sure(); // it is there, but does not answer this
    both_at_once_ = both_failed_ < BOTH_TRIES;
  }
  write(COMMAND_REGISTER + 1, REGISTERS - 1, command.data() + 1);
  return read_status();
}

std::string RobotiqGripper::line() const {
  std::string text = "Modbus RTU at " + std::to_string(BAUD) + " baud, slave " + std::to_string(way_.slave) +
                     ", function " + (both_at_once_ ? "23" : "16 and " + std::to_string(read_function_));
  return text + limited_by(line_.path(), both_at_once_ ? 1 : 2);
}

std::string RobotiqGripper::fault_text(std::uint8_t fault) const {
  static const std::pair<Fault, const char *> TEXTS[] = {
      {NO_FAULT, ""},
      {ACTION_DELAYED, "a move came before activation was complete"},
      {NOT_ACTIVATED, "a move came without activation"},
      {OVERHEATED, "too hot, it must cool down"},
      {NO_COMMUNICATION, "no command for a second"},
      {UNDERVOLTAGE, "its supply is too low; needs activation"},
      {RELEASING, "automatic release goes on"},
      {INTERNAL_FAULT, "internal fault; needs activation"},
      {ACTIVATION_FAULT, "activation failed, something was in its way; needs activation"},
      {OVERCURRENT, "too much current; needs activation"},
      {RELEASED, "automatic release is complete; needs activation"}};
  const auto *found = find_in(TEXTS, [&](const auto &one) { return one.first == fault; });
  return found ? found->second : "a fault that its manual does not have";
}

} // namespace fingertip
