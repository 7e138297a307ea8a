#include "tool/cli/playback.hpp"

#include "libfingertip/clock.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/recording_reader.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip {

namespace {

/* Takes some 6 ms: 2.7 us each, as measured by a replay of 31 424 frames at --speed max. */
constexpr int PACKETS_AT_ONCE = 2000;
constexpr double SHORT_WAY_us = 5e6, LONG_WAY_us = 60e6;
/* Spacing of the positions to go back to. */
constexpr double MARKS_us = 10e6;
constexpr double END = std::numeric_limits<double>::infinity();

bool is_frame(const wire_packet &packet) { return packet.type == WIRE_CONTACT || packet.type == WIRE_RAW; }

} // namespace

double Track::Clock::take(std::uint64_t t_us) {
  if (!begun || t_us < last_us) {
    before_us += begun ? static_cast<double>(last_us - zero_us) : 0;
    begun = true;
    zero_us = t_us;
  }
  last_us = t_us;
  return before_us + static_cast<double>(t_us - zero_us);
}

Track::Track(const std::string &path, bool salvage, const std::string &device) : file_(path, salvage, device) {
  read_next();
}

void Track::read_next() {
  next_ = file_.next();
  if (next_ && next_->kind == PacketFile::Item::Kind::packet && is_frame(next_->packet)) {
    next_us_ = next_->time_us ? *next_->time_us : clock_.take(next_->packet.t_us);
  }
}

bool Track::read_to(double time_us, int packets, Model &model) {
  while (next_ && next_us_ <= time_us) {
    if (packets-- <= 0) {
      return false;
    }
    if (marks_.empty() || next_us_ >= marks_.back().time_us + MARKS_us) {
      marks_.push_back({next_us_, file_.place(), model, clock_, next_, next_us_, last_us_});
    }
    last_us_ = next_us_;
    if (next_->kind == PacketFile::Item::Kind::packet) {
      model.take(next_->packet);
    }
    read_next();
    model.set_statistics(file_.statistics());
  }
  return true;
}

void Track::go_back(double time_us, Model &model) {
  if (time_us >= last_us_) {
    return;
  }
  auto after = std::upper_bound(marks_.begin(), marks_.end(), time_us,
                                [](double wanted, const Mark &mark) { return wanted < mark.time_us; });
  if (marks_.empty()) {
    return;
  }
  const Mark &mark = after == marks_.begin() ? marks_.front() : *(after - 1);
  file_.go_to(mark.place);
  model = mark.model;
  clock_ = mark.clock;
  next_ = mark.next;
  next_us_ = mark.next_us;
  last_us_ = mark.last_us;
}

std::optional<GripTrack> GripTrack::open(const std::string &path, bool salvage) {
  GripTrack track{GripRowReader(path, salvage)};
  track.next_ = track.reader_.next();
  return track.next_ ? std::optional(std::move(track)) : std::nullopt;
}

bool GripTrack::read_to(double time_us, int rows, GripModel &model) {
  while (next_ && next_->time_us <= time_us) {
    if (rows-- <= 0) {
      return false;
    }
    if (marks_.empty() || next_->time_us >= marks_.back().time_us + MARKS_us) {
      marks_.push_back({next_->time_us, reader_.place(), model, next_, last_us_});
    }
    last_us_ = next_->time_us;
    model.take(*next_);
    next_ = reader_.next();
  }
  return true;
}

void GripTrack::go_back(double time_us, GripModel &model) {
  if (time_us >= last_us_ || marks_.empty()) {
    return;
  }
  auto mark =
      std::find_if(marks_.rbegin(), marks_.rend() - 1, [&](const Mark &each) { return each.time_us <= time_us; });
  reader_.go_to(mark->place);
  model = mark->model;
  next_ = mark->next;
  last_us_ = mark->last_us;
}

Playback::Playback(const std::string &path, bool salvage, const std::string &device, double speed) : speed_(speed) {
  std::vector<std::string> devices = {device};
  if (device.empty()) {
    auto all = fingertips_in(path);
    devices = all.empty() ? devices : all;
    grip_track_ = all.size() == 2 ? GripTrack::open(path, salvage) : std::nullopt;
  }
  for (const std::string &each : devices) {
    tracks_.emplace_back(path, salvage, each);
    Model model;
    model.set_state(Model::State::replay);
    model.set_source(path);
    models_.push_back(model);
  }
  if (grip_track_) {
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
  }
  if (grip_track_) {
    is_there_ = grip_track_->read_to(time_us_, PACKETS_AT_ONCE, grip_) && is_there_;
  }
  if (is_there_ && std::isinf(time_us_)) {
    time_us_ = grip_track_ ? grip_track_->last_us() : 0;
    for (const Track &track : tracks_) {
      time_us_ = std::max(time_us_, track.last_us());
    }
  }
}

HostTime Playback::next_step(HostTime now) const {
  constexpr std::chrono::milliseconds patience{20};
  double due_us = END;
  for (const Track &track : tracks_) {
    due_us = track.is_ended() ? due_us : std::min(due_us, track.next_us());
  }
  if (grip_track_ && !grip_track_->is_ended()) {
    due_us = std::min(due_us, grip_track_->next_us());
  }
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
                   std::all_of(tracks_.begin(), tracks_.end(), [](const Track &track) { return track.is_ended(); }));
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
  switch (key) {
  case 'q':
    quit_ = true;
    break;
  case ' ':
    paused_ = !paused_;
    break;
  case KEY_LEFT:
    seek(time_us_ - SHORT_WAY_us);
    break;
  case KEY_RIGHT:
    seek(time_us_ + SHORT_WAY_us);
    break;
  case KEY_DOWN:
    seek(time_us_ - LONG_WAY_us);
    break;
  case KEY_UP:
    seek(time_us_ + LONG_WAY_us);
    break;
  case KEY_HOME:
    seek(0);
    break;
  case KEY_END:
    paused_ = true; /* to show the end */
    seek(END);
    break;
  default:
    break;
  }
}

Caption Playback::caption(const std::string &name) const {
  double shown_us = 0;
  for (const Track &track : tracks_) {
    shown_us = std::max(shown_us, track.last_us());
  }
  std::string note = is_there_ && paused_ ? "PAUSED at " : is_there_ ? "at " : "reading, at ";
  return {std::string("q quit  space ") + (paused_ ? "play " : "pause") + "  ← → 5 s  ↑ ↓ 1 min  home end",
          note + fixed((is_there_ ? time_us_ : shown_us) / 1e6, 1) + " s of " + name, ""};
}

} // namespace fingertip
