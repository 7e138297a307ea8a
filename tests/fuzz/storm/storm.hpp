// A host that uses a fingertip while the faults of a fuzz target's input occur: bouts of one fault, or of
// several at a time, each with the time after it until good frames come again.
#pragma once

#include "fuzz.h"
#include "judge.hpp"
#include "native_plant.hpp"
#include "world.hpp"

namespace storm {

// From the end of a fault to the first of five good frames in a row. The firmware tries lost sensors again after 1, 2, 4 and then every 8 s
// (bring_up.h), and a zero that was taken from a wrong temperature is given up after 10 s (condition.h).
constexpr std::uint64_t RECOVERY_LIMIT_us = 20000000;

class Storm {
public:
  // input: the faults. All else follows from the seed.
  Storm(NativePlant &plant, World &world, Judge &judge, std::uint64_t seed, fuzz_input input);

  // All faults of the input, until the last is overcome.
  void run();
  // Without faults: the host sets the highest rate and the profile of a 12 mm pad, and frames must come.
  void run_steady(std::uint64_t end_us);

private:
  bool step();
  bool find(const std::string &why);
  void begin_bout();
  void add_fault(const Target &target, std::uint64_t from_us);
  void write(wire_packet packet);
  void write_garbage();
  void write_some_command();
  void write_something_to_store();
  void set_for_most_frames();
  void talk();

  NativePlant &plant_;
  World &world_;
  Judge &judge_;
  fuzz_input input_;
  struct random random_;
  std::uint64_t now_us_ = 0;

  // The host
  std::uint16_t sequence_ = 0;
  bool steady_ = false;
  std::uint8_t streams_ = 7;
  bool was_open_ = false, has_asked_ = false;
  std::uint64_t ask_at_us_ = 0;

  // The bout
  std::string scene_;
  bool in_bout_ = false, loses_power_ = false;
  std::uint64_t begins_us_ = 0, power_lost_us_ = 0, ends_us_ = 0;
  std::uint64_t commands_until_us_ = 0, garbage_until_us_ = 0, store_until_us_ = 0;
};

} // namespace storm
