// The release image in the emulator, run by emulated.mjs at the other end of two streams. Lines of
// JSON: for each step this end sends one, and gets one back.
//
//   {"to_us", "rows": [{"t_us", "Pa": [15], "degC"}], "faults": [{"type", "sensor" | "mux",
//   "from_s",
//    "to_s"}], "write": hex}     rows: what is felt, told ahead
//   {"events": [["start" | "open" | "close", t_us] | ["zero", t_us, us] | ["bytes", t_us, hex]],
//    "unasked", "ended"}         zero: when the device's clock was 0
//
// Faults are those of host_tools/simulation/emulator/faults.mjs, and port_closed and suspend; start_* is a
// power_cut after which the crystal or the PLLs come late.
#pragma once

#include "plant.hpp"

#include <iostream>

namespace soak {

class EmulatedPlant : public Plant {
public:
  EmulatedPlant(const World &world, const std::string &board, std::istream &from, std::ostream &to);

  const std::vector<Target> &faults() const override { return faults_; }
  void schedule(const Fault &fault) override { scheduled_.push_back(fault); }
  void run_to(std::uint64_t t_us, Judge &judge) override;
  bool port_is_open() const override { return open_; }
  void write(const std::vector<std::uint8_t> &bytes) override;
  std::uint64_t unasked_starts() const override { return unasked_; }
  std::string ended() const override { return ended_; }

private:
  const World &world_;
  std::istream &from_;
  std::ostream &to_;
  std::vector<Target> faults_;
  std::vector<Fault> scheduled_;
  std::string to_send_; // hex
  std::uint64_t told_us_ = 0;
  bool open_ = false;
  std::uint64_t unasked_ = 0;
  std::string ended_;
};

} // namespace soak
