// Slips of what a grip holds, and how soon the grip answered.
#pragma once

#include "simulation/cell/cell.hpp"

#include <limits>
#include <optional>
#include <vector>

namespace fingertip::cell {

constexpr double SLIP_mm = 0.3;

// All of both contacts slid, by SLIP_mm or more in all.
struct Slip {
  double begin_s, way_mm;           // begin_s: by the clock of look()
  std::optional<double> reaction_s; // until the grip was 5 % stronger; none: never
};

class Slips {
public:
  // At least once a millisecond, the cell at this time. What goes on after less rest than 30 ms is
  // one slip.
  void look(double t_s, const Cell &cell);
  // Now no slip goes on.
  void end();
  std::vector<Slip> slips;

private:
  std::optional<Slip> slip_;
  double begin_N_ = 0.0, begin_mm_ = 0.0;
  double last_s_ = -std::numeric_limits<double>::infinity();
};

} // namespace fingertip::cell
