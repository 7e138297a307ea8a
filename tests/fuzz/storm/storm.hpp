// A host that uses a fingertip while one thing after another goes wrong: bouts of one fault, or of
// several at a time, and then whatever time it takes until good frames come again.
#pragma once

#include "judge.hpp"
#include "plant.hpp"
#include "world.hpp"

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace soak {

// From the end of a fault to the first of five good frames in a row. The firmware asks lost sensors
// back after 1, 2, 4 and then every 8 s (bring_up.h), and a zero that was taken from a wrong
// temperature gives in after 10 s (condition.h).
constexpr std::uint64_t RECOVERY_LIMIT_us = 20000000;

struct Recovery {
  std::uint64_t bouts = 0;
  double worst_s = 0;
};

class Storm {
public:
  Storm(Plant &plant, World &world, Judge &judge, std::uint64_t seed);

  // No bouts: the host sets the highest rate and the profile of a 12 mm pad, and frames must come.
  void keep_steady() { steady_ = true; }
  // Until bench time `end_us`, or something ends it: see ended(). Findings are the judge's.
  void run_to(std::uint64_t end_us);
  std::uint64_t now_us() const { return now_us_; }
  std::uint64_t hangs() const { return hangs_; }
  std::uint64_t bouts() const { return bouts_; }
  // By kind of fault; several at a time are one kind.
  const std::map<std::string, Recovery> &recovery() const { return recovery_; }

private:
  void hang(const std::string &why);
  void begin_bout();
  void add_fault(const Target &target, std::uint64_t from_us);
  void write(wire_packet packet);
  void write_garbage();
  void write_some_command();
  void write_something_to_store();
  void set_for_most_frames();
  void talk();
  bool over();

  Plant &plant_;
  World &world_;
  Judge &judge_;
  struct random random_;
  std::uint64_t now_us_ = 0;
  std::uint64_t hangs_ = 0, bouts_ = 0;
  std::map<std::string, Recovery> recovery_;

  // The host
  std::uint16_t sequence_ = 0;
  bool steady_ = false;
  std::uint8_t streams_ = 7;
  bool was_open_ = false, has_asked_ = false;
  std::uint64_t ask_at_us_ = 0;

  // The bout
  std::string kind_, scene_;
  bool in_bout_ = false, recovers_ = true;
  bool loses_power_ = false;
  std::uint64_t begins_us_ = 0, power_lost_us_ = 0, ends_us_ = 0, next_us_ = 2000000;
  std::uint64_t commands_until_us_ = 0, garbage_until_us_ = 0, store_until_us_ = 0;
  std::uint64_t unasked_starts_ = 0;
};

} // namespace soak
