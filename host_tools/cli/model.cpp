#include "cli/model.hpp"

#include "cli/names_of_values.hpp"

#include <algorithm>

namespace fingertip {

namespace {

constexpr std::uint64_t RATE_SPAN_us = 1000000;
constexpr std::uint64_t TRAIL_SPAN_us = 1000000;
constexpr std::uint64_t SLIP_SHOWN_us = 150000;

} // namespace

void Model::take(const wire_packet &packet) {
  switch (packet.type) {
  case WIRE_CONTACT:
    take_frame(packet.t_us);
    take_contact(packet.body.contact, packet.t_us);
    break;
  case WIRE_RAW:
    take_frame(packet.t_us);
    if (!raw_ || !(packet.body.raw.flags & CONTACT_FLAG_HELD)) {
      raw_ = packet.body.raw;
    }
    break;
  case WIRE_INFO:
    info_ = packet.body.info;
    break;
  case WIRE_HEALTH:
    health_ = packet.body.health;
    break;
  default:
    break;
  }
}

void Model::take_frame(std::uint64_t t_us) {
  last_arrival_ = std::chrono::steady_clock::now();
  if (first_us_ && t_us == last_us_) {
    return; /* the other packet of the same frame */
  }
  if (first_us_ && t_us < last_us_) {
    before_restart_us_ += last_us_ - *first_us_;
    first_us_.reset();
    last_slip_us_.reset();
    recent_us_.clear();
    trail_.clear();
  }
  first_us_ = first_us_.value_or(t_us);
  last_us_ = t_us;
  frames_++;
  recent_us_.push_back(t_us);
  while (t_us - recent_us_.front() > RATE_SPAN_us) {
    recent_us_.pop_front();
  }
}

void Model::take_contact(const wire_contact &contact, std::uint64_t t_us) {
  contact_ = contact;
  bool slip = contact.flags & CONTACT_FLAG_SLIP;
  if (slip) {
    last_slip_us_ = t_us;
  }
  if (contact.flags & CONTACT_FLAG_FIT_VALID) {
    trail_.push_back({t_us, contact.x_mm, contact.y_mm});
  } else {
    trail_.clear();
  }
  while (!trail_.empty() && t_us - trail_.front().t_us > TRAIL_SPAN_us) {
    trail_.pop_front();
  }
  std::uint64_t interval = t_us / FORCE_INTERVAL_us;
  if (forces_.empty() || interval < force_interval_) {
    forces_.assign(1, {0, false});
  } else {
    for (std::uint64_t i = std::min<std::uint64_t>(interval - force_interval_, FORCE_INTERVALS);
         i > 0; i--) {
      forces_.push_back({0, false});
    }
  }
  force_interval_ = interval;
  while (forces_.size() > FORCE_INTERVALS) {
    forces_.pop_front();
  }
  forces_.back().peak_N = std::max(forces_.back().peak_N, contact.force_N);
  forces_.back().slip = forces_.back().slip || slip;
}

std::uint32_t Model::missing_sensors() const {
  return info_ && health_
             ? fingertip::missing_sensors(health_->sensors_present, info_->sensor_count)
             : 0;
}

bool Model::is_without_sensors() const {
  return info_ && info_->sensor_count > 0 &&
         missing_sensors() == fingertip::missing_sensors(0, info_->sensor_count);
}

double Model::seconds() const {
  return static_cast<double>(before_restart_us_ + (first_us_ ? last_us_ - *first_us_ : 0)) / 1e6;
}

double Model::frames_per_s() const {
  if (recent_us_.size() < 2) {
    return 0;
  }
  return static_cast<double>(recent_us_.size() - 1) * 1e6 /
         static_cast<double>(recent_us_.back() - recent_us_.front());
}

double Model::mean_frames_per_s() const {
  return frames_ > 1 && seconds() > 0 ? static_cast<double>(frames_ - 1) / seconds() : 0;
}

bool Model::slipped_lately() const {
  return last_slip_us_ && last_us_ - *last_slip_us_ <= SLIP_SHOWN_us;
}

std::optional<double> Model::seconds_since_frame() const {
  if (!last_arrival_) {
    return std::nullopt;
  }
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - *last_arrival_).count();
}

} // namespace fingertip
