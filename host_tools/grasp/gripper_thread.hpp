// A gripper in a thread of its own, so that a slow or silent line delays nobody: the newest command
// goes out with the next exchange, and every answer comes back. An exchange that fails is tried
// again, with the newest command; a port that vanished is opened again. Nothing is activated that
// was not commanded, and nothing is sent that the core did not command.
#pragma once

#include "grasp/core.hpp"
#include "grasp/gripper/gripper.hpp"
#include "libfingertip/clock.hpp"

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

namespace fingertip {

using OpenGripper = std::function<std::unique_ptr<Gripper>()>;

class GripperThread {
public:
  struct News {
    std::optional<GripperStatus> status; // an answer
    std::string trouble;                 // or why there is none: told once, until the next answer;
                                         // with an answer what its fault code means, or that
                                         // nobody spoke to it
  };

  // gripper: open; reopen: as it was opened.
  GripperThread(std::unique_ptr<Gripper> gripper, OpenGripper reopen);
  // Ends after the exchange under way; the gripper goes where it was last told to.
  ~GripperThread();
  GripperThread(const GripperThread &) = delete;
  GripperThread &operator=(const GripperThread &) = delete;

  void command(const grip_command &command);
  std::deque<News> take();
  // The newest command has been sent and answered.
  bool is_done() const;

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
  grip_command command_{};
  std::uint64_t number_ = 0, sent_ = 0; // of commands that differ
  std::deque<News> news_;
  std::string told_;
  Thread thread_;
};

} // namespace fingertip
