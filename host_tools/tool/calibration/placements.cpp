#include "tool/calibration/placements.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip::calibrating {

constexpr double SLOT_s = 0.05;
constexpr double GAP_s = 0.5;
constexpr double KEEPS_s = 3.0;
constexpr double REST_s = 0.5;         /* of which the level before a contact is the mean */
constexpr double BEFORE_TOUCH_s = 0.1; /* the touch may have begun before it showed */
constexpr double STILL_s = 1.0, READ_FROM_s = 0.5;
/* Before this share of its height has been reached in a twentieth of a second, a contact moves. */
constexpr double MOVES = 0.05;
constexpr double RISING = 0.1; /* of TOUCH_Pa, in a twentieth of a second */
constexpr double LIFTED_SHARE = 0.1;
constexpr double SEEN_MIN = 0.8; /* share of the frames in which a sensor must have been measured */
constexpr double SLOTS_MIN = 5.0;
/* Rms noise of a frame: no sensor at any oversampling has more than 11 Pa (ms58xx.h). */
constexpr double NOISE_Pa = 11.0, NOISE_SDS = 4.0;
/* The largest of fifteen rms of ten readings is hardly ever beyond this many times the noise. */
constexpr double SWAY_NOISES = 2.5;

PlacementFinder::PlacementFinder(std::size_t sensors) : sensors_(sensors) { restart(); }

void PlacementFinder::restart() {
  state_ = State::resting;
  refusal_ = Refusal::none;
  begun_ = false;
  slots_.clear();
  open_ = Slot{};
  rest_Pa_.assign(sensors_, 0.0);
  above_Pa_.assign(sensors_, 0.0);
}

std::optional<Placement> PlacementFinder::take(const Frame &frame) {
  double t_s = frame.t_s + ahead_s_;
  if (begun_ && (t_s <= last_s_ || t_s > last_s_ + GAP_s)) {
    restart();
    if (t_s <= last_s_) {
      ahead_s_ += last_s_ + GAP_s - t_s;
      t_s = last_s_ + GAP_s;
    }
  }
  last_s_ = t_s;
  if (state_ == State::resting) {
    zero_Pa_ = frame.zero_Pa;
  }
  if (!begun_) {
    begun_ = true;
    rest_from_s_ = t_s;
  }
  std::optional<Placement> found;
  if (open_.frames > 0 && t_s >= open_.begin_s + SLOT_s) {
    found = close(open_);
    open_ = Slot{};
  }
  if (open_.frames == 0) {
    open_.begin_s = t_s;
    open_.counts.assign(sensors_, 0);
    open_.means.assign(sensors_, 0.0);
  }
  open_.frames++;
  for (std::size_t k = 0; k < sensors_; k++) {
    if (frame.valid >> k & 1u) {
      open_.counts[k]++;
      open_.means[k] += (frame.pressure_Pa[k] - frame.zero_Pa[k] - open_.means[k]) / open_.counts[k];
    }
  }
  return found;
}

/* Means over the slots that begin in this time; sensors that were measured often enough. */
std::vector<double> PlacementFinder::mean_of(double begin_s, double end_s, sensor_map *seen) const {
  std::vector<double> sums(sensors_, 0.0), counts(sensors_, 0.0);
  double frames = 0.0;
  for (const Slot &slot : slots_) {
    if (slot.begin_s >= begin_s - 1e-9 && slot.begin_s < end_s - 1e-9) {
      frames += slot.frames;
      for (std::size_t k = 0; k < sensors_; k++) {
        sums[k] += slot.means[k] * slot.counts[k];
        counts[k] += slot.counts[k];
      }
    }
  }
  *seen = 0;
  for (std::size_t k = 0; k < sensors_; k++) {
    sums[k] /= std::max(counts[k], 1.0);
    *seen |= counts[k] > 0.0 && counts[k] >= SEEN_MIN * frames ? sensor_bit(static_cast<unsigned>(k)) : 0;
  }
  return sums;
}

/* What the sensors read with nothing on the pad, by the time just before this. */
void PlacementFinder::find_rest(double t_s) {
  const double end_s = t_s - BEFORE_TOUCH_s;
  sensor_map seen = 0;
  const std::vector<double> mean = mean_of(std::max(end_s - REST_s, rest_from_s_), end_s, &seen);
  for (std::size_t k = 0; k < sensors_; k++) {
    if (seen >> k & 1u) {
      rest_Pa_[k] = mean[k];
    }
  }
}

std::optional<Placement> PlacementFinder::close(const Slot &slot) {
  if (std::all_of(slot.counts.begin(), slot.counts.end(), [](int count) { return count == 0; })) {
    return std::nullopt; /* all sensors were doubted: nothing is known of this time */
  }
  slots_.push_back(slot);
  while (slots_.front().begin_s < slot.begin_s - KEEPS_s) {
    slots_.pop_front();
  }
  const double t_s = slot.begin_s;
  if (state_ == State::resting) {
    find_rest(t_s);
  }
  double strongest = 0.0, change = 0.0, rise = 0.0;
  const Slot &before = slots_.size() > 1 ? slots_[slots_.size() - 2] : slot;
  for (std::size_t k = 0; k < sensors_; k++) {
    if (slot.counts[k] == 0) {
      continue;
    }
    above_Pa_[k] = slot.means[k] - rest_Pa_[k];
    strongest = std::max(strongest, above_Pa_[k]);
    if (before.counts[k] > 0) {
      rise = std::max(rise, slot.means[k] - before.means[k]);
      change = std::max(change, std::abs(slot.means[k] - before.means[k]));
    }
  }
  if (state_ == State::resting) {
    /* While it is being lifted readings are high, but fall. */
    if (strongest > TOUCH_Pa && rise > RISING * TOUCH_Pa) {
      state_ = State::settling;
      touch_s_ = moved_s_ = t_s;
      peak_Pa_ = strongest;
      refusal_ = Refusal::none;
    }
    return std::nullopt;
  }
  peak_Pa_ = std::max(peak_Pa_, strongest);
  if (strongest < std::max(0.5 * TOUCH_Pa, LIFTED_SHARE * peak_Pa_)) {
    state_ = State::resting;
    rest_from_s_ = t_s + 2.0 * SLOT_s; /* the rest of the lift is no rest */
    return std::nullopt;
  }
  if (state_ != State::settling) {
    return std::nullopt;
  }
  if (change > MOVES * strongest) {
    moved_s_ = t_s;
  }
  if (t_s < moved_s_ + STILL_s) {
    return std::nullopt;
  }
  return settled(t_s);
}

/* Judges the last half second. Where it was not still, the same is tried a slot later. */
std::optional<Placement> PlacementFinder::settled(double t_s) {
  const double begin_s = t_s - (STILL_s - READ_FROM_s);
  sensor_map seen = 0;
  const std::vector<double> mean = mean_of(begin_s, t_s, &seen);
  Placement placement;
  placement.t_s = 0.5 * (begin_s + t_s);
  placement.usable = seen;
  double peak = 0.0, sum = 0.0;
  for (std::size_t k = 0; k < sensors_; k++) {
    placement.rest_Pa.push_back(rest_Pa_[k] + zero_Pa_[k]);
    placement.reading_Pa.push_back(seen >> k & 1u ? mean[k] - rest_Pa_[k] : 0.0);
    peak = std::max(peak, placement.reading_Pa[k]);
    sum += std::max(placement.reading_Pa[k], 0.0);
  }
  /* A line through each sensor's slots: its change over the time, and what the line leaves. */
  double common = 0.0, sway = 0.0, left_squares = 0.0, left_count = 0.0;
  double frames = 0.0, slots = 0.0;
  std::vector<double> changes(sensors_, 0.0);
  for (std::size_t k = 0; k < sensors_; k++) {
    double count = 0.0, t1 = 0.0, p1 = 0.0, tt = 0.0, tp = 0.0, pp = 0.0;
    for (const Slot &slot : slots_) {
      if (slot.begin_s >= begin_s - 1e-9 && slot.begin_s < t_s - 1e-9 && slot.counts[k] > 0) {
        const double t = slot.begin_s - begin_s, off = slot.means[k] - mean[k];
        count += 1.0;
        t1 += t;
        p1 += off;
        tt += t * t;
        tp += t * off;
        pp += off * off;
      }
    }
    if (seen >> k & 1u && count >= SLOTS_MIN) {
      tt -= t1 * t1 / count;
      tp -= t1 * p1 / count;
      pp -= p1 * p1 / count;
      changes[k] = tp / tt * (t_s - begin_s);
      common += changes[k];
      const double left = std::max(pp - tp * tp / tt, 0.0);
      left_squares += left;
      left_count += count - 2.0;
      sway = std::max(sway, std::sqrt(left / (count - 2.0)));
    }
  }
  for (const Slot &slot : slots_) {
    if (slot.begin_s >= begin_s - 1e-9 && slot.begin_s < t_s - 1e-9) {
      frames += slot.frames;
      slots += 1.0;
    }
  }
  if (slots < SLOTS_MIN) {
    return std::nullopt;
  }
  /* With that of the level before. */
  placement.noise_Pa = std::sqrt(left_squares / std::max(left_count, 1.0) * 2.0 / slots);
  placement.fading = -common / std::max(sum, 1.0);
  double shift = 0.0;
  for (std::size_t k = 0; k < sensors_; k++) {
    const double share = std::max(placement.reading_Pa[k], 0.0) / std::max(sum, 1.0);
    shift = std::max(shift, std::abs(changes[k] - common * share));
  }
  const double noise = NOISE_Pa / std::sqrt(frames / slots);
  const bool still = std::abs(common) <= DECAY_MAX * sum + NOISE_SDS * noise && shift <= SHIFT_MAX * peak + NOISE_SDS * noise &&
                     sway <= SWAY_MAX * peak + SWAY_NOISES * noise;
  if (peak < LIGHT_Pa && still) {
    /* Rubber that comes back after a release is like that, too: the level to rest at now. */
    state_ = State::resting;
    rest_from_s_ = t_s;
    refusal_ = Refusal::light;
    return std::nullopt;
  }
  if (!still) {
    if (t_s > touch_s_ + LATE_s) {
      state_ = State::refused;
      refusal_ = Refusal::unsteady;
    }
    return std::nullopt;
  }
  state_ = State::taken;
  return placement;
}

} // namespace fingertip::calibrating
