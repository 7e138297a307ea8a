#include "simulation/cell/slips.hpp"

namespace fingertip::cell {
namespace {

constexpr double MORE_FORCE = 1.05, JOINED_s = 0.03;

} // namespace

void Slips::look(double t_s, const Cell &cell) {
  if (cell.slips()) {
    if (t_s - last_s_ > JOINED_s) {
      end();
      slip_ = Slip{t_s, 0.0, {}};
      begin_N_ = cell.force_N();
      begin_mm_ = cell.slid_mm();
    }
    last_s_ = t_s;
  }
  if (slip_) {
    slip_->way_mm = cell.slid_mm() - begin_mm_;
    if (!slip_->reaction_s && cell.force_N() >= MORE_FORCE * begin_N_) {
      slip_->reaction_s = t_s - slip_->begin_s;
    }
  }
}

void Slips::end() {
  if (slip_ && slip_->way_mm >= SLIP_mm) {
    slips.push_back(*slip_);
  }
  slip_.reset();
}

} // namespace fingertip::cell
