#include "report/grasp/textbook.hpp"

extern "C" {
#include "common/contact_flags.h"
}

#include <algorithm>
#include <cmath>

namespace fingertip::grasp {

constexpr double FIRST_N = 2.0, TOUCH_N = 0.15, MOST_N = 20.0, MARGIN = 1.3, SLID = 1.3;
constexpr double APPROACH_mm_s = 8.0, STIFFNESS_N_mm = 3.0, MOVES_s = 0.1, STANDS_s = 0.2;

void Textbook::approach(double now_s, double low_N) {
  const double step_mm = traits_.step_mm;
  if (low_N >= TOUCH_N) {
    report_.state = GRIP_SQUEEZE;
  } else if (now_s - moved_s_ >= step_mm / APPROACH_mm_s) {
    target_mm_ = std::max(0.0, target_mm_ - step_mm);
    moved_s_ = now_s;
  }
}

void Textbook::hold(double now_s, double low_N, double force_N, double load_N, bool slides) {
  if (report_.state == GRIP_SQUEEZE) {
    held_s_ = low_N < 0.6 * FIRST_N ? now_s : held_s_;
    report_.state = now_s - held_s_ > STANDS_s ? GRIP_HOLDING : GRIP_SQUEEZE;
  } else {
    if (slides && !slides_) {
      friction_ = std::clamp(load_N / std::max(force_N, 0.1), 0.1, friction_);
      wanted_N_ = SLID * low_N;
    }
    slides_ = slides;
    wanted_N_ = std::clamp(std::max(MARGIN * load_N / friction_, slides ? wanted_N_ : FIRST_N), FIRST_N, MOST_N);
  }
  if (now_s - moved_s_ >= MOVES_s) {
    const double step_mm = traits_.step_mm;
    target_mm_ -= step_mm * std::round((wanted_N_ - low_N) / (STIFFNESS_N_mm * step_mm));
    moved_s_ = now_s;
  }
}

GripReport Textbook::step(double now_s, GripCommand &command) {
  double low_N = MOST_N, force_N = 0.0, load_N = 0.0;
  bool slides = false;
  for (const GripTouch &touch : touch_) {
    low_N = std::min(low_N, touch.force_N);
    force_N += 0.5 * touch.force_N;
    load_N += 0.5 * std::hypot(touch.qx_N, touch.qy_N);
    slides = slides || (touch.flags & CONTACT_FLAG_SLIDING) != 0;
  }
  if (status_.host_us != 0) {
    target_mm_ = begun_ ? target_mm_ : status_.width_mm;
    begun_ = true;
    report_.state = std::max<std::uint8_t>(report_.state, GRIP_APPROACH);
    report_.state == GRIP_APPROACH ? approach(now_s, low_N) : hold(now_s, low_N, force_N, load_N, slides);
    command.motion = GRIP_MOVE;
    command.width_mm = target_mm_;
    command.speed_mm_s = traits_.speed_max_mm_s;
    command.force_N = 25.0;
  }
  report_.wanted_N = wanted_N_;
  return report_;
}

} // namespace fingertip::grasp
