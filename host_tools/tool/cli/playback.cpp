#include "tool/cli/playback.hpp"

#include "libfingertip/recording_reader.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace fingertip {

/* Takes some 6 ms: 2.7 us each, as measured by a replay of 31 424 frames at --speed max. */
constexpr int PACKETS_AT_ONCE = 2000;
constexpr double SHORT_WAY_us = 5e6, LONG_WAY_us = 60e6;
/* Spacing of the positions to go back to. */
constexpr double MARKS_us = 10e6;
/* A longer pause in a recording, or a time that is damaged, is passed over. */
constexpr double PAUSE_MOST_us = 10e6;
constexpr double END = std::numeric_limits<double>::infinity();

static std::optional<double> time_of(const PacketFile::Item &item, FrameClock &clock) {
  if (item.kind != PacketFile::Item::Kind::packet || !is_frame(item.packet)) {
    return std::nullopt;
  }
  return item.time_us ? item.time_us : clock.take(item.packet.t_us);
}

static std::optional<double> time_of(const GripRow &row, FrameClock &) { return row.time_us; }

static void take(Model &model, const PacketFile::Item &item) {
  if (item.kind == PacketFile::Item::Kind::packet) {
    model.take(item.packet);
  }
}

static void take(GripModel &model, const GripRow &row) { model.take(row); }

double FrameClock::take(std::uint64_t t_us) {
  if (!begun || t_us < last_us) {
    before_us += begun ? static_cast<double>(last_us - zero_us) : 0;
    begun = true;
    zero_us = t_us;
  }
  last_us = t_us;
  return before_us + static_cast<double>(t_us - zero_us);
}

template <typename Reader, typename Shown> void Track<Reader, Shown>::read_next() {
  now_.next = file_.next();
  now_.next_us = now_.next ? time_of(*now_.next, now_.clock).value_or(now_.next_us) : now_.next_us;
}

template <typename Reader, typename Shown> bool Track<Reader, Shown>::read_to(double time_us, int items, Shown &shown) {
  while (now_.next && now_.next_us <= time_us) {
    if (items-- <= 0) {
      return false;
    }
    if (marks_.empty() || now_.next_us >= marks_.back().position.next_us + MARKS_us) {
      marks_.push_back({now_, file_.place(), shown});
    }
    now_.last_us = now_.next_us;
    take(shown, *now_.next);
    read_next();
  }
  return true;
}

template <typename Reader, typename Shown> void Track<Reader, Shown>::go_back(double time_us, Shown &shown) {
  if (time_us >= now_.last_us || marks_.empty()) {
    return;
  }
  const auto mark = std::find_if(marks_.rbegin(), marks_.rend() - 1, [&](const Mark &each) { return each.position.next_us <= time_us; });
  file_.go_to(mark->place);
  shown = mark->shown;
  now_ = mark->position;
}

Playback::Playback(const std::string &path, bool salvage, const std::string &device, double speed, const TimeSpan &interval)
    : speed_(speed) {
  std::vector<std::string> devices = {device};
  if (device.empty()) {
    auto all = fingertips_in(path);
    devices = all.empty() ? devices : all;
    if (all.size() == 2) {
      grip_track_.emplace(GripRowReader(path, salvage, interval));
    }
  }
  for (const std::string &each : devices) {
    tracks_.emplace_back(PacketFile(path, salvage, each, interval));
    models_.emplace_back().set_source(path);
  }
  if (grip_track_ && grip_track_->is_ended()) {
    grip_track_.reset(); /* a file without a gripper */
  } else if (grip_track_) {
    grip_.take(tracks_[0].file().recorder_metadata());
  }
}

void Playback::step(HostTime now) {
  double passed_us = last_ ? std::chrono::duration<double, std::micro>(now - *last_).count() : 0;
  last_ = now;
  if (!paused_ && is_there_) {
    time_us_ = speed_ > 0 ? time_us_ + passed_us * speed_ : END;
  }
  is_there_ = true;
  for (std::size_t i = 0; i < tracks_.size(); i++) {
    is_there_ = tracks_[i].read_to(time_us_, PACKETS_AT_ONCE, models_[i]) && is_there_;
    models_[i].set_statistics(tracks_[i].file().statistics());
  }
  if (grip_track_) {
    is_there_ = grip_track_->read_to(time_us_, PACKETS_AT_ONCE, grip_) && is_there_;
  }
  for (std::size_t i = 0; i < tracks_.size(); i++) {
    const bool is_gap = is_there_ && std::isfinite(due_us()) && time_us_ > tracks_[i].last_us() + 1e6 * STALLED_s;
    models_[i].set_state(is_gap ? Model::State::nothing_recorded : Model::State::replay);
  }
  if (const double next_us = due_us(); is_there_ && !paused_ && std::isfinite(next_us) && next_us > time_us_ + PAUSE_MOST_us) {
    time_us_ = next_us;
  }
  if (is_there_ && std::isinf(time_us_)) {
    time_us_ = grip_track_ ? grip_track_->last_us() : 0;
    for (const FingertipTrack &track : tracks_) {
      time_us_ = std::max(time_us_, track.last_us());
    }
  }
}

double Playback::due_us() const {
  double due_us = grip_track_ && !grip_track_->is_ended() ? grip_track_->next_us() : END;
  for (const FingertipTrack &track : tracks_) {
    due_us = track.is_ended() ? due_us : std::min(due_us, track.next_us());
  }
  return due_us;
}

HostTime Playback::next_step(HostTime now) const {
  constexpr std::chrono::milliseconds patience{20};
  const double due_us = this->due_us();
  if (!is_there_ || (!paused_ && speed_ == 0)) {
    return now;
  }
  if (paused_ || std::isinf(due_us)) {
    return now + patience;
  }
  auto due = std::chrono::duration<double, std::micro>((due_us - time_us_) / speed_);
  return now + std::min<HostTime::duration>(patience, std::chrono::duration_cast<HostTime::duration>(due));
}

bool Playback::is_over() const {
  return quit_ || (!paused_ && is_there_ && (!grip_track_ || grip_track_->is_ended()) &&
                   std::all_of(tracks_.begin(), tracks_.end(), [](const FingertipTrack &track) { return track.is_ended(); }));
}

void Playback::seek(double time_us) {
  time_us_ = std::max(time_us, 0.0);
  for (std::size_t i = 0; i < tracks_.size(); i++) {
    tracks_[i].go_back(time_us_, models_[i]);
  }
  if (grip_track_) {
    grip_track_->go_back(time_us_, grip_);
  }
  is_there_ = false; /* time stops until it was read */
}

void Playback::key(Key key) {
  const std::pair<Key, double> seeks[] = {{KEY_LEFT, time_us_ - SHORT_WAY_us},
                                          {KEY_RIGHT, time_us_ + SHORT_WAY_us},
                                          {KEY_DOWN, time_us_ - LONG_WAY_us},
                                          {KEY_UP, time_us_ + LONG_WAY_us},
                                          {KEY_HOME, 0},
                                          {KEY_END, END}};
  quit_ = quit_ || key == 'q';
  paused_ = key == ' ' ? !paused_ : paused_ || key == KEY_END; /* to show the end */
  for (const auto &[of, time_us] : seeks) {
    if (key == of) {
      seek(time_us);
    }
  }
}

Caption Playback::caption(const std::string &name) const {
  double shown_us = 0;
  for (const FingertipTrack &track : tracks_) {
    shown_us = std::max(shown_us, track.last_us());
  }
  std::string note = is_there_ && paused_ ? "PAUSED at " : is_there_ ? "at " : "reading, at ";
  return {std::string("q quit  space ") + (paused_ ? "play " : "pause") + "  ← → 5 s  ↑ ↓ 1 min  home end",
          note + fixed((is_there_ ? time_us_ : shown_us) / 1e6, 1) + " s of " + name, ""};
}

} // namespace fingertip
