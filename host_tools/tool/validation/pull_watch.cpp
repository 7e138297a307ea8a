#include "tool/validation/pull_watch.hpp"

#include "libfingertip/names.hpp"
#include "tool/validation/median.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace fingertip::validating {
namespace {

constexpr double KEEPS_s = 3.0, BEFORE_s = 1.0, BEFORE_TOUCH_s = 0.15;
constexpr double SETTLES_s = 0.5; /* after the touch */
constexpr double REST_s = 0.5, RESTS_ON_s = 1.0;
constexpr double PULL_s = 1.0, NOW_s = 0.1;

double product(const std::vector<double> &a, const std::vector<double> &b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

/* Of a, beside b. */
double difference(const std::vector<double> &a, const std::vector<double> &b) {
  if (a.empty() || b.empty() || !(product(a, a) > 0.0) || !(product(b, b) > 0.0)) {
    return 0.0;
  }
  const double cosine = product(a, b) / std::sqrt(product(a, a) * product(b, b));
  return std::sqrt(std::max(1.0 - cosine * cosine, 0.0));
}

} // namespace

Estimate estimate_of(const Contacts &contacts, double from_s, double to_s) {
  std::vector<double> x, y, force, qx, qy, q_sd;
  std::size_t warned = 0;
  for (const wire_packet &packet : contacts) {
    const double t_s = 1e-6 * static_cast<double>(packet.t_us);
    const wire_contact &contact = packet.body.contact;
    if (t_s < from_s || t_s > to_s || !(contact.flags & CONTACT_FLAG_FIT_VALID)) {
      continue;
    }
    x.push_back(static_cast<double>(contact.x_mm));
    y.push_back(static_cast<double>(contact.y_mm));
    force.push_back(static_cast<double>(contact.force_N));
    warned += (contact.flags & warning_flags()) != 0;
    if (contact.flags & CONTACT_FLAG_TANGENTIAL_VALID) {
      qx.push_back(static_cast<double>(contact.qx_N));
      qy.push_back(static_cast<double>(contact.qy_N));
      q_sd.push_back(static_cast<double>(contact.q_sd_N));
    }
  }
  Estimate estimate;
  estimate.frames = x.size();
  estimate.x_mm = upper_median(x);
  estimate.y_mm = upper_median(y);
  estimate.force_N = upper_median(force);
  estimate.warned = 2 * warned > x.size();
  estimate.pull_frames = qx.size();
  estimate.qx_N = upper_median(qx);
  estimate.qy_N = upper_median(qy);
  estimate.q_sd_N = upper_median(q_sd);
  return estimate;
}

std::vector<double> PullWatch::above(double from_s, double to_s) const {
  std::vector<double> sums, counts;
  for (const calibrating::Frame &frame : frames_) {
    if (frame.t_s < from_s || frame.t_s > to_s) {
      continue;
    }
    sums.resize(frame.pressure_Pa.size(), 0.0);
    counts.resize(frame.pressure_Pa.size(), 0.0);
    for (std::size_t k = 0; k < sums.size(); k++) {
      if (frame.valid >> k & 1u) {
        sums[k] += frame.pressure_Pa[k];
        counts[k] += 1.0;
      }
    }
  }
  for (std::size_t k = 0; k < sums.size(); k++) {
    const double before_Pa = before_Pa_.empty() ? 0.0 : before_Pa_[k];
    sums[k] = counts[k] > 0.0 ? sums[k] / counts[k] - before_Pa : 0.0;
  }
  return sums;
}

void PullWatch::look_for_rest(double t_s, const Contacts &contacts) {
  const double to_s = t_s - RESTS_ON_s, from_s = to_s - REST_s;
  if (from_s < touched_s_ + SETTLES_s) {
    return;
  }
  const std::vector<double> rest_Pa = above(from_s, to_s);
  if (difference(above(to_s, to_s + 0.5 * RESTS_ON_s), rest_Pa) < STILL_SHAPE &&
      difference(above(t_s - NOW_s, t_s), rest_Pa) < STILL_SHAPE) {
    rest_Pa_ = rest_Pa;
    rest_ = estimate_of(contacts, from_s, to_s);
    state_ = State::resting;
  }
}

bool PullWatch::take(const calibrating::Frame &frame, bool is_free, const Contacts &contacts) {
  const double t_s = frame.t_s;
  frames_.push_back(frame);
  while (frames_.front().t_s < t_s - KEEPS_s) {
    frames_.pop_front();
  }
  if (state_ == State::taken) {
    return false;
  }
  if (is_free) {
    state_ = State::free;
    return false;
  }
  if (state_ == State::free) {
    before_Pa_.clear();
    before_Pa_ = above(t_s - BEFORE_s, t_s - BEFORE_TOUCH_s);
    rest_Pa_.clear();
    touched_s_ = t_s;
    state_ = before_Pa_.empty() ? State::free : State::settling;
    return false;
  }
  if (state_ == State::settling) {
    look_for_rest(t_s, contacts);
    return false;
  }
  const double changed = difference(above(t_s - NOW_s, t_s), rest_Pa_);
  if (state_ == State::resting) {
    if (changed > PULLED_SHAPE) {
      state_ = State::pulled;
      pulled_s_ = t_s;
    } else {
      look_for_rest(t_s, contacts);
    }
    return false;
  }
  if (changed < 0.5 * PULLED_SHAPE) {
    state_ = State::resting;
    return false;
  }
  const std::vector<double> last_Pa = above(t_s - 0.5 * PULL_s, t_s);
  if (t_s < pulled_s_ + PULL_s + NOW_s || difference(above(t_s - PULL_s, t_s - 0.5 * PULL_s), last_Pa) > STILL_SHAPE) {
    return false;
  }
  pull_ = estimate_of(contacts, t_s - PULL_s, t_s);
  state_ = State::taken;
  return true;
}

} // namespace fingertip::validating
