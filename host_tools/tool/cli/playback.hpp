/* A file of one fingertip or several, or of a grasp, shown as it was recorded: played at any speed,
 * paused, and sought in both directions. */
#pragma once

#include "libfingertip/clock.hpp"
#include "libfingertip/packet_file.hpp"
#include "tool/cli/keys.hpp"
#include "tool/cli/monitor.hpp"

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace fingertip {

/* Time of frames: a device that restarted goes on where it was. */
struct FrameClock {
  bool begun = false;
  std::uint64_t zero_us = 0, last_us = 0;
  double before_us = 0;
  double take(std::uint64_t t_us);
};

/* One fingertip or the gripper of a file, up to a time that can be chosen: what is shown, which is
 * always the same object, is what was known then. What reads on throws Error as the reader does. */
template <typename Reader, typename Shown> class Track {
public:
  explicit Track(Reader reader) : file_(std::move(reader)) { read_next(); }

  const Reader &file() const { return file_; }
  bool is_ended() const { return !now_.next; }
  /* Time of the next frame, us from the file's beginning; of the last one if none follows. */
  double next_us() const { return now_.next_us; }
  double last_us() const { return now_.last_us; }

  /* Takes at most this number of packets or rows, up to this time; false if there are more. */
  bool read_to(double time_us, int items, Shown &shown);
  /* Back to somewhere not after this time, from where it can be read. */
  void go_back(double time_us, Shown &shown);

private:
  struct Position {
    FrameClock clock;
    decltype(std::declval<Reader &>().next()) next;
    double next_us = 0, last_us = 0;
  };
  struct Mark {
    Position position;
    typename Reader::Place place;
    Shown shown;
  };

  void read_next();

  Reader file_;
  Position now_;
  std::vector<Mark> marks_;
};
using FingertipTrack = Track<PacketFile, Model>;
using GripTrack = Track<GripRowReader, GripModel>;

class Playback {
public:
  /* speed: times the recorded one; 0: as fast as it can be read. Of a joint recording without a device all of its fingertips. */
  Playback(const std::string &path, bool salvage, const std::string &device, double speed, const TimeSpan &interval = {});

  /* Goes on to where it should be now, or as far as it gets in a moment. */
  void step(HostTime now);
  /* When there is something to do. */
  HostTime next_step(HostTime now) const;
  /* Played to its end, or quit. */
  bool is_over() const;
  void key(Key key);

  const std::vector<FingertipTrack> &tracks() const { return tracks_; }
  const std::vector<Model> &models() const { return models_; }
  /* The model of a grasp that is shown whole. */
  const GripModel *grip() const { return grip_track_ ? &grip_ : nullptr; }
  Caption caption(const std::string &name) const;

private:
  void seek(double time_us);
  double due_us() const; /* of what comes next; infinite: nothing */

  std::vector<FingertipTrack> tracks_;
  std::vector<Model> models_; /* of the tracks */
  std::optional<GripTrack> grip_track_;
  GripModel grip_;
  double speed_;
  double time_us_ = 0; /* shown, or to be shown as soon as it is read; infinite: the end */
  bool paused_ = false, quit_ = false, is_there_ = false;
  std::optional<HostTime> last_;
};

} // namespace fingertip
