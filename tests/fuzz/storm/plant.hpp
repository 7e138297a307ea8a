// A fingertip and the bench around it, whichever runs it. Times are of the bench, us.
#pragma once

#include "judge.hpp"
#include "world.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace soak {

// Kinds that every bench knows: host_stall, port_closed, suspend, power_cut, chip_reset. Those of
// one board are listed where it is.
struct Fault {
  std::string kind;
  int target = -1; // a sensor or a multiplexer
  std::uint64_t from_us = 0, to_us = 0;
};

struct Target {
  const char *kind;
  int targets;                     // it strikes one of so many; 0: all there is
  std::uint64_t least_us, most_us; // how long; most_us 0: at once, and it is over
};

class Plant {
public:
  virtual ~Plant() = default;
  virtual const std::vector<Target> &faults() const = 0;
  // From now on or later.
  virtual void schedule(const Fault &fault) = 0;
  // Runs one step of the bench, whose world is told further than that, and tells the judge.
  virtual void run_to(std::uint64_t t_us, Judge &judge) = 0;
  virtual bool port_is_open() const = 0;
  // Only while the port is open.
  virtual void write(const std::vector<std::uint8_t> &bytes) = 0;
  // Starts of the chip that no fault has asked for; and why it runs no more, if so.
  virtual std::uint64_t unasked_starts() const = 0;
  virtual std::string ended() const = 0;
};

} // namespace soak
