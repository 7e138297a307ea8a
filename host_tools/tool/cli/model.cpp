#include "tool/cli/model.hpp"

#include "grasp/words.hpp"
#include "libfingertip/text.hpp"
#include "tool/cli/names_of_values.hpp"

namespace fingertip {

constexpr std::uint64_t RATE_SPAN_us = 1000000;
constexpr std::uint64_t TRAIL_SPAN_us = 1000000;
constexpr std::uint64_t SLIP_SHOWN_us = 150000;

/* The head's keys for what a view shows. */
constexpr const char *CAP_KEY = "grasp_cap", *GRIPPER_KEY = "grasp_gripper";

static bool is_controlled(std::uint8_t state) {
  return state == GRIP_SQUEEZE || state == GRIP_READY || (state >= GRIP_HOLDING && state <= GRIP_HANDING);
}

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
  case WIRE_INFO: info_ = packet.body.info; break;
  case WIRE_HEALTH: health_ = packet.body.health; break;
  case WIRE_SYNC: edges_.take(packet.body.sync); break;
  default: break;
  }
}

void Model::take_frame(std::uint64_t t_us) {
  last_arrival_ = host_now();
  if (first_us_ && t_us == last_us_) {
    return; /* the other packet of the same frame */
  }
  if (first_us_ && t_us < last_us_) {
    before_restart_us_ += last_us_ - *first_us_;
    first_us_.reset();
    last_slip_us_.reset();
    last_sliding_us_.reset();
    last_moving_us_.reset();
    recent_us_.clear();
    trail_.clear();
    samples_.clear();
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
  auto note = [&](contact_flag flag, std::optional<std::uint64_t> &at_us) { at_us = contact.flags & flag ? t_us : at_us; };
  note(CONTACT_FLAG_SLIP, last_slip_us_);
  note(CONTACT_FLAG_SLIDING, last_sliding_us_);
  note(CONTACT_FLAG_MOVING, last_moving_us_);
  if (!(contact.flags & CONTACT_FLAG_FIT_VALID)) {
    trail_.clear();
  } else if (!is_doubtful(contact)) {
    trail_.push_back({t_us, contact.x_mm, contact.y_mm});
  }
  while (!trail_.empty() && t_us - trail_.front().t_us > TRAIL_SPAN_us) {
    trail_.pop_front();
  }
  sample(contact, samples_.at(static_cast<double>(t_us)));
}

void Model::sample(const wire_contact &contact, Sample &last) {
  if (contact.flags & CONTACT_FLAG_FIT_VALID) {
    bool doubtful = is_doubtful(contact);
    if (!last.fitted || last.doubtful) {
      if (!doubtful) {
        last.force_N = 0;
        last.pulled = false;
      }
      last.doubtful = doubtful;
    }
    if (last.doubtful == doubtful) {
      last.fitted = true;
      last.x_mm = contact.x_mm;
      last.y_mm = contact.y_mm;
      last.force_N = std::max(last.force_N, contact.force_N);
      if (contact.flags & CONTACT_FLAG_TANGENTIAL_VALID) {
        last.pulled = true;
        last.qx_N = contact.qx_N;
        last.qy_N = contact.qy_N;
      }
    }
  }
  if (contact.flags & CONTACT_FLAG_SLIP_VALID) {
    last.slip_valid = true;
    last.slip_mm = std::max(last.slip_mm, contact.slip_mm);
  }
  last.slip = last.slip || (contact.flags & CONTACT_FLAG_SLIP);
  last.sliding = last.sliding || (contact.flags & CONTACT_FLAG_SLIDING);
}

bool Model::is_current() const {
  auto silence_s = seconds_since_frame();
  return state_ == State::replay || (state_ == State::live && silence_s && *silence_s <= STALLED_s);
}

bool Model::is_tared() const { return raw_ ? raw_->flags & CONTACT_FLAG_TARED : contact_ && (contact_->flags & CONTACT_FLAG_TARED); }

sensor_map Model::missing_sensors() const {
  return info_ && health_ ? fingertip::missing_sensors(health_->sensors_present, info_->sensor_count) : 0;
}

bool Model::is_without_sensors() const {
  return info_ && info_->sensor_count > 0 && missing_sensors() == fingertip::missing_sensors(0, info_->sensor_count);
}

double Model::seconds() const { return static_cast<double>(before_restart_us_ + (first_us_ ? last_us_ - *first_us_ : 0)) / 1e6; }

double Model::frames_per_s() const {
  if (recent_us_.size() < 2) {
    return 0;
  }
  return static_cast<double>(recent_us_.size() - 1) * 1e6 / static_cast<double>(recent_us_.back() - recent_us_.front());
}

double Model::mean_frames_per_s() const { return frames_ > 1 && seconds() > 0 ? static_cast<double>(frames_ - 1) / seconds() : 0; }

bool Model::is_late(const std::optional<std::uint64_t> &at_us) const { return at_us && last_us_ - *at_us <= SLIP_SHOWN_us; }

bool Model::estimates_tangential() const { return info_ && (info_->capabilities & WIRE_CAPABILITY_TANGENTIAL); }

bool Model::has_pad() const { return estimates_tangential() && (info_->stored & WIRE_STORED_PAD); }

std::optional<double> Model::seconds_since_frame() const {
  if (!last_arrival_) {
    return std::nullopt;
  }
  return std::chrono::duration<double>(host_now() - *last_arrival_).count();
}

void GripModel::take(const GripRow &row) {
  if (!row_ || row_->report.state != row.report.state) {
    state_since_us_ = row.time_us;
  }
  row_ = row;
  const GripReport &report = row.report;
  Sample &last = samples_.at(row.time_us);
  last.controlled = is_controlled(report.state);
  last.wanted_N = static_cast<float>(report.wanted_N);
  last.loaded = last.controlled && (report.load_N > 0);
  last.load_N = static_cast<float>(report.load_N);
  last.slipping = last.slipping || report.state == GRIP_SLIPPING;
  last.answered = row.status.has_value();
  last.width_mm = row.status ? static_cast<float>(row.status->width_mm) : 0;
}

void GripModel::take(const Metadata &head) {
  for (const auto &[key, value] : head) {
    if (key == CAP_KEY) {
      cap_N_ = to_float(split(value, ' ')[0]).value_or(0);
    } else if (key == GRIPPER_KEY) {
      gripper_ = value;
    }
  }
}

std::string grip_line(const GripModel &grip) {
  if (!grip.row()) {
    return "nothing known of the gripper";
  }
  const GripRow &row = *grip.row();
  const GripReport &report = row.report;
  std::string text = fixed(grip.seconds(), 1) + " s  " + state_name(report.state) + "  width " +
                     (row.status ? fixed(row.status->width_mm, 1) : "-") + " mm  force " + fixed(report.force_N, 2) + " N  wanted " +
                     fixed(report.wanted_N, 2) + " N  load " + fixed(report.load_N, 2) + " N";
  if (report.margin > 0) {
    text += "  margin " + fixed(report.margin, 2);
  }
  text += "  delay " + fixed(1e3 * report.delay_s, 0) + " ms  slides " + std::to_string(report.slides);
  for (const std::string &trouble : trouble_texts(report)) {
    text += "  " + trouble;
  }
  return text;
}

} // namespace fingertip
