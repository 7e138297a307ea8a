#include "grasp/control/finger.hpp"

extern "C" {
#include "common/contact_flags.h"
}

#include <algorithm>
#include <cmath>
#include <limits>

namespace fingertip {

namespace {

// A fingertip whose values stay the same to the last bit for this time and this number of frames is
// stuck: noise changes them with every frame.
constexpr double FROZEN_s = 0.05;
constexpr int FROZEN_FRAMES = 5;
constexpr double OLD_s = 0.5;        // an older frame is no evidence of the present
constexpr double DELAY_SHARE = 0.05; // weight of a frame in the moving average of the delay
constexpr int ZERO_FRAMES = 3;
// A force whose standard deviation is a larger share of it is no measurement.
constexpr double FORCE_SD_MOST = 1.0;
// A tangential force with one of these flags is not trusted.
constexpr std::uint32_t FORCE_ONLY = CONTACT_FLAG_UNCERTAIN | CONTACT_FLAG_FLAT | CONTACT_FLAG_AT_BOUND |
                                     CONTACT_FLAG_SATURATED | CONTACT_FLAG_ZERO_DOUBTFUL;
constexpr std::uint32_t OVER = CONTACT_FLAG_SATURATED | CONTACT_FLAG_FORCE_LOWER_BOUND;
// A contact with a larger sigma is a plate. Its Gaussian reaches far beyond the pad, so only the part
// of its force that lies on the pad counts. A block of 36 by 54 mm is such a plate.
constexpr double WIDE_mm = 15.0, PAD_mm2 = 1400.0;

double force_on_pad(const GripTouch &touch) {
  if ((touch.flags & CONTACT_FLAG_FIT_VALID) == 0 || touch.sigma_mm <= WIDE_mm) {
    return touch.force_N;
  }
  return touch.force_N * PAD_mm2 / (PAD_mm2 + 0.85 * 2.0 * M_PI * touch.sigma_mm * touch.sigma_mm);
}

bool force_is_valid(const GripTouch &touch) {
  if ((touch.flags & CONTACT_FLAG_CONTACT) == 0) {
    return true; // the force is 0
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
  const bool has_contact = (touch.flags & CONTACT_FLAG_CONTACT) != 0 && (touch.flags & CONTACT_FLAG_HELD) == 0;
  if (!is_heard_ || !has_contact || !is_same(touch_, touch)) {
    changed_s_ = touch.t_s;
    unchanged_ = 0;
  } else {
    unchanged_++;
  }
  touch_ = touch;
  is_heard_ = is_new_ = true;
  if (force_is_valid(touch)) {
    const bool contact = (touch.flags & CONTACT_FLAG_CONTACT) != 0;
    force_t_s_ = touch.t_s;
    force_N_ = contact ? std::max(force_on_pad(touch), 0.0) : 0.0;
    sd_N_ = (touch.flags & CONTACT_FLAG_UNCERTAINTY_VALID) != 0 ? touch.force_sd_N : 0.0;
  }
  if (has_load()) {
    sum_x_N_ += touch.qx_N;
    sum_y_N_ += touch.qy_N;
    sums_++;
  }
}

bool GripFinger::has_load() const {
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

bool GripFinger::has_zero() const { return !has_load() || sums_ >= ZERO_FRAMES; }

GripReading GripFinger::sample(double now_s, const GripSettings &settings) {
  GripReading reading;
  reading.fresh = is_new_;
  if (is_new_) {
    const double delay_s = std::max(now_s - touch_.t_s, 0.0);
    delay_s_ += (has_delay_ ? DELAY_SHARE : 1.0) * (delay_s - delay_s_);
    has_delay_ = true;
    heard_s_ = now_s;
    force_s_ = force_t_s_ == touch_.t_s ? now_s : force_s_;
    is_new_ = false;
  }
  const bool stale = !is_heard_ || now_s > heard_s_ + settings.stale_s || now_s > touch_.t_s + OLD_s;
  const bool frozen = !stale && unchanged_ >= FROZEN_FRAMES && touch_.t_s - changed_s_ >= FROZEN_s;
  const bool no_force = !stale && now_s > force_s_ + settings.stale_s;
  reading.trouble = (stale ? GRIP_FINGER_0_STALE : 0u) | (frozen ? GRIP_FINGER_0_FROZEN : 0u) |
                    (no_force ? GRIP_FINGER_0_NO_FORCE : 0u) |
                    (!stale && delay_s_ > settings.late_s ? GRIP_FINGER_0_LATE : 0u);
  reading.counts = !stale && !frozen;
  if (!reading.counts) {
    return reading;
  }
  reading.contact = (touch_.flags & CONTACT_FLAG_CONTACT) != 0;
  reading.over = (touch_.flags & OVER) != 0;
  reading.trouble |= reading.over ? GRIP_FINGER_0_OVER : 0u;
  reading.trouble |= reading.contact && (touch_.flags & FORCE_ONLY) != 0 ? GRIP_FINGER_0_FORCE_ONLY : 0u;
  reading.has_force = !no_force;
  reading.t_s = force_t_s_;
  reading.force_N = force_N_;
  reading.sd_N = sd_N_;
  reading.has_load = reading.contact && has_load();
  if (reading.has_load) {
    reading.load_N = std::hypot(touch_.qx_N - zero_x_N_, touch_.qy_N - zero_y_N_);
    reading.speed_mm_s = touch_.speed_mm_s;
  }
  // Eq. (7) mistakes a tangential force for a slide, so it counts only if there is no other evidence.
  const std::uint32_t slide = reading.has_load ? CONTACT_FLAG_SLIDING : CONTACT_FLAG_SLIP;
  reading.slides = reading.contact && (touch_.flags & slide) != 0;
  return reading;
}

GripReadings combine_readings(std::array<GripFinger, GRIP_FINGERS> &fingers, double now_s,
                              const GripSettings &settings) {
  GripReadings all;
  all.low_N = all.t_s = std::numeric_limits<double>::infinity();
  double loads_N = 0.0, most_N = 0.0, normal_N = 0.0;
  int loads = 0;
  all.speed_mm_s = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < fingers.size(); i++) {
    const GripReading reading = fingers[i].sample(now_s, settings);
    all.trouble |= reading.trouble << i;
    all.fresh = all.fresh || reading.fresh;
    all.over = all.over || reading.over;
    all.touches += reading.contact;
    all.slides = all.slides || reading.slides;
    all.delay_s = std::max(all.delay_s, reading.counts ? fingers[i].delay_s() : 0.0);
    if (reading.has_force) {
      all.fingers++;
      all.force_N[i] = reading.force_N;
      all.mean_N += reading.force_N;
      all.low_N = std::min(all.low_N, reading.force_N);
      all.high_N = std::max(all.high_N, reading.force_N);
      all.sd_N = std::max(all.sd_N, reading.sd_N);
      all.t_s = std::min(all.t_s, reading.t_s);
    }
    if (reading.has_load) {
      loads++;
      loads_N += reading.load_N;
      normal_N += reading.force_N;
      most_N = std::max(most_N, reading.load_N);
      all.speed_mm_s = std::min(all.speed_mm_s, reading.speed_mm_s);
    }
  }
  if (all.fingers == 0) {
    all.low_N = 0.0;
    all.t_s = now_s;
  } else {
    all.mean_N /= all.fingers;
  }
  // An object in the air presses on both alike, so the mean is the better estimate.
  all.grip_N = all.high_N - all.low_N > settings.differ * all.high_N ? all.low_N : all.mean_N;
  all.has_load = loads > 0;
  if (loads > 0) {
    // Both share the load; if one carries far more, that one slides first.
    all.load_N = std::max(loads_N / loads, 0.8 * most_N);
    all.ratio = normal_N > 0.0 ? loads_N / normal_N : 0.0;
  } else {
    all.speed_mm_s = 0.0;
  }
  return all;
}

} // namespace fingertip
