#include "simulation/cell/gripper_server.hpp"

#include <algorithm>

namespace fingertip {

using Bytes = std::vector<std::uint8_t>;

constexpr std::chrono::milliseconds FRAME_GAP{20}; // what is no whole frame by then is none
constexpr double BITS_PER_BYTE = 10;
// While a machine stalls for longer, the gripper's time stops: no command could have reached it.
constexpr double STALL_s = 0.1;
constexpr double LONGEST_STEP_s = 0.01; // of the motion

const std::vector<std::pair<std::string, LineFault>> &line_faults() {
  static const std::vector<std::pair<std::string, LineFault>> all = {
      {"none", LineFault::none},       {"silent", LineFault::silent},           {"garbage", LineFault::garbage},
      {"damaged", LineFault::damaged}, {"other_slave", LineFault::other_slave}, {"refused", LineFault::refused}};
  return all;
}

GripperMechanics GripperServer::mechanics(const std::string &model) {
  GripperMechanics mechanics = gripper_mechanics(gripper_traits(model).model);
  if (mechanics.traits.driver == GripperDriver::feetech) {
    mechanics.traits.step_mm = 0.0;
  }
  return mechanics;
}

GripperServer::GripperServer(GripperMotion &motion, const Options &options)
    : motion_(motion), real_time_(options.real_time),
      slave_(gripper_traits(options.model).driver == GripperDriver::robotiq ? robotiq_slave(motion, options)
                                                                            : feetech_slave(motion, options)),
      port_(options.link), stepped_at_(host_now()) {}

void GripperServer::power(bool on) {
  if (power_ != on) {
    slave_->lose_power();
  }
  power_ = on;
}

void GripperServer::take() {
  const auto seconds = [](double time_s) { return std::chrono::duration_cast<HostTime::duration>(std::chrono::duration<double>(time_s)); };
  for (Bytes frame; slave_->take_frame(&came_, &frame);) {
    const bool has_fault = trouble_.answers != 0;
    const LineFault fault = has_fault ? trouble_.fault : LineFault::none;
    Bytes bytes = power_ ? slave_->answer(frame, fault == LineFault::refused) : Bytes();
    if (bytes.empty()) {
      continue;
    }
    switch (fault) {
    case LineFault::silent: bytes.clear(); break;
    case LineFault::garbage:
      for (std::size_t i = 0; i < bytes.size(); i++) {
        bytes[i] = static_cast<std::uint8_t>(17 + 91 * i);
      }
      break;
    case LineFault::damaged: bytes.back() ^= 0x10; break;
    case LineFault::other_slave: bytes = slave_->of_other_slave(bytes); break;
    default: break;
    }
    const std::size_t crossing = frame.size() + bytes.size();
    HostTime due = came_at_ + seconds(static_cast<double>(crossing) * BITS_PER_BYTE / slave_->baud());
    due += seconds(has_fault ? trouble_.late_s : 0.0);
    if (trouble_.latency_timer_s > 0) {
      const HostTime::duration tick = seconds(trouble_.latency_timer_s);
      due = HostTime((due.time_since_epoch() / tick + 1) * tick);
    }
    trouble_.answers -= trouble_.answers > 0;
    if (!bytes.empty()) {
      answers_.push_back({due, bytes});
    }
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
    using Seconds = std::chrono::duration<double>;
    double passed_s = std::min(Seconds(now - stepped_at_).count(), Seconds(longest_wait).count() + STALL_s);
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
  for (; !answers_.empty() && answers_.front().due <= host_now(); answers_.pop_front()) {
    // A port that is not read fills up; what does not fit is lost, as on any line.
    port_.write(answers_.front().bytes.data(), answers_.front().bytes.size());
  }
}

} // namespace fingertip
