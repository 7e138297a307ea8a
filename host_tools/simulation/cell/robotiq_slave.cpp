#include "simulation/cell/robotiq_slave.hpp"

#include <cmath>
#include <cstdlib>

namespace fingertip {

using namespace robotiq;

namespace {

constexpr double FULL_CURRENT_A = 1.0;

} // namespace

RobotiqSlave::RobotiqSlave(GripperMotion &motion) : motion_(motion) {}

void RobotiqSlave::heard() {
  silence_ = silence_ || motion_.time_s() - heard_s_ >= SILENCE_s;
  heard_s_ = motion_.time_s();
}

void RobotiqSlave::write(int address, std::uint16_t value) {
  command_.at(static_cast<std::size_t>(address - COMMAND_REGISTER)) = value;
}

GripperMove RobotiqSlave::wanted() const {
  const GripperTraits &traits = motion_.mechanics().traits;
  const auto scaled = [](int value, double least, double most) { return least + (most - least) * value / 255.0; };
  if (has(rATR)) {
    return {.width_mm = has(rARD) ? traits.stroke_mm : 0.0,
            .speed_mm_s = traits.speed_min_mm_s,
            .force_N = traits.force_max_N};
  }
  const double step_mm = traits.stroke_mm / (CLOSED_COUNT - OPEN_COUNT);
  return {.width_mm = (CLOSED_COUNT - (command_[1] & 0xFF)) * step_mm,
          .speed_mm_s = scaled(command_[2] >> 8, traits.speed_min_mm_s, traits.speed_max_mm_s),
          .force_N = scaled(command_[2] & 0xFF, traits.force_min_N, traits.force_max_N)};
}

void RobotiqSlave::update() {
  const bool was_active = (done_[0] & rACT) != 0, went = (done_[0] & (rGTO | rATR)) != 0;
  if (!has(rACT)) {
    motion_.power_off();
  } else if (!was_active) {
    failed_ = NO_FAULT;
    released_ = false;
    motion_.activate();
  }
  if (has(rACT) && motion_.active() && failed_ == NO_FAULT && !released_) {
    const bool goes = has(rGTO) || has(rATR);
    if (goes && (!went || command_ != done_)) {
      motion_.move(wanted());
    } else if (!goes && went) {
      motion_.stop();
    }
    released_ = has(rATR);
    done_ = command_;
  } else {
    // What moves is done once activation is complete.
    done_[0] = has(rACT) ? rACT : 0;
  }
}

std::uint8_t RobotiqSlave::fault() const {
  if (failed_ != NO_FAULT) {
    return failed_;
  }
  if (released_) {
    return motion_.moving() ? RELEASING : RELEASED;
  }
  if (has(rGTO) && !has(rACT)) {
    return NOT_ACTIVATED;
  }
  if (has(rGTO) && motion_.activating()) {
    return ACTION_DELAYED;
  }
  return silence_ ? NO_COMMUNICATION : NO_FAULT;
}

std::array<std::uint16_t, REGISTERS> RobotiqSlave::status() const {
  const GripperTraits &traits = motion_.mechanics().traits;
  const bool goes = has(rGTO) && motion_.active() && failed_ == NO_FAULT && !released_;
  const int gsta = !has(rACT) || failed_ != NO_FAULT || released_ ? RESET : motion_.active() ? ACTIVATED : ACTIVATING;
  const int gobj = !goes || motion_.moving() ? IN_MOTION
                   : motion_.blocked() > 0   ? STOPPED_OPENING
                   : motion_.blocked() < 0   ? STOPPED_CLOSING
                                             : AT_REQUEST;
  const long count =
      CLOSED_COUNT - std::lround(motion_.reported_width_mm() / traits.stroke_mm * (CLOSED_COUNT - OPEN_COUNT));
  const long current = std::lround(std::abs(motion_.effort()) * FULL_CURRENT_A / AMPERE_PER_COUNT);
  return {
      static_cast<std::uint16_t>((has(rACT) ? gACT : 0) | (goes ? gGTO : 0) | gsta << gSTA_SHIFT | gobj << gOBJ_SHIFT),
      static_cast<std::uint16_t>(fault() << 8 | (command_[1] & 0xFF)),
      static_cast<std::uint16_t>(count << 8 | current)};
}

void RobotiqSlave::answered() { silence_ = false; }

void RobotiqSlave::lose_power() {
  command_ = done_ = {};
  silence_ = released_ = false;
  failed_ = NO_FAULT;
  heard_s_ = motion_.time_s();
  motion_.power_off();
}

} // namespace fingertip
