#include "libfingertip/clock.hpp"

#include <algorithm>
#include <thread>

namespace fingertip {

using std::chrono::nanoseconds;

HostTime host_now() { return std::chrono::steady_clock::now(); }

std::chrono::system_clock::time_point wall_now() { return std::chrono::system_clock::now(); }

int wait_for(pollfd *descriptors, std::size_t count, HostTime until) {
  timespec left = {};
  if (until != HostTime::max()) {
    const auto left_ns = std::max<nanoseconds>(nanoseconds(0), until - host_now()).count();
    left = {left_ns / 1'000'000'000, left_ns % 1'000'000'000};
  }
  return std::max(0, ppoll(descriptors, count, until == HostTime::max() ? nullptr : &left, nullptr));
}

struct Thread::State {
  std::thread thread;
};

Thread::Thread(std::function<void()> run) : state_(std::make_shared<State>(State{std::thread(std::move(run))})) {}

void Thread::join() {
  state_->thread.join();
  state_.reset();
}

void clock_expects(pid_t) {}

} // namespace fingertip
