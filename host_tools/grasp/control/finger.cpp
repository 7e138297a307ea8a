#include "grasp/control/finger.hpp"

extern "C" {
#include "common/contact_flags.h"
}

#include <algorithm>
#include <cmath>
#include <limits>

namespace fingertip {

namespace {

// A fingertip whose values stay to the last bit for so long, and over so many frames, is stuck:
// noise changes them with every frame.
constexpr double FROZEN_s = 0.05;
constexpr int FROZEN_FRAMES = 5;
constexpr double OLD_s = 0.5;        // an older frame says nothing of now
constexpr double DELAY_SHARE = 0.05; // that a frame has in the mean delay
constexpr int ZERO_FRAMES = 3;
// A force with a larger standard deviation, as a share of it, is no measurement.
constexpr double FORCE_SD_MOST = 1.0;
// What a load is not to be believed with.
constexpr std::uint32_t FORCE_ONLY = CONTACT_FLAG_UNCERTAIN | CONTACT_FLAG_FLAT | CONTACT_FLAG_AT_BOUND |
                                     CONTACT_FLAG_SATURATED | CONTACT_FLAG_ZERO_DOUBTFUL;
constexpr std::uint32_t OVER = CONTACT_FLAG_SATURATED | CONTACT_FLAG_FORCE_LOWER_BOUND;
// A contact with a larger sigma is a plate's. Its Gaussian reaches far beyond the pad, which takes
// of its force what lies on so much of it: a block of 36 by 54 mm does.
constexpr double WIDE_mm = 15.0, PAD_mm2 = 1400.0;

double force_on_pad(const GripTouch &touch) {
  if ((touch.flags & CONTACT_FLAG_FIT_VALID) == 0 || touch.sigma_mm <= WIDE_mm) {
    return touch.force_N;
  }
  return touch.force_N * PAD_mm2 / (PAD_mm2 + 0.85 * 2.0 * M_PI * touch.sigma_mm * touch.sigma_mm);
}

bool tells_force(const GripTouch &touch) {
  if ((touch.flags & CONTACT_FLAG_CONTACT) == 0) {
    return true; // none
  }
  return (touch.flags & CONTACT_FLAG_FIT_VALID) != 0 &&
         ((touch.flags & CONTACT_FLAG_UNCERTAINTY_VALID) == 0 || touch.force_sd_N <= FORCE_SD_MOST * touch.force_N);
}

bool is_same(const GripTouch &a, const GripTouch &b) {
  return a.force_N == b.force_N && a.force_sd_N == b.force_sd_N && a.x_mm == b.x_mm && a.y_mm == b.y_mm &&
         a.qx_N == b.qx_N && a.qy_N == b.qy_N;
}

} // namespace

void GripFinger::take(const GripTouch &touch) {
  if (is_heard_ && touch.t_s <= touch_.t_s) {
    return;
  }
  const bool says_something = (touch.flags & CONTACT_FLAG_CONTACT) != 0 && (touch.flags & CONTACT_FLAG_HELD) == 0;
  if (!is_heard_ || !says_something || !is_same(touch_, touch)) {
    changed_s_ = touch.t_s;
    unchanged_ = 0;
  } else {
    unchanged_++;
  }
  touch_ = touch;
  is_heard_ = is_new_ = true;
  if (tells_force(touch)) {
    const bool contact = (touch.flags & CONTACT_FLAG_CONTACT) != 0;
    force_t_s_ = touch.t_s;
    force_N_ = contact ? std::max(force_on_pad(touch), 0.0) : 0.0;
    sd_N_ = (touch.flags & CONTACT_FLAG_UNCERTAINTY_VALID) != 0 ? touch.force_sd_N : 0.0;
  }
  if (tells_load()) {
    sum_x_N_ += touch.qx_N;
    sum_y_N_ += touch.qy_N;
    sums_++;
  }
}

bool GripFinger::tells_load() const {
  return (touch_.flags & CONTACT_FLAG_TANGENTIAL_VALID) != 0 && (touch_.flags & FORCE_ONLY) == 0;
}

void GripFinger::begin_zero() {
  zero_x_N_ = zero_y_N_ = sum_x_N_ = sum_y_N_ = 0.0;
  sums_ = 0;
}

void GripFinger::end_zero() {
  if (sums_ > 0) {
    zero_x_N_ = sum_x_N_ / sums_;
    zero_y_N_ = sum_y_N_ / sums_;
  }
}

bool GripFinger::has_zero() const {
  return !tells_load() || sums_ >= ZERO_FRAMES;
}

GripFelt GripFinger::look(double now_s, const GripSettings &settings) {
  GripFelt felt;
  felt.fresh = is_new_;
  if (is_new_) {
    const double delay_s = std::max(now_s - touch_.t_s, 0.0);
    delay_s_ += (has_delay_ ? DELAY_SHARE : 1.0) * (delay_s - delay_s_);
    has_delay_ = true;
    heard_s_ = now_s;
    told_s_ = force_t_s_ == touch_.t_s ? now_s : told_s_;
    is_new_ = false;
  }
  const bool stale = !is_heard_ || now_s > heard_s_ + settings.stale_s || now_s > touch_.t_s + OLD_s;
  const bool frozen = !stale && unchanged_ >= FROZEN_FRAMES && touch_.t_s - changed_s_ >= FROZEN_s;
  const bool untold = !stale && now_s > told_s_ + settings.stale_s;
  felt.trouble = (stale ? GRIP_FINGER_0_STALE : 0u) | (frozen ? GRIP_FINGER_0_FROZEN : 0u) |
                 (untold ? GRIP_FINGER_0_UNTOLD : 0u) |
                 (!stale && delay_s_ > settings.late_s ? GRIP_FINGER_0_LATE : 0u);
  felt.counts = !stale && !frozen;
  if (!felt.counts) {
    return felt;
  }
  felt.contact = (touch_.flags & CONTACT_FLAG_CONTACT) != 0;
  felt.over = (touch_.flags & OVER) != 0;
  felt.trouble |= felt.over ? GRIP_FINGER_0_OVER : 0u;
  felt.trouble |= felt.contact && (touch_.flags & FORCE_ONLY) != 0 ? GRIP_FINGER_0_FORCE_ONLY : 0u;
  felt.tells_force = !untold;
  felt.t_s = force_t_s_;
  felt.force_N = force_N_;
  felt.sd_N = sd_N_;
  felt.tells_load = felt.contact && tells_load();
  if (felt.tells_load) {
    felt.load_N = std::hypot(touch_.qx_N - zero_x_N_, touch_.qy_N - zero_y_N_);
    felt.speed_mm_s = touch_.speed_mm_s;
  }
  // Eq. (7) takes loads for slides: it counts only where nothing else tells either.
  const std::uint32_t slide = felt.tells_load ? CONTACT_FLAG_SLIDING : CONTACT_FLAG_SLIP;
  felt.slides = felt.contact && (touch_.flags & slide) != 0;
  return felt;
}

GripFelts look_at(std::array<GripFinger, GRIP_FINGERS> &fingers, double now_s, const GripSettings &settings) {
  GripFelts all;
  all.low_N = all.t_s = std::numeric_limits<double>::infinity();
  double loads_N = 0.0, most_N = 0.0, normal_N = 0.0;
  int loads = 0;
  all.speed_mm_s = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < fingers.size(); i++) {
    const GripFelt felt = fingers[i].look(now_s, settings);
    all.trouble |= felt.trouble << i;
    all.fresh = all.fresh || felt.fresh;
    all.over = all.over || felt.over;
    all.touches += felt.contact;
    all.slides = all.slides || felt.slides;
    all.delay_s = std::max(all.delay_s, felt.counts ? fingers[i].delay_s() : 0.0);
    if (felt.tells_force) {
      all.fingers++;
      all.force_N[i] = felt.force_N;
      all.mean_N += felt.force_N;
      all.low_N = std::min(all.low_N, felt.force_N);
      all.high_N = std::max(all.high_N, felt.force_N);
      all.sd_N = std::max(all.sd_N, felt.sd_N);
      all.t_s = std::min(all.t_s, felt.t_s);
    }
    if (felt.tells_load) {
      loads++;
      loads_N += felt.load_N;
      normal_N += felt.force_N;
      most_N = std::max(most_N, felt.load_N);
      all.speed_mm_s = std::min(all.speed_mm_s, felt.speed_mm_s);
    }
  }
  if (all.fingers == 0) {
    all.low_N = 0.0;
    all.t_s = now_s;
  } else {
    all.mean_N /= all.fingers;
  }
  // In the air both carry the same force, and the mean is the better estimate of it.
  all.grip_N = all.high_N - all.low_N > settings.differ * all.high_N ? all.low_N : all.mean_N;
  all.tells_load = loads > 0;
  if (loads > 0) {
    // They share a load; where one carries far more, it is that one's that slides.
    all.load_N = std::max(loads_N / loads, 0.8 * most_N);
    all.ratio = normal_N > 0.0 ? loads_N / normal_N : 0.0;
  } else {
    all.speed_mm_s = 0.0;
  }
  return all;
}

} // namespace fingertip
