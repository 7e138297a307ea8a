// A fingertip of the cell in a process of its own: the whole firmware on simulated sensors
// (player/native_fingertip.h), on a port that opens and hangs up as one on USB does.
//
// Its clock goes with the host's: it runs to where the world is known, so that frames come 1 to 2 ms later than they
// would, never too early. A reading is of the newest that is known, at most half a conversion before its time.
#pragma once

#include "simulation/cell/face.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <sys/types.h>

namespace fingertip::cell {

// What the rubber's base has to bear, for one other process to read.
class SharedPressures {
public:
  // At this time, later than all before; Pa above what the air presses.
  void put(std::int64_t host_us, const Pressures &pressures);
  // The time of the newest; 0: none yet.
  std::int64_t newest_us() const {
    const std::uint64_t count = count_.load(std::memory_order_acquire);
    return count == 0 ? 0 : sample(count - 1).host_us.load(std::memory_order_relaxed);
  }
  // In between straight; before the oldest that is kept, 0.5 s, as then; the same after the newest.
  double at(std::int64_t host_us, std::size_t sensor) const;

  // The other way: how often a program has set its frame rate.
  std::atomic<std::uint32_t> rates_set{0};
  // The time that its fingertip has reached; 0: it has not begun.
  std::atomic<std::int64_t> reached_us{0};
  // Host time at which its own clock was 0.
  std::atomic<std::int64_t> zero_us{0};
  // The process is stopped.
  std::atomic<bool> frozen{false};

private:
  static constexpr std::uint64_t KEPT = 1024;
  struct Sample {
    std::atomic<std::int64_t> host_us;
    std::array<std::atomic<float>, FT_MAX_SENSORS> pressure_Pa;
  };
  const Sample &sample(std::uint64_t number) const { return samples_[number % KEPT]; }

  std::array<Sample, KEPT> samples_{};
  std::atomic<std::uint64_t> count_{0};
};

struct FingerProcess {
  std::string serial, link; // of its port; what is in the link's way and no link is an error
  std::uint64_t seed = 1;
  Pressures gain;                      // of its sensors, as they are
  std::optional<double> calibrated_sd; // share by which its calibration is off; none: it has none
  bool parallel_bus = false;           // sim_array.h
  std::chrono::milliseconds round{1};  // the longest that it does not look at its port
};

// Starts it; it dies with this process, SIGINT is not for it. pressures: in memory that both share.
// To be called before there are threads. Throws Error.
pid_t start_finger(const FingerProcess &finger, SharedPressures &pressures);

} // namespace fingertip::cell
