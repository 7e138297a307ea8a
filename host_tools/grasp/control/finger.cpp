#include "grasp/control/finger.hpp"

#include "grasp/control/reach.hpp"

extern "C" {
#include "common/contact_flags.h"
}

#include <limits>

namespace fingertip {

constexpr int FROZEN_FRAMES = 5;     // with the same values to the last bit: it is stuck, since noise changes them with every frame
constexpr double OLD_s = 0.5;        // an older frame is no evidence of the present
constexpr double DELAY_SHARE = 0.05; // weight of a frame in the moving average of the delay
constexpr int ZERO_FRAMES = 3;
constexpr double LOAD_SD_LEAST_N = 0.06;
constexpr double SHARED_N = 0.3; // a load whose share of both has a meaning
constexpr double SURE_SDS = 2.0;
// A force whose standard deviation is a larger share of it is no measurement. That of a long or wide contact is measured: only how far it
// reaches beyond the pad is not.
constexpr double FORCE_SD_MOST = 1.0, WIDE_mm = 15.0;
// A tangential force with one of these flags is not trusted.
constexpr std::uint32_t FORCE_ONLY =
    CONTACT_FLAG_UNCERTAIN | CONTACT_FLAG_FLAT | CONTACT_FLAG_AT_BOUND | CONTACT_FLAG_SATURATED | CONTACT_FLAG_ZERO_DOUBTFUL;
// A place with one of these flags is not trusted. UNCERTAIN is: the place may have moved under the tangential force that it shows.
constexpr std::uint32_t NO_PLACE = FORCE_ONLY & ~std::uint32_t{CONTACT_FLAG_UNCERTAIN};
// A tangential force as large as the normal one moves the middle of what the pad bears of the Gaussian by about this way, x and y, on
// 12 mm of rubber, whatever the shape, but along a contact as long as the pad by less (unit.cell.face).
constexpr double PULLED_x_mm = 3.5, PULLED_y_mm = 4.2, LONG_mm = 14.0;
constexpr double PULLS_s = 0.025, LEAPS = 0.5, GROWS = 1.25; // one frame alone shows no pull
constexpr double PLACE_SD = 0.2;                             // of a load by the place
// Share of what one place alone shows that is load at least: fingertips may be mounted another way than assumed.
constexpr double ALONE = 0.33;
// A place that moves by less than this a second, ratio of forces, drifts: rubber creeps. Further than DRIFT at once is a load.
constexpr double DRIFTS_1_s = 5e-4, DRIFT = 0.02;
constexpr double SLIDES_mm_s = 1.0;
constexpr std::uint32_t OVER = CONTACT_FLAG_SATURATED | CONTACT_FLAG_FORCE_LOWER_BOUND;
// Half of the pad, with its rubber beyond the outer sensors.
constexpr double PAD_x_mm = 18.0, PAD_y_mm = 27.0;

GripTouch touch_from_packet(const wire_packet &packet, double host_us) {
  const wire_contact &contact = packet.body.contact;
  const std::uint32_t flags = contact.flags;
  const auto under = [flags](contact_flag flag, float value) {
    return (flags & flag) != 0 && std::isfinite(value) ? static_cast<double>(value) : 0.0;
  };
  GripTouch touch;
  touch.t_s = 1e-6 * std::max(host_us, 0.0);
  touch.flags = flags;
  touch.force_N = under(CONTACT_FLAG_FIT_VALID, contact.force_N);
  touch.x_mm = under(CONTACT_FLAG_FIT_VALID, contact.x_mm);
  touch.y_mm = under(CONTACT_FLAG_FIT_VALID, contact.y_mm);
  touch.force_sd_N = under(CONTACT_FLAG_UNCERTAINTY_VALID, contact.force_sd_N);
  touch.sigma_mm = under(CONTACT_FLAG_FIT_VALID, contact.sigma_mm);
  touch.qx_N = under(CONTACT_FLAG_TANGENTIAL_VALID, contact.qx_N);
  touch.qy_N = under(CONTACT_FLAG_TANGENTIAL_VALID, contact.qy_N);
  touch.q_sd_N = under(CONTACT_FLAG_TANGENTIAL_VALID, contact.q_sd_N);
  touch.speed_x_mm_s = under(CONTACT_FLAG_VELOCITY_VALID, contact.vx_mm_s);
  touch.speed_y_mm_s = under(CONTACT_FLAG_VELOCITY_VALID, contact.vy_mm_s);
  return touch;
}

// What the pad bears of a Gaussian along one axis: its share of the whole, and its middle.
struct Borne {
  double share, middle_mm;
};
static Borne borne(double at_mm, double sigma_mm, double half_mm) {
  const double low = (-half_mm - at_mm) / sigma_mm, high = (half_mm - at_mm) / sigma_mm;
  const double share = 0.5 * (std::erf(high * M_SQRT1_2) - std::erf(low * M_SQRT1_2));
  const double peak_mm = sigma_mm / std::sqrt(2.0 * M_PI);
  const double moved_mm = peak_mm * (std::exp(-0.5 * low * low) - std::exp(-0.5 * high * high)) / std::max(share, 1e-6);
  return {share, std::clamp(at_mm + moved_mm, -half_mm, half_mm)};
}

// A contact that is not round, or whose tangential force is not known, counts as far as the pad bears it.
static GripTouch on_pad(GripTouch touch) {
  if ((touch.flags & CONTACT_FLAG_FIT_VALID) != 0 && (touch.flags & CONTACT_FLAG_TANGENTIAL_VALID) == 0) {
    const double sigma_mm = std::max(touch.sigma_mm, 1.0);
    const Borne x = borne(touch.x_mm, sigma_mm, PAD_x_mm), y = borne(touch.y_mm, sigma_mm, PAD_y_mm);
    touch.force_N *= x.share * y.share;
    touch.x_mm = x.middle_mm;
    touch.y_mm = y.middle_mm;
  }
  return touch;
}

static bool force_is_valid(const GripTouch &touch) {
  const bool is_none = (touch.flags & CONTACT_FLAG_CONTACT) == 0; // the force is 0
  const bool is_long = (touch.flags & CONTACT_FLAG_ELONGATED) != 0 || touch.sigma_mm > WIDE_mm;
  const bool is_sure = (touch.flags & CONTACT_FLAG_UNCERTAINTY_VALID) == 0 || touch.force_sd_N <= FORCE_SD_MOST * touch.force_N;
  return is_none || ((touch.flags & CONTACT_FLAG_FIT_VALID) != 0 && (is_long || is_sure));
}

static bool is_same(const GripTouch &a, const GripTouch &b) {
  return a.force_N == b.force_N && a.force_sd_N == b.force_sd_N && a.x_mm == b.x_mm && a.y_mm == b.y_mm && a.qx_N == b.qx_N &&
         a.qy_N == b.qy_N;
}

void GripFinger::take(const GripTouch &touch) {
  if (is_heard_ && touch.t_s <= touch_.t_s) {
    return;
  }
  const bool has_fit = (touch.flags & CONTACT_FLAG_FIT_VALID) != 0 && (touch.flags & CONTACT_FLAG_HELD) == 0; // else values are 0
  unchanged_ = is_heard_ && has_fit && is_same(came_, touch) ? unchanged_ + 1 : 0;
  came_ = touch;
  touch_ = on_pad(touch);
  is_heard_ = is_new_ = true;
  if (force_is_valid(touch)) {
    const bool contact = (touch.flags & CONTACT_FLAG_CONTACT) != 0;
    force_t_s_ = touch.t_s;
    force_N_ = contact ? std::max(touch_.force_N, 0.0) : 0.0;
    sd_N_ = (touch.flags & CONTACT_FLAG_UNCERTAINTY_VALID) != 0 ? touch.force_sd_N : 0.0;
  }
  if (has_load()) {
    load_zero_.take(touch.qx_N, touch.qy_N);
  }
  if (has_fit && (touch.flags & (NO_PLACE | CONTACT_FLAG_TANGENTIAL_VALID)) == 0) {
    follow_place();
  }
}

void GripFinger::follow_place() {
  const double passed_s = std::max(touch_.t_s - place_t_s_, 1e-6);
  // The same load moves a place less at a larger force; one frame alone shows no force either.
  const double keeps = std::clamp(place_N_ / std::max(force_N_, 1e-3), 1.0 / GROWS, GROWS);
  place_t_s_ = touch_.t_s;
  place_N_ = force_N_;
  if (!place_zero_.is_known) {
    place_zero_.take(touch_.x_mm, touch_.y_mm);
    pulled_x_ = pulled_y_ = 0.0;
    return;
  }
  const double share = std::min(passed_s / PULLS_s, 1.0);
  const auto follow = [=](double &pulled, double moved) {
    pulled *= keeps;
    pulled += share * std::clamp(moved - pulled, -LEAPS, LEAPS);
  };
  follow(pulled_x_, (touch_.x_mm - place_zero_.x) / PULLED_x_mm);
  follow(pulled_y_, (touch_.y_mm - place_zero_.y) / (PULLED_y_mm * std::min(LONG_mm / std::max(touch_.sigma_mm, 1.0), 1.0)));
}

void GripPlaceLoad::take(double now_s, double to_x, double to_y, double force_N, double sticks) {
  if (now_s <= t_s) {
    return;
  }
  const double passed_s = now_s - t_s, share = std::min(passed_s / PULLS_s, 1.0);
  t_s = now_s;
  const double off_x = to_x - slid_x - held_x_N / force_N, off_y = to_y - slid_y - held_y_N / force_N;
  const double off = std::max(std::hypot(off_x, off_y), 1e-9), drifts = std::min(DRIFTS_1_s * passed_s / off, 1.0);
  const double held = std::max(1.0 - DRIFT / off, 0.0) * force_N;
  slid_x += drifts * off_x, slid_y += drifts * off_y;
  held_x_N += held * off_x, held_y_N += held * off_y;
  x = to_x - slid_x, y = to_y - slid_y;
  const double slid = std::max(1.0 - sticks / std::max(std::hypot(x, y), 1e-9), 0.0);
  speed_mm_s += share * (slid * std::hypot(x * PULLED_x_mm, y * PULLED_y_mm) / passed_s - speed_mm_s);
  slid_x += slid * x, slid_y += slid * y;
  x *= 1.0 - slid, y *= 1.0 - slid;
}

bool GripFinger::has_load() const { return (touch_.flags & CONTACT_FLAG_TANGENTIAL_VALID) != 0 && (touch_.flags & FORCE_ONLY) == 0; }

bool GripFinger::has_zero() const { return !has_load() || load_zero_.frames >= ZERO_FRAMES; }

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
  const bool frozen = !stale && unchanged_ >= FROZEN_FRAMES;
  const bool no_force = !stale && now_s > force_s_ + settings.stale_s;
  reading.trouble = (stale ? GRIP_FINGER_0_STALE : 0u) | (frozen ? GRIP_FINGER_0_FROZEN : 0u) | (no_force ? GRIP_FINGER_0_NO_FORCE : 0u) |
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
  const bool has_place = touch_.t_s < place_t_s_ + settings.stale_s && (place_zero_.is_known || !is_zeroed_);
  reading.by_place = reading.contact && !reading.has_load && has_place;
  if (reading.has_load) {
    reading.moved_x_N = reading.load_x_N = touch_.qx_N - load_zero_.x;
    reading.moved_y_N = reading.load_y_N = touch_.qy_N - load_zero_.y;
    reading.load_sd_N = std::max(touch_.q_sd_N, LOAD_SD_LEAST_N);
    reading.load_N = std::hypot(reading.load_x_N, reading.load_y_N);
    const double along = touch_.speed_x_mm_s * reading.load_x_N + touch_.speed_y_mm_s * reading.load_y_N;
    reading.speed_mm_s = reading.load_N > SHARED_N ? along / reading.load_N : std::hypot(touch_.speed_x_mm_s, touch_.speed_y_mm_s);
    // What carries no load does not slide, whatever the rubber does.
    reading.slides = (touch_.flags & CONTACT_FLAG_SLIDING) != 0 && reading.load_N > SURE_SDS * reading.load_sd_N;
  } else if (reading.by_place) {
    reading.pulled_x = pulled_x_;
    reading.pulled_y = pulled_y_;
  }
  return reading;
}

using Readings = std::array<GripReading, GRIP_FINGERS>;

// Where no fingertip has a load. What both places have in common is the load: an object that tilts moves them apart. While one of them is
// not there, or doubted, the other shows it as far apart from it as before.
static void load_by_place(Readings &readings, const std::array<GripFinger, GRIP_FINGERS> &fingers, const GripSettings &settings,
                          GripPlaceLoad &place) {
  double t_s = 0.0, x = 0.0, y = 0.0, force_N = 0.0;
  int there = 0;
  bool all = true;
  for (std::size_t i = 0; i < readings.size(); i++) {
    GripReading &reading = readings[i];
    if (reading.has_load) {
      return;
    }
    all = all && (reading.by_place || !reading.counts);
    reading.by_place = reading.by_place && reading.has_force && !fingers[i].is_doubted();
    if (reading.by_place) {
      there++;
      reading.pulled_x *= i == 0 ? 1.0 : -1.0;
      t_s = std::max(t_s, reading.t_s);
      x += reading.pulled_x;
      y += reading.pulled_y;
      force_N += reading.force_N;
      place.take_alone(reading.pulled_x, reading.pulled_y, reading.force_N);
    }
  }
  if (there == 0 || !(all || place.is_known)) {
    return;
  }
  if (there == 2) {
    place.apart_x = 0.5 * (readings[0].pulled_x - readings[1].pulled_x);
    place.apart_y = 0.5 * (readings[0].pulled_y - readings[1].pulled_y);
    place.is_known = true;
  }
  const double side = there == 2 ? 0.0 : readings[0].by_place ? 1.0 : -1.0;
  place.take(t_s, x / there - side * place.apart_x, y / there - side * place.apart_y, std::max(force_N / there, settings.touch_N),
             std::min(settings.friction, PLACE_STICKS));
  for (GripReading &reading : readings) {
    if (reading.by_place) {
      reading.has_load = true;
      reading.load_x_N = place.x * reading.force_N;
      reading.load_y_N = place.y * reading.force_N;
      reading.moved_x_N = reading.load_x_N + place.slid_x * reading.force_N;
      reading.moved_y_N = reading.load_y_N + place.slid_y * reading.force_N;
      reading.load_N = std::max(std::hypot(reading.load_x_N, reading.load_y_N), ALONE * place.alone_N);
      reading.load_sd_N = std::max(PLACE_SD * reading.load_N, LOAD_SD_LEAST_N);
      reading.speed_mm_s = place.speed_mm_s;
      reading.slides = reading.speed_mm_s > SLIDES_mm_s;
    }
  }
}

// Replaces a reading that is doubted by the last one that was believed, or leaves the fingertip out.
static void judge(std::array<GripFinger, GRIP_FINGERS> &fingers, Readings &readings, const GripSettings &settings, const GripReach &reach) {
  std::array<bool, GRIP_FINGERS> explained{}, lasts{};
  for (std::size_t i = 0; i < fingers.size(); i++) {
    const GripReading &reading = readings[i], &before = fingers[i].believed();
    lasts[i] = fingers[i].doubted_for_s(reading) >= settings.stale_s;
    explained[i] = reading.has_force && !lasts[i] && reach.explains(before.force_N, before.t_s, reading.force_N, reading.t_s, settings);
  }
  const bool both = readings[0].has_force && readings[1].has_force;
  const double differ_N = std::abs(readings[0].force_N - readings[1].force_N);
  const double alike_N = settings.alike_N(std::max(readings[0].force_N, readings[1].force_N));
  // Both are squeezed, or gone.
  const bool together = both && !lasts[0] && !lasts[1] && !explained[0] && !explained[1] && differ_N <= alike_N;
  for (std::size_t i = 0; i < fingers.size(); i++) {
    GripReading &reading = readings[i];
    if (!reading.has_force) {
      continue;
    }
    const bool alone = !both || !explained[1 - i];
    // What was left out comes back where it clearly agrees.
    if (explained[i] || together || (lasts[i] && (alone || differ_N <= 0.5 * alike_N))) {
      fingers[i].believe(reading);
      continue;
    }
    fingers[i].doubt(reading);
    if (lasts[i]) {
      const bool empty = !reading.contact && readings[1 - i].force_N > 2.0 * settings.touch_N;
      reading.trouble |= empty ? GRIP_FINGER_0_EMPTY : 0u;
      reading.has_force = reading.has_load = reading.slides = false;
      reading.is_left_out = true;
    } else {
      const std::uint32_t trouble = reading.trouble;
      reading = fingers[i].believed();
      reading.trouble = trouble;
      reading.fresh = false;
    }
  }
}

GripReadings combine_readings(std::array<GripFinger, GRIP_FINGERS> &fingers, double now_s, const GripSettings &settings,
                              const GripReach *held, GripPlaceLoad &place) {
  Readings readings;
  for (std::size_t i = 0; i < fingers.size(); i++) {
    readings[i] = fingers[i].sample(now_s, settings);
  }
  load_by_place(readings, fingers, settings, place);
  if (held != nullptr) {
    judge(fingers, readings, settings, *held);
  } else {
    for (std::size_t i = 0; i < fingers.size(); i++) {
      fingers[i].believe(readings[i]);
    }
  }
  GripReadings all;
  all.low_N = all.t_s = all.speed_mm_s = std::numeric_limits<double>::infinity();
  double loads_N = 0.0, most_N = 0.0, normal_N = 0.0;
  int loads = 0, marked = 0;
  for (std::size_t i = 0; i < fingers.size(); i++) {
    const GripReading &reading = readings[i];
    all.trouble |= reading.trouble << i;
    all.fresh = all.fresh || reading.fresh;
    all.over = all.over || reading.over;
    all.touches += reading.contact;
    all.slides = all.slides || reading.slides;
    if (fingers[i].is_marked(reading)) {
      all.keeps = marked == 0 ? fingers[i].keeps(reading) : std::max(all.keeps, fingers[i].keeps(reading));
      all.pull_N = marked == 0 ? fingers[i].pull_N(reading) : std::min(all.pull_N, fingers[i].pull_N(reading));
      marked++;
    }
    all.delay_s = std::max(all.delay_s, reading.counts ? fingers[i].delay_s() : 0.0);
    all.trouble |= reading.is_left_out ? GRIP_FINGERS_DIFFER : 0u;
    all.force_N[i] = reading.has_force || reading.is_left_out ? reading.force_N : 0.0;
    if (reading.has_force) {
      all.fingers++;
      all.mean_N += reading.force_N;
      all.low_N = std::min(all.low_N, reading.force_N);
      all.high_N = std::max(all.high_N, reading.force_N);
      all.sd_N = std::max(all.sd_N, reading.sd_N);
      all.t_s = std::min(all.t_s, reading.t_s);
    }
    if (reading.has_load) {
      loads++;
      all.by_place = reading.by_place;
      loads_N += reading.load_N;
      all.load_sd_N = std::max(all.load_sd_N, reading.load_sd_N);
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
  // An object in the air presses on both alike, so the mean is the better estimate. The further they differ, the less is believed.
  all.grip_N = std::max(all.low_N, all.mean_N - std::max(all.high_N - all.low_N - settings.differ * all.high_N, 0.0));
  all.has_load = loads > 0;
  if (loads > 0) {
    // Both share the load; if one carries far more, that one slides first.
    all.load_N = std::max(loads_N / loads, 0.8 * most_N);
    for (std::size_t i = 0; i < fingers.size(); i++) {
      if (loads == 2 && readings[i].load_N > SHARED_N) {
        fingers[i].shares(readings[i].load_N, all.load_N);
      } else if (loads == 1 && readings[i].has_load) {
        all.load_N = loads_N = fingers[i].load_of_both_N(all.load_N);
      }
    }
    all.ratio = normal_N > 0.0 ? loads_N / normal_N : 0.0;
  } else {
    all.speed_mm_s = 0.0;
  }
  all.slides = all.slides && all.speed_mm_s > 0.0;
  return all;
}

} // namespace fingertip
