#include "judge.hpp"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>

namespace storm {

constexpr std::uint32_t WARNINGS = 0x7FF00;
// More are not kept.
constexpr std::size_t KEPT = 10;
// The line and its queue take less, where the host reads.
constexpr std::uint64_t ANSWER_LIMIT_us = 2500000;
// A weaker touch is little more than noise. One of less than such a part of what was pressed in the last minute the
// gate may take for a zero that has moved, and say that nothing touches (condition.h).
constexpr double SENSED_Pa = 600, SENSED_SHARE = 0.25;
constexpr std::uint64_t SENSED_FOR_us = 100000, MEMORY_us = 60000000;
// A contact may close that late.
constexpr std::uint64_t RELEASED_FOR_us = 300000;
constexpr double UPTIME_LAG_s = 2.5;

static __attribute__((format(printf, 1, 2))) std::string text(const char *format, ...) {
  char out[400];
  va_list values;
  va_start(values, format);
  std::vsnprintf(out, sizeof out, format, values);
  va_end(values);
  return out;
}

template <typename T> static unsigned long long number(T value) { return static_cast<unsigned long long>(value); }

static bool is_frame(const wire_packet &packet) { return packet.type == WIRE_CONTACT || packet.type == WIRE_RAW; }

void Judge::find(const std::string &kind, std::uint64_t t_us, const std::string &what) {
  if (findings_.size() < KEPT) {
    findings_.push_back({kind, t_us, what + "; " + scene_});
  }
}

void Judge::wrong(std::uint64_t t_us, const std::string &what) {
  if (t_us < excused_until_us_) {
    figures_.excused++;
  } else {
    find("wrong", t_us, what);
  }
  good_in_a_row_ = 0;
}

std::uint64_t Judge::bench_us(std::uint64_t device_us) const {
  return static_cast<std::uint64_t>(std::max(0.0, zero_us_ + static_cast<double>(device_us)));
}

void Judge::begin_life(std::uint64_t t_us) {
  close(t_us);
  zero_us_ = static_cast<double>(t_us);
  began_us_ = 0;
  last_answer_us_ = last_frame_us_ = raw_us_ = 0;
  contact_frame_.reset();
  raw_frame_.reset();
  health_of_life_.reset();
}

void Judge::set_clock_zero(double t_us) {
  zero_us_ = t_us;
  began_us_ = std::max(0.0, -t_us);
}

void Judge::open(std::uint64_t) {
  open_ = true;
  joining_ = true;
  wire_receiver_init(&receiver_, wire_all_layouts);
  sequence_.reset();
  session_missing_ = 0;
  contact_follows_ = false;
  counted_.reset();
  asked_.clear();
}

void Judge::close(std::uint64_t t_us) {
  if (open_ && session_missing_ == 0) {
    for (const auto &[sequence, question] : asked_) {
      if (t_us > question.t_us + ANSWER_LIMIT_us && last_frame_heard_us_ > question.t_us) {
        find("loss", t_us, text("command 0x%02x of %llu us was not answered", question.type, number(question.t_us)));
      }
    }
  }
  open_ = false;
}

void Judge::sent(std::uint64_t t_us, const wire_packet &command) { asked_[command.sequence] = {command.type, t_us, command.t_us}; }

void Judge::received(std::uint64_t t_us, const std::uint8_t *bytes, std::size_t count) {
  if (!open_) {
    return; // what a host reads after it has closed does not count
  }
  for (std::size_t i = 0; i < count; i++) {
    wire_packet heard;
    const ft_status status = wire_receive(&receiver_, bytes[i], &heard);
    if (status == FT_OK) {
      packet(t_us, heard);
    } else if (status != FT_PENDING && joining_) {
      session_missing_++; // the rest of one from before, and with it perhaps the first answer
    } else if (status != FT_PENDING) {
      find("damaged", t_us, text("a damaged packet (%d)", static_cast<int>(status)));
    }
    joining_ = joining_ && bytes[i] != 0;
  }
}

void Judge::count_sequence(std::uint64_t t_us, const wire_packet &packet) {
  const std::uint16_t gap = sequence_ ? static_cast<std::uint16_t>(packet.sequence - *sequence_ - 1) : 0;
  sequence_ = packet.sequence;
  session_missing_ += gap;
  figures_.missing += gap;
  if (gap > 0) {
    contact_follows_ = false;
  }
  if (gap >= 0x8000) {
    find("loss", t_us, text("the sequence numbers go back by %u", 0x10000u - gap));
  }
  if (counted_) {
    counted_->missing += gap;
  }
}

void Judge::check_clock(std::uint64_t t_us, const wire_packet &packet) {
  if (bench_us(packet.t_us) > t_us) {
    find("time", t_us, text("packet 0x%02x is of %llu us, which is still to come", packet.type, number(packet.t_us)));
  }
  if (is_frame(packet)) {
    const std::uint64_t other_us = packet.type == WIRE_CONTACT ? raw_us_ : last_frame_us_;
    if (packet.t_us < other_us) {
      find("time", t_us, text("frame of %llu us after one of %llu us", number(packet.t_us), number(other_us)));
    }
    return;
  }
  if (packet.t_us < last_answer_us_ || packet.t_us < last_frame_us_) {
    find("time", t_us, text("answer of %llu us after %llu us", number(packet.t_us), number(std::max(last_answer_us_, last_frame_us_))));
  }
  last_answer_us_ = packet.t_us;
}

void Judge::packet(std::uint64_t t_us, const wire_packet &packet) {
  count_sequence(t_us, packet);
  check_clock(t_us, packet);
  switch (packet.type) {
  case WIRE_CONTACT: judge_contact(t_us, packet); break;
  case WIRE_RAW: judge_raw(t_us, packet); break;
  case WIRE_HEALTH: judge_health(t_us, packet); break;
  case WIRE_ACK: judge_ack(t_us, packet); break;
  default: break;
  }
  if (counted_) {
    counted_->received++;
  }
}

bool Judge::is_firm(std::uint64_t t_us) const {
  const double peak_Pa = world_.at(t_us).peak_Pa;
  if (peak_Pa < SENSED_Pa) {
    return false;
  }
  double strongest_Pa = 0;
  for (std::uint64_t back_us = 0; back_us <= std::min(t_us, MEMORY_us); back_us += 50000) {
    strongest_Pa = std::max(strongest_Pa, world_.at(t_us - back_us).peak_Pa);
  }
  return peak_Pa > SENSED_SHARE * strongest_Pa;
}

void Judge::judge_contact(std::uint64_t t_us, const wire_packet &packet) {
  const wire_contact &contact = packet.body.contact;
  figures_.frames++;
  if (contact_frame_) {
    const std::int32_t step = static_cast<std::int32_t>(contact.frame - *contact_frame_);
    if (step <= 0 || packet.t_us <= last_frame_us_) {
      find("time", t_us,
           text("frame %u of %llu us after frame %u of %llu us", contact.frame, number(packet.t_us), *contact_frame_,
                number(last_frame_us_)));
    } else if (contact_follows_) {
      figures_.skipped += static_cast<std::uint64_t>(step - 1);
      if (counted_) {
        counted_->skipped += static_cast<std::uint64_t>(step - 1);
      }
    }
  }
  contact_frame_ = contact.frame;
  contact_follows_ = true;
  last_frame_us_ = packet.t_us;
  last_frame_heard_us_ = t_us;
  if (counted_) {
    counted_->contacts++;
  }
  const wire_stages &s = contact.stages;
  const unsigned sum = s.convert_us + s.read_us + s.queue_us + s.condition_us + s.fit_us + s.contact_us;
  if (s.total_us != 0xFFFF && sum != s.total_us) {
    find("answer", t_us, text("stages of frame %u add up to %u us, not %u", contact.frame, sum, s.total_us));
  }
  const std::uint32_t flags = contact.flags;
  figures_.late += (flags & CONTACT_FLAG_TANGENTIAL_LATE) != 0;
  if (flags & CONTACT_FLAG_HELD) {
    return; // it repeats the frame before
  }

  const std::uint64_t measured_us = bench_us(packet.t_us);
  const Row truth = world_.at(measured_us);
  const bool good = (flags & CONTACT_FLAG_TARED) && !(flags & (CONTACT_FLAG_SENSOR_MASKED | CONTACT_FLAG_SENSOR_DOUBTFUL));
  good_in_a_row_ = good ? good_in_a_row_ + 1 : 0;

  if (flags & WARNINGS) {
    return;
  }
  if (flags & CONTACT_FLAG_FIT_VALID) {
    figures_.judged++;
    const double error_mm = std::hypot(static_cast<double>(contact.x_mm) - truth.x_mm, static_cast<double>(contact.y_mm) - truth.y_mm);
    const double force_N = truth.force_N();
    const double error_N = std::fabs(static_cast<double>(contact.force_N) - force_N);
    const double share = std::max(0.0, error_N - FORCE_BOUND_N) / std::max(force_N, 1e-9);
    const bool touched = truth.peak_Pa > 0 || measured_us < RELEASED_FOR_us || world_.at(measured_us - RELEASED_FOR_us).peak_Pa > 0;
    if (!touched) {
      wrong(t_us, text("frame %u says %.2f N where nothing touches", contact.frame, static_cast<double>(contact.force_N)));
    } else if (truth.peak_Pa >= SENSED_Pa) {
      const double allowed_mm = allowed_sds_ * static_cast<double>(contact.location_sd_mm);
      if (error_mm > std::max(LOCATION_BOUND_mm, allowed_mm) || share > FORCE_BOUND_SHARE) {
        wrong(t_us, text("frame %u, flags %05x: %.2f mm off, %.3f N instead of %.3f, at %.1f %.1f "
                         "mm, sensors %04llx, sd %.2f mm",
                         contact.frame, flags, error_mm, static_cast<double>(contact.force_N), force_N, truth.x_mm, truth.y_mm,
                         static_cast<unsigned long long>(contact.sensors_used), static_cast<double>(contact.location_sd_mm)));
      }
    }
  } else if ((flags & CONTACT_FLAG_TARED) && !(flags & CONTACT_FLAG_CONTACT)) {
    figures_.judged++;
    if (measured_us >= SENSED_FOR_us && is_firm(measured_us - SENSED_FOR_us) && is_firm(measured_us)) {
      wrong(t_us,
            text("frame %u, flags %05x, says that nothing touches, where a sensor feels %.0f Pa", contact.frame, flags, truth.peak_Pa));
    }
  }
}

void Judge::judge_raw(std::uint64_t t_us, const wire_packet &packet) {
  const wire_raw &raw = packet.body.raw;
  if (raw_frame_ && static_cast<std::int32_t>(raw.frame - *raw_frame_) <= 0) {
    find("time", t_us, text("readings of frame %u after frame %u", raw.frame, *raw_frame_));
  }
  raw_frame_ = raw.frame;
  raw_us_ = packet.t_us;
  const std::uint64_t measured_us = bench_us(packet.t_us);
  const bool warned = (raw.flags & WARNINGS) || !(raw.flags & CONTACT_FLAG_TARED);
  const sensor_map trusted = warned ? 0 : raw.valid & ~raw.saturated & ~raw.doubtful;
  for (unsigned k = 0; k < SENSORS; k++) {
    if (!(trusted >> k & 1)) {
      continue;
    }
    figures_.judged++;
    const double off_Pa = std::fabs(raw.pressure_Pa_q10[k] / 1024.0 - world_.pressure_Pa(k, measured_us));
    if (off_Pa > READING_BOUND_Pa && t_us < readings_excused_until_us_) {
      figures_.excused++;
    } else if (off_Pa > READING_BOUND_Pa) {
      wrong(t_us, text("frame %u: sensor %u is off by %.0f Pa, flags %05x", raw.frame, k, off_Pa, raw.flags));
    }
  }
}

void Judge::judge_health(std::uint64_t t_us, const wire_packet &packet) {
  const wire_health &health = packet.body.health;
  if (static_cast<std::uint16_t>(health.packets_sent + health.packets_dropped) != packet.sequence) {
    find(
        "loss", t_us,
        text("%u packets sent and %u dropped before the one with number %u", health.packets_sent, health.packets_dropped, packet.sequence));
  }
  const double uptime_s = 1e-6 * (static_cast<double>(packet.t_us) - began_us_);
  if (health.uptime_s > uptime_s || health.uptime_s < uptime_s - UPTIME_LAG_s) {
    find("time", t_us, text("uptime %u s at %.3f s", health.uptime_s, uptime_s));
  }
  if (health_of_life_) {
    using H = wire_health;
    for (const auto counter :
         {&H::frames, &H::frames_incomplete, &H::frames_skipped, &H::packets_sent, &H::packets_dropped, &H::commands_done,
          &H::commands_rejected, &H::bus_nacks, &H::bus_timeouts, &H::bus_recoveries, &H::zero_readings, &H::implausible_readings}) {
      if (health.*counter - (*health_of_life_).*counter >= 0x80000000u) {
        find("loss", t_us, "a counter of the health packet went back");
        break;
      }
    }
  }
  health_of_life_ = health;

  Counted now{health};
  now.follows = contact_follows_;
  if (counted_) {
    const Counted &before = *counted_;
    const std::uint32_t sent = health.packets_sent - before.health.packets_sent;
    const std::uint32_t dropped = health.packets_dropped - before.health.packets_dropped;
    if (before.received != sent || before.missing != dropped) {
      find("loss", t_us,
           text("%llu packets came and %llu are missing, where %u were sent and %u dropped", number(before.received),
                number(before.missing), sent, dropped));
    }
    if (before.missing == 0 && before.follows) {
      // One frame may wait for the processor at either health packet.
      const std::uint32_t skipped = health.frames_skipped - before.health.frames_skipped;
      const std::uint32_t frames = health.frames - before.health.frames - skipped;
      now.contacts_over = before.contacts_over + static_cast<std::int64_t>(before.contacts) - frames;
      now.skipped_over = before.skipped_over + static_cast<std::int64_t>(before.skipped) - skipped;
      if (std::abs(now.contacts_over) > 1 || std::abs(now.skipped_over) > 1) {
        find("loss", t_us,
             text("%llu frames came and %llu were skipped, where %u were taken and %u skipped", number(before.contacts),
                  number(before.skipped), frames, skipped));
        now.contacts_over = now.skipped_over = 0;
      }
    }
  }
  counted_ = now;
}

void Judge::judge_ack(std::uint64_t t_us, const wire_packet &packet) {
  const wire_ack &ack = packet.body.ack;
  const auto question = asked_.find(ack.sequence);
  if (question == asked_.end() || question->second.type != ack.command || question->second.host_time_us != ack.host_time_us) {
    find("answer", t_us, text("an answer to command 0x%02x with number %u, which was not sent", ack.command, ack.sequence));
    return;
  }
  asked_.erase(question);
}

} // namespace storm
