#include "web/wasm/bundle.hpp"

#include "simulation/twin/held_object.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace fingertip::web {

using twin::HeldObject, twin::mindlin;

Bundle::Bundle(double friction, double kinetic_share) : static_(friction), kinetic_share_(kinetic_share) {
  // Straight between as many points of the curve as there are elements; where its slope falls, one
  // begins to slide. The points are denser where the last ones slide.
  const auto at = [](std::size_t i) {
    const double left = 1.0 - static_cast<double>(i) / ELEMENTS;
    return 1.0 - left * left;
  };
  const auto slope = [&](std::size_t i) { return i == ELEMENTS ? 0.0 : (mindlin(at(i + 1)) - mindlin(at(i))) / (at(i + 1) - at(i)); };
  for (std::size_t i = 0; i < ELEMENTS; i++) {
    const double bend = slope(i) - slope(i + 1);
    stiffness_share_[i] = bend / 1.5;
    friction_share_[i] = bend * at(i + 1);
  }
}

void Bundle::step(double seconds, double force_N, double stiffness_N_mm, const Motion &motion) {
  const double holds_N = friction() * force_N;
  const double damping = stiffness_N_mm * HeldObject::LOSS_s;
  double sum_x = 0.0, sum_y = 0.0;
  double slowest = std::numeric_limits<double>::infinity();
  bool slides = true;
  for (std::size_t i = 0; i < ELEMENTS; i++) {
    const double c = stiffness_share_[i] * damping;
    double x = x_N_[i] + c * motion.x_mm_s, y = y_N_[i] + c * motion.y_mm_s;
    const double size_2 = x * x + y * y, limit = friction_share_[i] * holds_N;
    double stretch_x = motion.x_mm_s, stretch_y = motion.y_mm_s;
    if (size_2 > limit * limit) {
      // A slider takes what its spring, which the damper slows, does not.
      const double size = std::sqrt(size_2), per_c = 1.0 / c, share = limit / size;
      slowest = std::min(slowest, (size - limit) * per_c);
      x *= share;
      y *= share;
      stretch_x = (x - x_N_[i]) * per_c;
      stretch_y = (y - y_N_[i]) * per_c;
    } else {
      slides = false;
    }
    sum_x += x;
    sum_y += y;
    const double k = stiffness_share_[i] * stiffness_N_mm * seconds;
    x_N_[i] += k * stretch_x;
    y_N_[i] += k * stretch_y;
  }
  // Elements that slide one against the other are no gross slip.
  constexpr double TOGETHER = 0.98;
  const double size_2 = sum_x * sum_x + sum_y * sum_y;
  slips_ = slides && size_2 >= TOGETHER * TOGETHER * holds_N * holds_N;
  slip_mm_s_ = slips_ ? slowest : 0.0;
  rested_ += seconds * ((1.0 - rested_) / HeldObject::HEALS_s - rested_ * slip_mm_s_ / HeldObject::SETTLES_mm);
  rested_ = std::max(rested_, 0.0);
  pull_x_N_ = sum_x;
  pull_y_N_ = sum_y;
}

} // namespace fingertip::web
