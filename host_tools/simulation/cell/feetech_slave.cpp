#include "simulation/cell/feetech_slave.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip {

using namespace feetech;

namespace {

constexpr double STALL_A = 2.7;
constexpr int LOAD_SIGN = 1 << 10;

} // namespace

FeetechSlave::FeetechSlave(GripperMotion &motion, const GripperWay &complete)
    : motion_(motion), jaw_(complete), id_(static_cast<std::uint8_t>(complete.slave)) {
  lose_power();
}

int FeetechSlave::word(int address) const {
  const auto at = static_cast<std::size_t>(address);
  return memory_[at] | memory_[at + 1] << 8;
}

void FeetechSlave::put(int address, int value) {
  const auto at = static_cast<std::size_t>(address);
  memory_[at] = static_cast<std::uint8_t>(value & 0xFF);
  memory_[at + 1] = static_cast<std::uint8_t>(value >> 8);
}

void FeetechSlave::lose_power() {
  motion_.power_off();
  memory_ = {};
  waiting_.clear();
  trouble_ = 0;
  memory_[FIRMWARE] = 3;
  memory_[FIRMWARE + 1] = 10;
  put(MODEL, STS3215);
  memory_[ID] = id_;
  put(MOST_ANGLE, 4095);
  put(MOST_TORQUE, 1000);
  put(TORQUE_LIMIT, 1000);
  memory_[LOCK] = 1;
  refresh();
  put(GOAL_POSITION, word(PRESENT_POSITION));
}

void FeetechSlave::refresh() {
  put(PRESENT_POSITION, static_cast<int>(std::lround(jaw_.count(motion_.reported_width_mm()))));
  const double effort = motion_.effort();
  const bool down = (effort < 0) == (jaw_.open_count() > jaw_.closed_count());
  put(PRESENT_LOAD, static_cast<int>(std::lround(std::abs(effort) * 1000)) | (down && effort != 0 ? LOAD_SIGN : 0));
  memory_[PRESENT_VOLTAGE] = 74;
  memory_[PRESENT_TEMPERATURE] = 35;
  memory_[STATUS] = trouble_;
  memory_[MOVING] = motion_.moving() ? 1 : 0;
  put(PRESENT_CURRENT, static_cast<int>(std::lround(std::abs(effort) * STALL_A / AMPERE_PER_COUNT)));
}

void FeetechSlave::write(std::uint8_t address, const std::uint8_t *bytes, std::size_t count) {
  for (std::size_t i = 0; i < count; i++) {
    const std::size_t at = address + i;
    if (at > MODEL + 1 && at < PRESENT_POSITION) {
      memory_[at] = bytes[i];
    }
  }
  obey();
}

void FeetechSlave::obey() {
  if (memory_[TORQUE_ENABLE] == 0) {
    motion_.power_off();
    return;
  }
  if (!motion_.active()) {
    motion_.activate();
    trouble_ &= static_cast<std::uint8_t>(~OVERLOAD);
  }
  const GripperTraits &traits = motion_.mechanics().traits;
  const int goal = std::clamp(word(GOAL_POSITION), word(LEAST_ANGLE), word(MOST_ANGLE));
  const double width_mm = jaw_.width_mm(goal);
  const int speed = word(GOAL_SPEED);
  motion_.move({.width_mm = width_mm,
                .speed_mm_s = speed == 0 ? traits.speed_max_mm_s : speed * jaw_.slope_mm(width_mm),
                .force_N = std::min(word(TORQUE_LIMIT), word(MOST_TORQUE)) * traits.force_max_N / 1000});
}

Packet FeetechSlave::telling(std::uint8_t address, std::uint8_t length) {
  refresh();
  Packet answer = {.id = id_, .code = trouble_};
  for (std::size_t i = 0; i < length; i++) {
    answer.parameters.push_back(address + i < memory_.size() ? memory_[address + i] : 0);
  }
  return answer;
}

std::optional<Packet> FeetechSlave::answer(const Packet &question) {
  const Bytes &given = question.parameters;
  const bool all = question.id == BROADCAST;
  if (!all && question.id != id_) {
    return {};
  }
  const Packet done = {.id = id_, .code = trouble_};
  switch (question.code) {
  case PING:
    return done;
  case READ:
    if (given.size() == 2 && !all) {
      return telling(given[0], given[1]);
    }
    return {};
  case WRITE:
    if (given.size() >= 2) {
      write(given[0], given.data() + 1, given.size() - 1);
    }
    break;
  case REG_WRITE:
    waiting_ = given;
    break;
  case ACTION:
    if (waiting_.size() >= 2) {
      write(waiting_[0], waiting_.data() + 1, waiting_.size() - 1);
      waiting_.clear();
    }
    break;
  case SYNC_WRITE: // address, length, then of each servo its id and its bytes
    for (std::size_t at = 2; given.size() > 2 && at + given[1] < given.size(); at += given[1] + 1u) {
      if (given[at] == id_) {
        write(given[0], given.data() + at + 1, given[1]);
      }
    }
    return {};
  case SYNC_READ: // address, length, ids; each answers in turn, this one as the only servo
    if (given.size() > 2 && std::find(given.begin() + 2, given.end(), id_) != given.end()) {
      return telling(given[0], given[1]);
    }
    return {};
  default:
    return {};
  }
  return all ? std::nullopt : std::optional<Packet>(done);
}

} // namespace fingertip
