// A gripper without a line, for tests of what stands above the seam: it moves at the speed it is
// told, in the time that passes, and fails where the test says so.
#pragma once

#include "grasp/gripper/gripper.hpp"
#include "libfingertip/clock.hpp"

#include <algorithm>
#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace test {

// What outlives a gripper that is closed and opened again.
class FakeGripperState {
public:
  std::atomic<bool> silent{false}, active{true}, unplugged{false}, was_left_alone{false};
  std::atomic<int> fault{0}, activations{0}, opened{0}, exchanges{0}, delay_ms{0};

  double width_mm() {
    std::lock_guard lock(mutex_);
    advance();
    return width_mm_;
  }
  bool moving() {
    std::lock_guard lock(mutex_);
    advance();
    return width_mm_ != target_mm_;
  }
  void move(const fingertip::GripperMove &move) {
    std::lock_guard lock(mutex_);
    advance();
    moves_.push_back(move);
    target_mm_ = move.width_mm;
    speed_mm_s_ = move.speed_mm_s;
  }
  std::vector<fingertip::GripperMove> moves() {
    std::lock_guard lock(mutex_);
    return moves_;
  }

private:
  void advance() {
    const std::int64_t now_us = fingertip::steady_now_us();
    const double way_mm = speed_mm_s_ * static_cast<double>(now_us - at_us_) / 1e6;
    width_mm_ += std::clamp(target_mm_ - width_mm_, -way_mm, way_mm);
    at_us_ = now_us;
  }

  std::mutex mutex_;
  double width_mm_ = 50.0, target_mm_ = 50.0, speed_mm_s_ = 0.0;
  std::int64_t at_us_ = fingertip::steady_now_us();
  std::vector<fingertip::GripperMove> moves_;
};

class FakeGripper : public fingertip::Gripper {
public:
  explicit FakeGripper(std::shared_ptr<FakeGripperState> state) : state_(std::move(state)) {
    check();
    state_->opened++;
  }
  const fingertip::GripperTraits &traits() const override {
    static const fingertip::GripperTraits own = {{50.0, 0.05, 0.0, 1.0, 100.0, 0.0, 0.0, 0.01, 0.002}, "fake"};
    return own;
  }
  std::string line() const override { return "no line"; }
  void activate() override {
    check();
    state_->activations++;
    state_->active = true;
  }
  fingertip::GripperStatus poll() override {
    check();
    fingertip::GripperStatus status;
    status.host_us = fingertip::steady_now_us();
    status.active = state_->active;
    status.width_mm = state_->width_mm();
    status.moving = state_->moving();
    status.fault = static_cast<std::uint8_t>(state_->fault.load());
    status.was_left_alone = state_->was_left_alone;
    return status;
  }
  fingertip::GripperStatus move(const fingertip::GripperMove &move) override {
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
