/* A file of one fingertip or several, or of a grasp, shown as it was recorded: played at any speed,
 * paused, and sought in both directions. */
#pragma once

#include "libfingertip/clock.hpp"
#include "libfingertip/packet_file.hpp"
#include "tool/cli/grip_model.hpp"
#include "tool/cli/keys.hpp"
#include "tool/cli/model.hpp"
#include "tool/cli/monitor.hpp"

#include <chrono>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace fingertip {

/* One fingertip of a file, up to a time that can be chosen: the model, which is always the same
 * one, is what was known then. */
class Track {
public:
  /* Throws Error as PacketFile does; so does what reads on. */
  Track(const std::string &path, bool salvage, const std::string &device);

  const PacketFile &file() const { return file_; }
  bool is_ended() const { return !next_; }
  /* Time of the next frame, us from the file's beginning; of the last one if none follows. */
  double next_us() const { return next_us_; }
  double last_us() const { return last_us_; }

  /* Takes at most this number of packets, up to this time; false if there are more. */
  bool read_to(double time_us, int packets, Model &model);
  /* Back to somewhere not after this time, from where it can be read. */
  void go_back(double time_us, Model &model);

private:
  /* Time of frames: a device that restarted goes on where it was. */
  struct Clock {
    bool begun = false;
    std::uint64_t zero_us = 0, last_us = 0;
    double before_us = 0;
    double take(std::uint64_t t_us);
  };
  struct Mark {
    double time_us;
    PacketFile::Place place;
    Model model;
    Clock clock;
    std::optional<PacketFile::Item> next;
    double next_us, last_us;
  };

  void read_next();

  PacketFile file_;
  Clock clock_;
  std::optional<PacketFile::Item> next_;
  double next_us_ = 0, last_us_ = 0;
  std::vector<Mark> marks_;
};

/* The same for the gripper of a file. */
class GripTrack {
public:
  /* Nothing for a file without one. */
  static std::optional<GripTrack> open(const std::string &path, bool salvage);

  bool is_ended() const { return !next_; }
  double next_us() const { return next_ ? next_->time_us : last_us_; }
  double last_us() const { return last_us_; }
  bool read_to(double time_us, int rows, GripModel &model);
  void go_back(double time_us, GripModel &model);

private:
  struct Mark {
    double time_us;
    GripRowReader::Place place;
    GripModel model;
    std::optional<GripRow> next;
    double last_us;
  };

  explicit GripTrack(GripRowReader reader) : reader_(std::move(reader)) {}

  GripRowReader reader_;
  std::optional<GripRow> next_;
  double last_us_ = 0;
  std::vector<Mark> marks_;
};

class Playback {
public:
  /* speed: times the recorded one; 0: as fast as it can be read. Of a joint recording without a
   * device all of its fingertips. */
  Playback(const std::string &path, bool salvage, const std::string &device, double speed);

  /* Goes on to where it should be now, or as far as it gets in a moment. */
  void step(HostTime now);
  /* When there is something to do. */
  HostTime next_step(HostTime now) const;
  /* Played to its end, or quit. */
  bool is_over() const;
  void key(Key key);

  const std::vector<Track> &tracks() const { return tracks_; }
  const std::vector<Model> &models() const { return models_; }
  /* The model of a grasp that is shown whole. */
  const GripModel *grip() const { return grip_track_ ? &grip_ : nullptr; }
  Caption caption(const std::string &name) const;

private:
  void seek(double time_us);

  std::vector<Track> tracks_;
  std::vector<Model> models_; /* of the tracks */
  std::optional<GripTrack> grip_track_;
  GripModel grip_;
  double speed_;
  double time_us_ = 0; /* shown, or to be shown as soon as it is read; infinite: the end */
  bool paused_ = false, quit_ = false, is_there_ = false;
  std::optional<HostTime> last_;
};

} // namespace fingertip
