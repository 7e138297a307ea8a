#include "simulation/cell/slips.hpp"

#include <algorithm>

namespace fingertip::cell {

constexpr double MORE_FORCE = 1.05, JOINED_s = 0.03, AFTER_s = 1.0;

void Slips::sample(double t_s, bool slides, double force_N, double slid_mm, double least_N) {
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
  const auto follow = [&](Slip &slip) {
    slip.peak_N = std::max(slip.peak_N, force_N);
    slip.least_N = std::max(slip.least_N, least_N);
  };
  if (slip_) {
    follow(*slip_);
  }
  if (!slips.empty() && t_s - ended_s_ < AFTER_s) {
    follow(slips.back());
  }
}

void Slips::end() {
  if (go_on()) {
    slips.push_back(*slip_);
    ended_s_ = last_s_;
  }
  slip_.reset();
}

} // namespace fingertip::cell
