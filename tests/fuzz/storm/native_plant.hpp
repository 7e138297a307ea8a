// The firmware on boards/native, in this process: one at a time. Times are of the bench, us.
//
// Nothing takes time there but bus and conversions. Its faults: those of sim_array.h, and
//   sensor_dead, sensor_missing   acknowledges nothing for a while; the other one without power
//   nacks                         one read in fifty is not acknowledged
//   d2_corrupt                    one temperature in five has a wrong bit
//   inverted_bits                 bits of a transfer are inverted; the result of a conversion has
//                                 no check, so a wrong frame that follows is excused, and counted
#pragma once

#include "judge.hpp"
#include "world.hpp"

namespace storm {

struct Fault {
  std::string kind;
  unsigned sensor = 0;
  std::uint64_t from_us = 0, to_us = 0;
};

struct Target {
  const char *kind;
  std::uint64_t least_us, most_us; // its duration; most_us 0: it is over at once
};

class NativePlant {
public:
  // The chip's clock shows clock_us at the first start, and 0 at later ones. has_line_each: a data
  // line for each sensor, as pico_parallel has, instead of multiplexers.
  NativePlant(const World &world, std::uint64_t seed, std::uint64_t clock_us = 0, bool has_line_each = false);
  ~NativePlant();
  NativePlant(const NativePlant &) = delete;
  NativePlant &operator=(const NativePlant &) = delete;

  static const std::vector<Target> &faults();
  // From now on or later.
  void schedule(const Fault &fault);
  // Runs the bench, whose world must extend further than that, and passes to the judge what comes.
  void run_to(std::uint64_t t_us, Judge &judge);
  bool port_is_open() const { return open_; }
  // Only while the port is open.
  void write(const std::vector<std::uint8_t> &bytes);
  // Why it runs no more, if so.
  const std::string &ended() const { return ended_; }

private:
  struct Change {
    std::uint64_t t_us;
    Fault fault;
    bool begins;
  };
  void start(std::uint64_t t_us, std::uint64_t clock_us, Judge *judge);
  void run_firmware(std::uint64_t t_us);
  void act(const Change &change, Judge &judge);
  void listen(std::uint64_t t_us, Judge &judge);
  void update_port(std::uint64_t t_us, Judge &judge);

  const World &world_;
  struct random random_;
  std::vector<Change> changes_; // by time
  std::vector<std::uint8_t> to_send_;
  std::uint64_t zero_us_ = 0, now_us_ = 0; // when the chip's clock was 0, modulo 2^64
  bool has_power_ = true, open_ = false;
  int closed_ = 0, asleep_ = 0, stalled_ = 0; // by so many faults
  std::string ended_;
};

} // namespace storm
