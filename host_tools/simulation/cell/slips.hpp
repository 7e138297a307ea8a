// Slides of what a grip holds, and how the grip answered.
#pragma once

#include <algorithm>
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
  void sample(double t_s, bool slides, double force_N, double slid_mm, double least_N = 0.0) {
    if (slides) {
      if (t_s - last_s_ > JOINED_s) {
        end();
        slip_ = Slip{t_s, 0.0, {}, 0.0, 0.0};
        begin_N_ = force_N;
        begin_mm_ = slid_mm;
      }
      last_s_ = t_s;
    }
    if (slip_ && t_s - last_s_ <= JOINED_s) {
      slip_->way_mm = slid_mm - begin_mm_;
      if (!slip_->reaction_s && force_N >= MORE_FORCE * begin_N_) {
        slip_->reaction_s = t_s - slip_->begin_s;
      }
    } else {
      end();
    }
    for (Slip *slip : {slip_ ? &*slip_ : nullptr, !slips.empty() && t_s - ended_s_ < AFTER_s ? &slips.back() : nullptr}) {
      if (slip) {
        slip->peak_N = std::max(slip->peak_N, force_N);
        slip->least_N = std::max(slip->least_N, least_N);
      }
    }
  }
  // No slip goes on from now on.
  void end() {
    if (go_on()) {
      slips.push_back(*slip_);
      ended_s_ = last_s_;
    }
    slip_.reset();
  }
  bool go_on() const { return slip_ && slip_->way_mm >= SLIP_mm; }
  std::vector<Slip> slips;

private:
  static constexpr double NEVER_s = std::numeric_limits<double>::infinity();
  static constexpr double MORE_FORCE = 1.05, JOINED_s = 0.03, AFTER_s = 1.0;
  std::optional<Slip> slip_;
  double begin_N_ = 0.0, begin_mm_ = 0.0, last_s_ = -NEVER_s, ended_s_ = -NEVER_s;
};

} // namespace fingertip::cell
