// Presses together with the reference optimum of what the firmware receives of them.
//
// Solving takes a fraction of a millisecond a press; the solutions are kept in
// <cache>/reference_<seed>_<set>_<mask>.bin and computed only once. A record counts only if the
// readings and the reference's own source are those it was made from.
#pragma once

#include "report/reference/press_sets.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace fingertip::reference {

enum class Mask {
  none,
  random,  // one sensor of the press, drawn from the seed
  peak,    // the sensor with the largest reading
  random2, // two sensors, drawn from the seed
  random3,
};
constexpr std::array<Mask, 5> ALL_MASKS{Mask::none, Mask::random, Mask::peak, Mask::random2, Mask::random3};
const char *name_of(Mask mask);

struct Case {
  Press press;
  std::vector<std::int32_t> pressure_Pa_q10; // [sensor]
  std::uint32_t usable;                      // bitmap of the sensors to use
  Fit best;                                  // from the readings in pressure_Pa_q10
  // The readings in use determine the location: observable(best) away from the box, and their
  // largest is at least 20 noise sigmas.
  bool observable;
};

// The array of firmware/config.
Array firmware_array();

// The first `count` presses of a set. Two threads; progress on stderr. Throws
// std::runtime_error with a message that names the file if the cache cannot be written.
std::vector<Case> load_cases(PressSet set, Mask mask, std::uint64_t seed, std::size_t count,
                             const std::string &cache_dir);

} // namespace fingertip::reference
