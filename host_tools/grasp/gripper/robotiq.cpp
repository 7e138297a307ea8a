#include "grasp/gripper/robotiq.hpp"

#include "libfingertip/text.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace fingertip {

namespace robotiq {

std::uint16_t crc_of(const Bytes &bytes) {
  std::uint16_t crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; bit++) {
      crc = static_cast<std::uint16_t>(crc & 1 ? crc >> 1 ^ 0xA001 : crc >> 1);
    }
  }
  return crc;
}

Bytes with_crc(Bytes bytes) {
  const std::uint16_t crc = crc_of(bytes);
  bytes.push_back(static_cast<std::uint8_t>(crc & 0xFF));
  bytes.push_back(static_cast<std::uint8_t>(crc >> 8));
  return bytes;
}

} // namespace robotiq

using namespace robotiq;

// The manuals ask for 5 ms between commands.
constexpr std::chrono::milliseconds PAUSE{5};
constexpr int RESET_READS = 10;
constexpr int BOTH_TRIES = 2;
constexpr std::size_t HEAD = 2, CRC = 2; // slave and function

constexpr GripperUsual USUAL = {
    .slave = SLAVE, .most_slave = 247, .closed_count = CLOSED_COUNT, .open_count = OPEN_COUNT, .most_count = 255};

static void put_words(Bytes *to, std::initializer_list<int> words) {
  for (const int word : words) {
    to->insert(to->end(), {static_cast<std::uint8_t>(word >> 8), static_cast<std::uint8_t>(word & 0xFF)});
  }
}

// How many bytes, and those of the registers from this one on.
static void put_values(Bytes *to, const std::array<std::uint16_t, REGISTERS> &values, int from) {
  to->push_back(static_cast<std::uint8_t>(2 * (REGISTERS - from)));
  std::for_each(values.begin() + from, values.end(), [&](int value) { put_words(to, {value}); });
}

// Length of the answer to a read: the count of bytes, and the registers.
static std::size_t answer_length(int count) { return 1 + 2 * static_cast<std::size_t>(count); }

static int share(double value, double least, double most) {
  return static_cast<int>(std::lround((std::clamp(value, least, most) - least) / (most - least) * 255.0));
}

GripperWay robotiq::complete_way(const GripperWay &given) {
  const GripperWay way = complete(given, USUAL);
  if (way.open_count > way.closed_count) {
    throw Error(ErrorCode::bad_value, "the count of a Robotiq gripper grows while it closes");
  }
  return way;
}

double robotiq::step_mm(const GripperWay &complete, const GripperTraits &traits) {
  return traits.stroke_mm / (*complete.closed_count - *complete.open_count);
}

Request robotiq::request_of(const GripCommand &move, const GripperWay &complete, const GripperTraits &traits) {
  check_move(move);
  // At an end all that there is: its count differs from one gripper to the next.
  const int count = move.width_mm <= 0 ? 255
                    : move.width_mm >= traits.stroke_mm
                        ? 0
                        : static_cast<int>(std::lround(*complete.closed_count - move.width_mm / traits.step_mm));
  return {count, share(move.speed_mm_s, traits.speed_min_mm_s, traits.speed_max_mm_s),
          share(move.force_N, traits.force_min_N, traits.force_max_N)};
}

GripperStatus robotiq::status_of(const Answer &answer, std::int64_t asked_us, const GripperWay &complete, const GripperTraits &traits) {
  GripperStatus status;
  status.host_us = (asked_us + steady_now_us()) / 2;
  status.active = answer.active;
  status.moving = answer.gsta == ACTIVATING || (answer.active && answer.goes && answer.gobj == IN_MOTION);
  if (answer.active && answer.goes && answer.gobj != IN_MOTION) {
    status.object = answer.gobj != AT_REQUEST;
  }
  status.width_mm = std::clamp((*complete.closed_count - answer.gpo) * traits.step_mm, 0.0, traits.stroke_mm);
  status.fault = static_cast<std::uint8_t>(answer.gflt & 0xF);
  // Whose answer it is proves that it is over.
  if (status.fault == NO_COMMUNICATION) {
    status.fault = NO_FAULT;
    status.was_left_alone = true;
  }
  return status;
}

RobotiqGripper::RobotiqGripper(const GripperWay &given) : RequestLine(complete_way(given), BAUD, gripper_traits(given.model)) {
  traits_.step_mm = step_mm(way_, traits_);
  std::optional<Error> garbled;
  for (const int function : {4, 3}) {
    read_function_ = function;
    try {
      poll();
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
}

RequestLine::Reply RobotiqGripper::take(const Bytes &question, std::size_t length, Bytes *came, std::size_t *noise, Bytes *payload) {
  for (; came->size() > HEAD; came->erase(came->begin()), ++*noise) {
    const std::uint8_t function = (*came)[1];
    const bool known = function == 3 || function == 4 || function == WRITE_AND_READ;
    const std::size_t size = known ? HEAD + 1 + (*came)[HEAD] + CRC : function == WRITE ? 8 : 5;
    if (!known && function != WRITE && (function & EXCEPTION) == 0) {
      continue;
    }
    if (came->size() < size) {
      break;
    }
    const Bytes frame(came->begin(), came->begin() + static_cast<std::ptrdiff_t>(size));
    if (crc_of(frame) != 0) {
      continue;
    }
    came->erase(came->begin(), came->begin() + static_cast<std::ptrdiff_t>(size));
    if (frame[0] != question[0]) {
      return Reply::other_slave;
    }
    if (function == (question[1] | EXCEPTION)) {
      throw Error(ErrorCode::gripper_refused, way_.port + ": refused with Modbus exception " + std::to_string(frame[HEAD]));
    }
    if (function != question[1] || size != HEAD + length + CRC) {
      return Reply::other_answer;
    }
    payload->assign(frame.begin() + HEAD, frame.end() - CRC);
    return Reply::matches;
  }
  return Reply::none;
}

// One or two registers, where a status has three.
std::pair<RequestLine::Bytes, std::size_t> RobotiqGripper::probe(int number) const {
  return {read_question(number), answer_length(number)};
}

RequestLine::Bytes RobotiqGripper::question_of(int function, const Bytes &rest) const {
  Bytes question = {static_cast<std::uint8_t>(way_.slave), static_cast<std::uint8_t>(function)};
  question.insert(question.end(), rest.begin(), rest.end());
  return with_crc(question);
}

RequestLine::Bytes RobotiqGripper::read_question(int count) const {
  Bytes rest;
  put_words(&rest, {STATUS_REGISTER, count});
  return question_of(read_function_, rest);
}

RobotiqGripper::Registers RobotiqGripper::registers_of(const Bytes &question, int count) {
  const Bytes answer = exchange(question, answer_length(count));
  Registers registers{};
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); i++) {
    registers[i] = static_cast<std::uint16_t>(answer[1 + 2 * i] << 8 | answer[2 + 2 * i]);
  }
  return registers;
}

GripperStatus RobotiqGripper::status_of(const Registers &registers) {
  const int gsta = registers[0] >> gSTA_SHIFT & 3, gobj = registers[0] >> gOBJ_SHIFT & 3;
  goes_ = (registers[0] & gGTO) != 0;
  active_ = (registers[0] & gACT) != 0 && gsta == ACTIVATED;
  GripperStatus status = robotiq::status_of({active_, goes_, gsta, gobj, registers[2] >> 8, registers[1] >> 8}, asked_us_, way_, traits_);
  status.current_A = (registers[2] & 0xFF) * AMPERE_PER_COUNT;
  return status;
}

void RobotiqGripper::write(const Registers &command, int from) {
  Bytes rest;
  put_words(&rest, {COMMAND_REGISTER + from, REGISTERS - from});
  const Bytes range = rest;
  put_values(&rest, command, from);
  if (exchange(question_of(WRITE, rest), range.size()) != range) {
    doubt();
    throw Error(ErrorCode::gripper_garbled, way_.port + ": an answer is not one to the question");
  }
}

void RobotiqGripper::activate() {
  write({});
  // Only a rise of rACT activates: it must have seen the reset.
  std::uint16_t status = gACT;
  for (int i = 0; i < RESET_READS && (status & gACT); i++) {
    wait_until(host_now() + PAUSE);
    status = registers_of(read_question(1), 1)[0];
  }
  if (status & gACT) {
    throw Error(ErrorCode::gripper_refused, way_.port + ": does not reset");
  }
  write({rACT});
  goes_ = active_ = false;
}

GripperStatus RobotiqGripper::move(const GripCommand &move) {
  const Request request = request_of(move, way_, traits_);
  const Registers command = {rACT | rGTO, static_cast<std::uint16_t>(request.position),
                             static_cast<std::uint16_t>(request.speed << 8 | request.force)};
  if (!goes_) {
    const GripperStatus now = poll();
    if (!active_) {
      return now;
    }
    if (!goes_) {
      write(command);
      return poll();
    }
  }
  if (both_at_once_) {
    try {
      Bytes rest;
      put_words(&rest, {STATUS_REGISTER, REGISTERS, COMMAND_REGISTER + 1, REGISTERS - 1});
      put_values(&rest, command, 1);
      const Registers registers = registers_of(question_of(WRITE_AND_READ, rest), REGISTERS);
      both_worked_ = true;
      return status_of(registers);
    } catch (const Error &error) {
      const bool refused = error.code() == ErrorCode::gripper_refused;
      if (both_worked_ || !(refused || error.code() == ErrorCode::gripper_silent)) {
        throw;
      }
      both_failed_++;
    }
    resynchronise(); // it is there, but does not answer this
    both_at_once_ = both_failed_ < BOTH_TRIES;
  }
  write(command, 1);
  return poll();
}

std::string RobotiqGripper::line() const {
  return "Modbus RTU at " + std::to_string(BAUD) + " baud, slave " + std::to_string(way_.slave) + ", function " +
         (both_at_once_ ? "23" : "16 and " + std::to_string(read_function_)) + limited_by(both_at_once_ ? 1 : 2);
}

std::string robotiq::fault_text(std::uint8_t fault) {
  static const std::pair<std::uint8_t, const char *> TEXTS[] = {{NO_FAULT, ""},
                                                                {ACTION_DELAYED, "a move came before activation was complete"},
                                                                {NOT_ACTIVATED, "a move came without activation"},
                                                                {8, "too hot, it must cool down"},
                                                                {NO_COMMUNICATION, "no command for a second"},
                                                                {10, "its supply is too low; needs activation"},
                                                                {11, "automatic release goes on"},
                                                                {12, "internal fault; needs activation"},
                                                                {13, "activation failed, something was in its way; needs activation"},
                                                                {OVERCURRENT, "too much current; needs activation"},
                                                                {15, "automatic release is complete; needs activation"}};
  const auto *found = find_in(TEXTS, [&](const auto &one) { return one.first == fault; });
  return found ? found->second : "a fault that its manual does not have";
}

} // namespace fingertip
