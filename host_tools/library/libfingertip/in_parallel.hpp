// Runs work(0) .. work(count - 1) in any order on this number of threads, this one among them. An
// exception in one ends all and is rethrown here. Each thread takes up to 64 at a time.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace fingertip::twin {

template <typename Work> void in_parallel(std::size_t count, const Work &work, std::size_t threads = 2) {
  const std::size_t chunk = std::clamp<std::size_t>(count / (32 * std::max<std::size_t>(threads, 1)), 1, 64);
  std::atomic<std::size_t> next{0};
  std::mutex failing;
  std::exception_ptr failure;
  const auto run = [&] {
    for (std::size_t begin; (begin = next.fetch_add(chunk)) < count;) {
      try {
        for (std::size_t i = begin; i < std::min(count, begin + chunk); i++) {
          work(i);
        }
      } catch (...) {
        const std::lock_guard<std::mutex> lock(failing);
        failure = std::current_exception();
        next = count;
      }
    }
  };
  std::vector<std::thread> others;
  for (std::size_t k = 1; k < threads; k++) {
    others.emplace_back(run);
  }
  run();
  for (std::thread &other : others) {
    other.join();
  }
  if (failure) {
    std::rethrow_exception(failure);
  }
}

} // namespace fingertip::twin
