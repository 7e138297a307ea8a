#include "tool/validation/gather.hpp"

#include "tool/calibration/gain_session.hpp"
#include "tool/validation/median.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip::validating {
namespace {

constexpr double KEEPS_s = 3.0;      /* of contacts */
constexpr double HALF_READ_s = 0.25; /* of a placement's readings, about its time */
constexpr double BEFORE_s = 1.0, BEFORE_TOUCH_s = 0.15;
constexpr double EARLY_s = 1.0, HALF_MEAN_s = 0.5;
constexpr double TENTH_s = 0.1, HELD_MIN_s = 5.0;
/* Every press is of one weight: what is felt by so much less than the median one is rubber that
 * comes back after the press before. On the twin's rubber of 8 mm that was 0.02 of the median
 * force, and a press 0.8 at least (newcomer_validated --fault thin_skin --seed 403). */
constexpr double SAME_WEIGHT = 0.2;
constexpr double LIFTING_s = 0.2; /* the weight may lighten before it shows as lifted */

double felt_Pa(const calibrating::Placement &placement) {
  double sum_Pa = 0.0;
  for (double reading_Pa : placement.reading_Pa) {
    sum_Pa += std::max(reading_Pa, 0.0);
  }
  return sum_Pa;
}

bool is_same_weight(const calibrating::Placement &placement, const std::vector<Press> &before) {
  std::vector<double> felt;
  for (const Press &press : before) {
    felt.push_back(felt_Pa(press.placement));
  }
  return felt.empty() || felt_Pa(placement) >= SAME_WEIGHT * upper_median(felt);
}

} // namespace

Gatherer::Gatherer(const wire_info &info)
    : finder_(calibrating::array_of(info).sensors()), valid_frames_(info.sensor_count, 0) {
  measured_.info = info;
  measured_.array = calibrating::array_of(info);
}

void Gatherer::step(const Step &step) {
  if (step_.kind == Step::Kind::empty) {
    finish_empty();
  } else if (step_.kind == Step::Kind::rest) {
    finish_hold();
  }
  switch (step.kind) {
  case Step::Kind::begin:
    measured_.weight_g = step.weight_g;
    measured_.skin_mm = step.skin_mm;
    break;
  case Step::Kind::take_back:
    if (step_.kind == Step::Kind::pull) {
      measured_.pulls.resize(std::max<std::size_t>(measured_.pulls.size(), 1) - 1);
    } else if (!measured_.presses.empty()) {
      measured_.presses.pop_back();
    }
    return; /* the step is what it was */
  case Step::Kind::hold:
  case Step::Kind::empty:
    rows_.clear();
    touched_.reset();
    released_.reset();
    break;
  case Step::Kind::pull:
    measured_.pulls_asked++;
    pull_watch_ = PullWatch();
    break;
  case Step::Kind::end:
    measured_.ended = true;
    break;
  case Step::Kind::press:
  case Step::Kind::rest:
    break;
  }
  step_ = step;
  step_s_ = last_s_;
}

void Gatherer::packet(const wire_packet &packet) {
  has_done_ = false;
  if (packet.type == WIRE_CONTACT) {
    contacts_.push_back(packet);
    while (contacts_.front().t_us + static_cast<std::uint64_t>(1e6 * KEEPS_s) < packet.t_us) {
      contacts_.pop_front();
    }
  } else if (packet.type == WIRE_RAW && packet.body.raw.sensor_count == valid_frames_.size() &&
             !(packet.body.raw.flags & CONTACT_FLAG_HELD)) {
    raw(packet);
  }
}

void Gatherer::raw(const wire_packet &packet) {
  const calibrating::Frame frame = calibrating::frame_of(packet);
  last_s_ = frame.t_s;
  if (step_.kind == Step::Kind::end && measured_.frames == 0) {
    return; /* before the first step */
  }
  measured_.frames++;
  for (std::size_t k = 0; k < valid_frames_.size(); k++) {
    valid_frames_[k] += packet.body.raw.valid >> k & 1u;
  }
  const bool was_resting = finder_.state() == calibrating::PlacementFinder::State::resting;
  auto found = finder_.take(frame);
  if (step_.kind == Step::Kind::press && found && is_same_weight(*found, measured_.presses)) {
    Press press;
    press.mark = step_.mark;
    press.at = step_.at;
    press.placement = std::move(*found);
    press.estimate = estimate_of(contacts_, press.placement.t_s - HALF_READ_s, press.placement.t_s + HALF_READ_s);
    measured_.presses.push_back(std::move(press));
    has_done_ = true;
  } else if (step_.kind == Step::Kind::pull) {
    const bool is_free = finder_.state() == calibrating::PlacementFinder::State::resting;
    if (pull_watch_.take(frame, is_free, contacts_)) {
      measured_.pulls.push_back({step_.toward_deg, step_.pulling, pull_watch_.rest(), pull_watch_.pull()});
      has_done_ = true;
    }
  } else if (step_.kind == Step::Kind::empty || step_.kind == Step::Kind::hold || step_.kind == Step::Kind::rest) {
    rows_.push_back({frame.t_s, frame.valid, frame.pressure_Pa});
    if (step_.kind != Step::Kind::empty) {
      follow_hold(was_resting);
    } else if (finder_.state() != calibrating::PlacementFinder::State::resting) {
      rows_.clear(); /* something touched it: it begins again */
      step_s_ = last_s_;
    }
  }
}

void Gatherer::follow_hold(bool was_resting) {
  const bool rests = finder_.state() == calibrating::PlacementFinder::State::resting;
  if (was_resting && !rests && !touched_) {
    touched_ = last_s_;
  } else if (!was_resting && rests && touched_ && !released_) {
    if (last_s_ - *touched_ < HELD_MIN_s) {
      touched_.reset(); /* rubber that comes back, or a hand */
    } else {
      released_ = last_s_;
    }
  }
}

std::vector<double> Gatherer::mean(double from_s, double to_s) const {
  std::vector<double> sums(valid_frames_.size(), 0.0), counts(valid_frames_.size(), 0.0);
  std::size_t rows = 0;
  for (const Row &row : rows_) {
    if (row.t_s >= from_s && row.t_s < to_s) {
      rows++;
      for (std::size_t k = 0; k < sums.size(); k++) {
        if (row.valid >> k & 1u) {
          counts[k] += 1.0;
          sums[k] += row.pressure_Pa[k];
        }
      }
    }
  }
  if (rows == 0) {
    return {};
  }
  for (std::size_t k = 0; k < sums.size(); k++) {
    sums[k] /= std::max(counts[k], 1.0);
  }
  return sums;
}

void Gatherer::finish_empty() {
  if (rows_.size() < 2) {
    return;
  }
  Empty empty;
  const double begin_s = rows_.front().t_s;
  empty.seconds = rows_.back().t_s - begin_s;
  for (std::size_t k = 0; k < valid_frames_.size(); k++) {
    double n = 0.0, t1 = 0.0, p1 = 0.0, tt = 0.0, tp = 0.0, pp = 0.0, first_Pa = 0.0;
    for (const Row &row : rows_) {
      if (row.valid >> k & 1u) {
        first_Pa = n > 0.0 ? first_Pa : row.pressure_Pa[k];
        const double t = row.t_s - begin_s, p = row.pressure_Pa[k] - first_Pa;
        n += 1.0;
        t1 += t;
        p1 += p;
        tt += t * t;
        tp += t * p;
        pp += p * p;
      }
    }
    const double time = tt - t1 * t1 / std::max(n, 1.0), both = tp - t1 * p1 / std::max(n, 1.0);
    const double slope = n > 2.0 ? both / time : 0.0;
    const double left = pp - p1 * p1 / std::max(n, 1.0) - slope * both;
    empty.drift_Pa_min.push_back(60.0 * slope);
    empty.noise_Pa.push_back(n > 2.0 ? std::sqrt(std::max(left, 0.0) / (n - 2.0)) : 0.0);
  }
  std::vector<double> first;
  for (double t = 0.0; t + 1.0 <= empty.seconds; t += 1.0) {
    std::vector<double> now = mean(begin_s + t, begin_s + t + 1.0);
    if (now.empty()) {
      continue;
    }
    first = first.empty() ? now : first;
    for (std::size_t k = 0; k < now.size(); k++) {
      now[k] -= first[k];
    }
    empty.seconds_Pa.push_back(std::move(now));
  }
  measured_.empty = std::move(empty);
  rows_.clear();
}

void Gatherer::finish_hold() {
  if (!touched_ || !released_) {
    return;
  }
  Hold hold;
  const double end_s = *released_ - LIFTING_s;
  hold.held_s = end_s - *touched_;
  const std::vector<double> before = mean(*touched_ - BEFORE_s, *touched_ - BEFORE_TOUCH_s);
  if (before.empty()) {
    return;
  }
  const auto above = [&](double from_s, double to_s) {
    std::vector<double> now = mean(from_s, to_s);
    for (std::size_t k = 0; k < now.size(); k++) {
      now[k] -= before[k];
    }
    return now;
  };
  hold.early_Pa = above(*touched_ + EARLY_s - HALF_MEAN_s, *touched_ + EARLY_s + HALF_MEAN_s);
  hold.late_Pa = above(end_s - 2.0 * HALF_MEAN_s, end_s);
  if (hold.early_Pa.empty() || hold.late_Pa.empty()) {
    return;
  }
  for (Hold::After &after : hold.after) {
    const double at_s = *released_ + after.after_s;
    if (last_s_ >= at_s + HALF_MEAN_s) {
      after.left_Pa = above(at_s - HALF_MEAN_s, at_s + HALF_MEAN_s);
    }
  }
  double sum_Pa = 0.0, rows = 0.0, from_s = rows_.front().t_s;
  for (const Row &row : rows_) {
    if (row.t_s >= from_s + TENTH_s && rows > 0.0) {
      hold.sum_Pa.push_back({from_s - *touched_, sum_Pa / rows});
      from_s = row.t_s;
      sum_Pa = rows = 0.0;
    }
    for (std::size_t k = 0; k < before.size(); k++) {
      sum_Pa += row.valid >> k & 1u ? row.pressure_Pa[k] - before[k] : 0.0;
    }
    rows += 1.0;
  }
  measured_.hold = std::move(hold);
}

Measured Gatherer::finish() {
  if (step_.kind == Step::Kind::empty) {
    finish_empty();
  } else if (!measured_.hold) {
    finish_hold();
  }
  for (std::size_t frames : valid_frames_) {
    measured_.answered.push_back(measured_.frames ? double(frames) / double(measured_.frames) : 0.0);
  }
  return std::move(measured_);
}

} // namespace fingertip::validating
