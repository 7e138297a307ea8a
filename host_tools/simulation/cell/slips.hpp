// Slides of what a grip holds, and how the grip answered.
#pragma once

#include <limits>
#include <optional>
#include <vector>

namespace fingertip::cell {

constexpr double SLIP_mm = 0.3;  // a slide by less is none
constexpr double DROP_mm = 22.0; // what slid by this is dropped

// All of both contacts slid, by SLIP_mm or more in all.
struct Slip {
  double begin_s, way_mm;           // begin_s: by the clock of sample()
  std::optional<double> reaction_s; // until the grip was 5 % stronger, at the latest when it ended; none: never
  double peak_N, least_N;           // from its beginning to 1 s after its end, the largest of each
};

class Slips {
public:
  // At least once a millisecond: whether it slides, the grip, how far it slid in all, and the grip that just
  // holds. A slide that goes on after less rest than 30 ms is one slip.
  void sample(double t_s, bool slides, double force_N, double slid_mm, double least_N = 0.0);
  // No slip goes on from now on.
  void end();
  bool go_on() const { return slip_ && slip_->way_mm >= SLIP_mm; }
  std::vector<Slip> slips;

private:
  static constexpr double NEVER_s = std::numeric_limits<double>::infinity();
  std::optional<Slip> slip_;
  double begin_N_ = 0.0, begin_mm_ = 0.0, last_s_ = -NEVER_s, ended_s_ = -NEVER_s;
};

} // namespace fingertip::cell
