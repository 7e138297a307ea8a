// A gripper without a line, for tests of what is above the seam: the ideal one, which fails where the test says so.
#pragma once

#include "libfingertip/clock.hpp"
#include "simulation/cell/gripper_motion.hpp"

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace test {

// What outlives a gripper that is closed and opened again.
class FakeGripperState {
public:
  std::atomic<bool> silent{false}, unplugged{false}, was_left_alone{false};
  std::atomic<int> fault{0}, activations{0}, opened{0}, exchanges{0}, delay_ms{0};

  fingertip::GripperStatus status() {
    std::lock_guard lock(mutex_);
    advance();
    return motion_.status();
  }
  double width_mm() { return status().width_mm; }
  void move(const fingertip::GripCommand &move) {
    std::lock_guard lock(mutex_);
    advance();
    moves_.push_back(move);
    motion_.move(move);
  }
  std::vector<fingertip::GripCommand> moves() {
    std::lock_guard lock(mutex_);
    return moves_;
  }

private:
  void advance() {
    const std::int64_t now_us = fingertip::steady_now_us();
    motion_.step(1e-6 * static_cast<double>(now_us - at_us_));
    at_us_ = now_us;
  }

  std::mutex mutex_;
  fingertip::GripperMotion motion_{fingertip::gripper_mechanics("ideal"), 50.0};
  std::int64_t at_us_ = fingertip::steady_now_us();
  std::vector<fingertip::GripCommand> moves_;
};

class FakeGripper : public fingertip::Gripper {
public:
  explicit FakeGripper(std::shared_ptr<FakeGripperState> state) : state_(std::move(state)) {
    check();
    state_->opened++;
  }
  const fingertip::GripperTraits &traits() const override {
    static const fingertip::GripperTraits own = fingertip::gripper_mechanics("ideal").traits;
    return own;
  }
  std::string line() const override { return "no line"; }
  void activate() override {
    check();
    state_->activations++;
  }
  fingertip::GripperStatus poll() override {
    check();
    fingertip::GripperStatus status = state_->status();
    status.host_us = fingertip::steady_now_us();
    status.fault = static_cast<std::uint8_t>(state_->fault.load());
    status.was_left_alone = state_->was_left_alone;
    return status;
  }
  fingertip::GripperStatus move(const fingertip::GripCommand &move) override {
    check();
    state_->move(move);
    return poll();
  }
  std::string fault_text(std::uint8_t fault) const override { return "text of " + std::to_string(fault); }

private:
  void check() const {
    state_->exchanges++;
    fingertip::wait_until(fingertip::host_now() + std::chrono::milliseconds(state_->delay_ms));
    if (state_->unplugged) {
      throw fingertip::Error(fingertip::ErrorCode::gone, "fake: vanished");
    }
    if (state_->silent) {
      throw fingertip::Error(fingertip::ErrorCode::gripper_silent, "fake: no answer");
    }
  }

  std::shared_ptr<FakeGripperState> state_;
};

} // namespace test
