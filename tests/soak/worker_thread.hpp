// The second processor of boards/native as a thread of its own: from the moment that it is woken it
// serves beside the main loop, and simulated time does not pass its due before it is done. So the
// two really share the memory, as two processors do; what it answers first is up to the machine.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>

namespace soak {

// One at a time, as the firmware is.
class WorkerThread {
public:
  // It needs so much simulated time for what it is woken for.
  explicit WorkerThread(std::uint64_t takes_us);
  ~WorkerThread();
  WorkerThread(const WorkerThread &) = delete;
  WorkerThread &operator=(const WorkerThread &) = delete;

  // Jobs so far.
  std::uint64_t served();

private:
  static void begin(bool (*serve)(void *context), void *context);
  static void end();
  void run();

  static WorkerThread *one_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool woken_ = false, works_ = false, quits_ = false;
  bool (*serve_)(void *context) = nullptr;
  void *context_ = nullptr;
  std::uint64_t served_ = 0;
  std::thread thread_;
};

} // namespace soak
