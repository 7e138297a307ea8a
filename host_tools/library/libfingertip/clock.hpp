/* The host's clock: the one place where the library and the tool read the time, wait and start threads that wait.
 *
 *   HostTime limit = host_now() + 250ms;
 *   pollfd port = {fd, POLLIN, 0};
 *   if (wait_for(&port, 1, limit) > 0) ...
 *
 * Nothing else in the host programs calls steady_clock::now, poll with a timeout, a sleep or a timed wait of a condition variable. So
 * another implementation of this header, chosen by the linker, is all that a test needs to run whole programs on simulated time
 * (tests/support/simulated_clock.cpp). Under such a clock one thread runs at a time, and time passes only while all of them wait here:
 * never wait while holding a lock that another thread needs before it waits itself. */
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <poll.h>
#include <sys/types.h>

#pragma GCC visibility push(default)
namespace fingertip {

/* CLOCK_MONOTONIC. */
using HostTime = std::chrono::steady_clock::time_point;

HostTime host_now();
/* The same in us. */
std::int64_t steady_now_us();
/* The time of day, for people: it may jump. */
std::chrono::system_clock::time_point wall_now();

/* Like poll(2), but until a moment instead of for a duration, exact to the microsecond. Returns the number of descriptors that are ready; 0
 * once `until` has come or after a signal. A moment that has passed only asks. HostTime::max() waits without end. */
int wait_for(pollfd *descriptors, std::size_t count, HostTime until);
/* A signal ends the wait early. */
void wait_until(HostTime until);

/* Wakes a thread that waits: descriptor() is readable between set and clear. */
class Wake {
public:
  Wake();
  ~Wake();
  Wake(const Wake &) = delete;
  Wake &operator=(const Wake &) = delete;

  void set();
  void clear();
  int descriptor() const { return fd_; }
  /* Waits for set, not longer than this, and clears. */
  bool wait(HostTime until);

private:
  int fd_;
};

/* A thread that may wait by this clock, and is joined, which waits by it too, or never started. */
class Thread {
public:
  Thread() = default;
  explicit Thread(std::function<void()> run);
  Thread(Thread &&) = default;
  Thread &operator=(Thread &&) = default;

  bool joinable() const { return state_ != nullptr; }
  void join();

private:
  struct State;
  std::shared_ptr<State> state_;
};

/* Call it after fork, in the parent: there is another process that waits by this clock. */
void clock_expects(pid_t child);

} // namespace fingertip
#pragma GCC visibility pop
