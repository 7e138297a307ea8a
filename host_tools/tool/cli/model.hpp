/* What is known of a fingertip at this moment, gathered from its packets, for views to show. */
#pragma once

#include "grasp/grip_row.hpp"
#include "libfingertip/clock.hpp"
#include "libfingertip/decoder.hpp"
#include "libfingertip/edge_counter.hpp"
#include "libfingertip/names.hpp"
#include "libfingertip/packet_fields.hpp"

#include <algorithm>
#include <deque>
#include <optional>
#include <string>

namespace fingertip {

/* A longer time without a frame is shown as a stall. */
inline constexpr double STALLED_s = 0.7;

/* Whether a warning means that its numbers deserve less trust. */
inline bool is_doubtful(const wire_contact &contact) { return (contact.flags & warning_flags()) != 0; }

/* Samples of the last intervals of a time, for traces. */
template <typename Sample> class History {
public:
  static constexpr std::int64_t INTERVAL_us = 50000, MOST = 800;

  /* The newest sample, which is that of the interval with this time; time that goes back begins again. */
  Sample &at(double time_us) {
    const auto interval = static_cast<std::int64_t>(std::max(time_us, 0.0) / static_cast<double>(INTERVAL_us));
    if (samples_.empty() || interval < last_) {
      samples_.assign(1, {});
    } else {
      samples_.resize(samples_.size() + static_cast<std::size_t>(std::min(interval - last_, MOST)));
    }
    last_ = interval;
    while (samples_.size() > MOST) {
      samples_.pop_front();
    }
    return samples_.back();
  }
  const Sample &operator[](std::int64_t interval) const {
    static const Sample none{};
    const std::int64_t oldest = last_ - static_cast<std::int64_t>(samples_.size()) + 1;
    return interval >= oldest && interval <= last_ && !samples_.empty() ? samples_[static_cast<std::size_t>(interval - oldest)] : none;
  }
  std::int64_t last() const { return last_; } /* the newest interval; 0 began with the time */
  std::size_t size() const { return samples_.size(); }
  void clear() { samples_.clear(); }

private:
  std::deque<Sample> samples_;
  std::int64_t last_ = 0;
};

class Model {
public:
  enum class State { connecting, live, gone, replay, nothing_recorded };

  struct Location {
    std::uint64_t t_us;
    float x_mm, y_mm;
  };
  /* The values of an interval: frames with a warning count only if there is no other. */
  struct Sample {
    bool fitted = false;
    bool doubtful = false;
    float x_mm = 0, y_mm = 0; /* the last */
    float force_N = 0;        /* the highest */
    bool slip_valid = false;
    float slip_mm = 0; /* the highest */
    bool slip = false;
    bool pulled = false;      /* qx_N, qy_N hold a load */
    float qx_N = 0, qy_N = 0; /* the last */
    bool sliding = false;
  };

  void take(const wire_packet &packet);
  void set_statistics(const LineStatistics &statistics) { statistics_ = statistics; }
  void set_state(State state) { state_ = state; }
  void set_source(const std::string &source) { source_ = source; }

  State state() const { return state_; }
  const std::string &source() const { return source_; }
  const LineStatistics &statistics() const { return statistics_; }
  const std::optional<wire_info> &info() const { return info_; }
  const std::optional<wire_contact> &contact() const { return contact_; }
  const std::optional<wire_raw> &raw() const { return raw_; }
  const std::optional<wire_health> &health() const { return health_; }
  /* Bits of the sensors that do not answer, as of the last health packet. */
  sensor_map missing_sensors() const;
  bool is_without_sensors() const;

  /* Frames since the first, and their device time. */
  std::uint64_t frames() const { return frames_; }
  double seconds() const;
  /* At the sync pin. */
  const EdgeCounter &edges() const { return edges_; }
  /* Over the last second of device time. */
  double frames_per_s() const;
  /* Over everything. */
  double mean_frames_per_s() const;
  /* One of these flags within the last 0.15 s of device time: long enough to be seen. */
  bool slipped_lately() const { return is_late(last_slip_us_); }
  bool slid_lately() const { return is_late(last_sliding_us_); }
  bool moved_lately() const { return is_late(last_moving_us_); }
  /* Whether its firmware can estimate tangential force, and has the pad profile that this needs. */
  bool estimates_tangential() const;
  bool has_pad() const;
  /* Since the last frame, by the host's clock; nothing before the first. */
  std::optional<double> seconds_since_frame() const;
  /* Whether the last frame's report still holds: false where none came for STALLED_s, and where the fingertip is gone. */
  bool is_current() const;
  /* The numbers of the last frame are differences from a measured zero. */
  bool is_tared() const;
  /* Those without a warning in the last second, oldest first; emptied where contact ends. */
  const std::deque<Location> &trail() const { return trail_; }
  const History<Sample> &samples() const { return samples_; } /* of the device's time */

private:
  void take_frame(std::uint64_t t_us);
  void take_contact(const wire_contact &contact, std::uint64_t t_us);
  void sample(const wire_contact &contact, Sample &last);
  bool is_late(const std::optional<std::uint64_t> &at_us) const;

  State state_ = State::connecting;
  std::string source_;
  LineStatistics statistics_;
  std::optional<wire_info> info_;
  std::optional<wire_contact> contact_;
  std::optional<wire_raw> raw_;
  std::optional<wire_health> health_;

  std::uint64_t frames_ = 0;
  EdgeCounter edges_;
  std::uint64_t before_restart_us_ = 0; /* device time of earlier runs of the device */
  std::optional<std::uint64_t> first_us_;
  std::uint64_t last_us_ = 0;
  std::optional<std::uint64_t> last_slip_us_, last_sliding_us_, last_moving_us_;
  std::optional<HostTime> last_arrival_;
  std::deque<std::uint64_t> recent_us_;
  std::deque<Location> trail_;
  History<Sample> samples_;
};

/* The same of a grasp beside its fingertips, from the rows of a recording. */
class GripModel {
public:
  /* The last values of an interval, and whether a flag was ever on. */
  struct Sample {
    bool controlled = false; /* wanted_N holds */
    bool loaded = false;     /* load_N holds */
    bool answered = false;   /* width_mm holds */
    bool slipping = false;
    float wanted_N = 0, load_N = 0, width_mm = 0;
  };

  void take(const GripRow &row);
  /* Takes gripper and cap from the recording's head. */
  void take(const Metadata &head);
  void set_gripper(const std::string &gripper) { gripper_ = gripper; }
  void set_cap_N(float cap_N) { cap_N_ = cap_N; }

  const std::optional<GripRow> &row() const { return row_; }
  const std::string &gripper() const { return gripper_; }
  float cap_N() const { return cap_N_; }
  double seconds() const { return row_ ? row_->time_us / 1e6 : 0; }
  /* The last of before this grasp's newest state: for how long it has been. */
  double state_seconds() const { return row_ ? (row_->time_us - state_since_us_) / 1e6 : 0; }

  const History<Sample> &samples() const { return samples_; } /* of the recording's time */

private:
  std::string gripper_;
  float cap_N_ = 0;
  std::optional<GripRow> row_;
  double state_since_us_ = 0;
  History<Sample> samples_;
};

/* "left 4.02 N" and so on, for a line of text. */
std::string grip_line(const GripModel &grip);

} // namespace fingertip
