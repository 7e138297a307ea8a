// A grasp from its first step to its last: frames of two fingertips and a gripper's answers go into
// the controller's core, and commands come out of it.
//
//   GraspLoop loop({left, right}, {});
//   auto met = loop.meet([] { return stop_requested(); });      who they are
//   loop.begin(open_gripper(way), [&] { return open_gripper(way); }, settings);
//   loop.request(GRIP_REQUEST_GRASP);
//   while (!over) {
//     for (GraspNews &news : loop.take(20ms)) ...
//   }
//   loop.end();                                                 the width stays
//
// Threads: one for each fingertip (DeviceLoop), one for the gripper (GripperThread), and one that steps the core at
// each frame and answer, and every 5 ms without any. None waits for the reader of the news. News that are not read for
// long are dropped and counted. All times are of the host's steady clock. The core has no other clock.
//
// A failure is a trouble in the report and never opens the gripper. The loop waits for a fingertip or a gripper that is gone, and goes on
// when it is back. If this process dies, the gripper goes to the last commanded width, some tenths of a millimetre away, and stays.
#pragma once

#include "grasp/control/grip.hpp"
#include "grasp/gripper_thread.hpp"
#include "libfingertip/clock.hpp"
#include "libfingertip/device_loop.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace fingertip {

struct GraspNews {
  enum class Kind {
    device,  // of a fingertip: device holds it
    step,    // of the core: its input and its output
    gripper, // text: what is wrong with it, its fault or why it does not answer; "": nothing now
    fault,   // text: why the core's state has become fault
    dropped, // count: news of other kinds that were not taken in time
    ended,   // the last
  };
  Kind kind;
  std::int64_t host_us = 0;
  std::optional<DeviceUpdate> device = {};
  GripCommand command = {};
  GripReport report = {};
  std::optional<GripperStatus> status = {}; // the newest answer
  std::string text = {};
  std::uint64_t count = 0;
};

class GraspLoop {
public:
  static constexpr std::size_t FINGERS = GRIP_FINGERS;

  struct Options {
    std::uint8_t streams = WIRE_STREAM_ALL;
    bool activate = false; // where the core asks for it; else it is never passed on
    // How often the user wants the width to stay, for callers whose own thread may be held up by a terminal. The loop
    // asks with every step. The first time the width stays, the second time the gripper opens.
    std::function<unsigned()> interrupts = [] { return 0u; };
  };

  // Opens both ports; the left is 0. Throws Error.
  GraspLoop(const std::array<Endpoint, FINGERS> &ways, Options options);
  // Ends it as end() does, but does not wait.
  ~GraspLoop();
  GraspLoop(const GraspLoop &) = delete;
  GraspLoop &operator=(const GraspLoop &) = delete;

  std::string name(std::size_t finger) const { return loops_[finger]->name(); }
  LineStatistics statistics(std::size_t finger) const { return loops_[finger]->statistics(); }
  // The earlier of both DeviceLoops' read_until_us.
  double read_until_us() const { return std::min(loops_[0]->read_until_us(), loops_[1]->read_until_us()); }

  // Their news of kind ready, once both have answered. Throws Error, and Interrupted once stop reports so.
  std::array<DeviceUpdate, FINGERS> meet(const std::function<bool()> &stop);

  // Fingertips stream, the core steps; nothing moves before it is requested. Throws Error where the gripper does not answer.
  void begin(std::unique_ptr<Gripper> gripper, OpenGripper reopen, const GripSettings &settings);
  // False: not from this state.
  bool request(GripRequest wanted) {
    std::lock_guard lock(core_mutex_);
    return core_->request(wanted);
  }
  // Grip::change.
  bool change(const GripSettings &settings) {
    std::lock_guard lock(core_mutex_);
    return core_->change(settings);
  }
  // All there is, waiting at most this long for the first.
  std::vector<GraspNews> take(std::chrono::milliseconds timeout);
  // The width stays, streams end; news come until the one of kind ended.
  void end() { end_ = true; }
  // After it: what ended a fingertip, if it was an error.
  void rethrow() const {
    for (const auto &loop : loops_) {
      loop->rethrow();
    }
  }

private:
  void run();
  void take_devices();
  void take_gripper();
  void step();
  void report_fault(const GripReport &report);
  void obey_interrupts();
  void put(GraspNews news);

  Options options_;
  DeviceFeed feed_;
  std::array<std::unique_ptr<DeviceLoop>, FINGERS> loops_;
  std::size_t running_ = FINGERS;

  mutable std::mutex core_mutex_; // of the core
  std::optional<Grip> core_;

  std::unique_ptr<GripperThread> gripper_;
  std::optional<GripperStatus> status_;
  std::string gripper_trouble_;
  std::string fault_text_; // of the newest answer with a fault
  GripReport report_{};    // of the last step
  bool is_activating_ = false;
  unsigned interrupts_ = 0;
  std::atomic<bool> end_{false}, abandoned_{false};

  std::mutex news_mutex_;
  Wake filled_;
  std::vector<GraspNews> news_;
  std::uint64_t dropped_ = 0;

  Thread thread_;
};

} // namespace fingertip
