// The firmware on boards/native, in this process: one at a time.
//
// Nothing takes time there but bus and conversions. Its faults: those of sim_array.h, and
//   sensor_dead, sensor_missing   acknowledges nothing for a while; the other one without power
//   nacks                         one read in fifty is not acknowledged
//   d2_corrupt                    one temperature in five has a wrong bit
//   inverted_bits                 bits of a transfer are inverted; what a conversion found has no
//                                 check, so a wrong frame that follows is excused, and counted
#pragma once

#include "plant.hpp"

namespace soak {

class NativePlant : public Plant {
public:
  // The chip's clock shows clock_us at the first start, and 0 at later ones. has_line_each: a data
  // line for each sensor, as pico_parallel has, instead of multiplexers.
  NativePlant(const World &world, std::uint64_t seed, std::uint64_t clock_us = 0, bool has_line_each = false);
  ~NativePlant() override;
  NativePlant(const NativePlant &) = delete;
  NativePlant &operator=(const NativePlant &) = delete;

  const std::vector<Target> &faults() const override;
  void schedule(const Fault &fault) override;
  void run_to(std::uint64_t t_us, Judge &judge) override;
  bool port_is_open() const override { return open_; }
  void write(const std::vector<std::uint8_t> &bytes) override;
  std::uint64_t unasked_starts() const override { return 0; }
  std::string ended() const override { return ended_; }

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
  void look_at_port(std::uint64_t t_us, Judge &judge);

  const World &world_;
  struct random random_;
  std::vector<Change> changes_; // by time
  std::vector<std::uint8_t> to_send_;
  std::uint64_t zero_us_ = 0, now_us_ = 0; // when the chip's clock was 0, modulo 2^64
  bool has_power_ = true, open_ = false;
  int closed_ = 0, asleep_ = 0, stalled_ = 0; // by so many faults
  std::string ended_;
};

} // namespace soak
