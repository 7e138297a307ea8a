#include "grasp/gripper_thread.hpp"

#include "libfingertip/session.hpp"

#include <algorithm>
#include <chrono>

namespace fingertip {

// No gripper answers sooner; and a line that fails at once is not asked without pause.
constexpr std::int64_t SHORTEST_us = 1000;
// A port that is gone is tried so often.
constexpr std::int64_t REOPEN_us = 200000;
// Answers that are not taken: some seconds of them.
constexpr std::size_t MOST_NEWS = 2000;

static bool is_same(const GripCommand &a, const GripCommand &b) {
  return a.motion == b.motion &&
         (a.motion != GRIP_MOVE || (a.width_mm == b.width_mm && a.speed_mm_s == b.speed_mm_s && a.force_N == b.force_N));
}

static std::string trouble_of(const Gripper &gripper, const GripperStatus &status) {
  if (status.fault != 0) {
    return "fault " + std::to_string(status.fault) + ", " + gripper.fault_text(status.fault);
  }
  return status.was_left_alone ? "no command for a second" : "";
}

GripperThread::GripperThread(std::unique_ptr<Gripper> gripper, OpenGripper reopen)
    : gripper_(std::move(gripper)), reopen_(std::move(reopen)),
      poll_us_(std::max(SHORTEST_us, static_cast<std::int64_t>(1e6 * gripper_->traits().poll_s))), thread_([this] { run(); }) {}

GripperThread::~GripperThread() {
  {
    std::lock_guard lock(mutex_);
    end_ = true;
  }
  ended_.set();
  thread_.join();
}

void GripperThread::command(const GripCommand &command) {
  std::lock_guard lock(mutex_);
  if (!is_same(command, command_)) {
    command_ = command;
    number_++;
  }
}

void GripperThread::put(News news) {
  std::lock_guard lock(mutex_);
  if (news_.size() == MOST_NEWS) {
    news_.pop_front();
  }
  news_.push_back(std::move(news));
}

GripperStatus GripperThread::exchange() {
  std::unique_lock lock(mutex_);
  const GripCommand command = command_;
  const std::uint64_t number = number_;
  const bool is_new = number_ != sent_;
  lock.unlock();
  if (is_new && command.motion == GRIP_ACTIVATE) {
    gripper_->activate();
  }
  const GripperStatus status = is_new && command.motion == GRIP_MOVE ? gripper_->move(command) : gripper_->poll();
  lock.lock();
  sent_ = number;
  return status;
}

void GripperThread::run() {
  for (bool end = false; !end;) {
    std::int64_t next_us = steady_now_us() + poll_us_;
    try {
      if (!gripper_) {
        gripper_ = reopen_();
      }
      const GripperStatus status = exchange();
      put({status, trouble_of(*gripper_, status)});
      reported_.clear();
    } catch (const Error &error) {
      if (reported_ != error.what()) {
        reported_ = error.what();
        put({std::nullopt, reported_});
      }
      if (error.code() == ErrorCode::gone) {
        gripper_.reset();
      }
      if (!gripper_) {
        next_us = steady_now_us() + REOPEN_us;
      }
    }
    ended_.wait(HostTime(std::chrono::microseconds(next_us)));
    std::lock_guard lock(mutex_);
    end = end_;
  }
}

} // namespace fingertip
