// A gripper in a thread of its own, so that a slow or silent line delays nothing else. The newest command goes out with the next exchange,
// and every answer comes back. The thread repeats an exchange that fails, with the newest command. It opens a port that vanished again. It
// activates nothing without a command, and sends nothing that the core did not command.
#pragma once

#include "grasp/control/grip.hpp"
#include "grasp/gripper/gripper.hpp"
#include "libfingertip/clock.hpp"

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

namespace fingertip {

using OpenGripper = std::function<std::unique_ptr<Gripper>()>;

class GripperThread {
public:
  struct News {
    std::optional<GripperStatus> status; // an answer
    std::string trouble;                 // or why there is none: once, until the next answer;
                                         // with an answer what its fault code means, or that no command reached it
  };

  // gripper: open; reopen: as it was opened.
  GripperThread(std::unique_ptr<Gripper> gripper, OpenGripper reopen);
  // Ends after the exchange under way; the gripper goes to the last commanded width.
  ~GripperThread();
  GripperThread(const GripperThread &) = delete;
  GripperThread &operator=(const GripperThread &) = delete;

  void command(const GripCommand &command);
  std::deque<News> take() {
    std::lock_guard lock(mutex_);
    return std::exchange(news_, {});
  }
  // The newest command has been sent and answered.
  bool is_done() const {
    std::lock_guard lock(mutex_);
    return sent_ == number_;
  }

private:
  void run();
  GripperStatus exchange();
  void put(News news);

  std::unique_ptr<Gripper> gripper_;
  OpenGripper reopen_;
  std::int64_t poll_us_;

  mutable std::mutex mutex_;
  Wake ended_;
  bool end_ = false;
  GripCommand command_{};
  std::uint64_t number_ = 0, sent_ = 0; // of commands that differ
  std::deque<News> news_;
  std::string reported_;
  Thread thread_;
};

} // namespace fingertip
