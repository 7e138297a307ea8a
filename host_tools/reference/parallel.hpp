// work(0) .. work(count - 1), in any order, on two threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <thread>
#include <vector>

namespace fingertip::reference {

template <typename Work> void in_parallel(std::size_t count, const Work &work) {
  constexpr unsigned THREADS = 2;
  constexpr std::size_t CHUNK = 64;
  std::atomic<std::size_t> next{0};
  std::vector<std::thread> threads;
  for (unsigned i = 0; i < THREADS; i++) {
    threads.emplace_back([&] {
      for (std::size_t start; (start = next.fetch_add(CHUNK)) < count;) {
        for (std::size_t k = start; k < std::min(count, start + CHUNK); k++) {
          work(k);
        }
      }
    });
  }
  for (std::thread &thread : threads) {
    thread.join();
  }
}

} // namespace fingertip::reference
