/* Recordings as MCAP files of ROS 2 messages, line by line; RECORDING.md has the format. */
#pragma once

#include "libfingertip/line_sink.hpp"
#include "libfingertip/line_source.hpp"
#include "libfingertip/mcap.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/ros_messages.hpp"

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace fingertip {

/* When a row was measured, ns since 1970: by the beginning of the recording and what the clocks show since then. */
class LogClock {
public:
  LogClock() = default;
  LogClock(const std::string &started_utc, const std::string &started_device_us);
  void event(std::string_view text);
  void row(std::uint64_t t_us, std::optional<double> time_us);
  std::uint64_t now_ns() const { return now_ns_; }
  double seconds() const { return static_cast<double>(now_ns_ - begin_ns_) / 1e9; }

private:
  struct Anchor {
    std::uint64_t utc_ns, device_us;
  };
  std::uint64_t begin_ns_ = 0, now_ns_ = 0, event_ns_ = 0, last_us_ = 0;
  std::optional<Anchor> anchor_;
};

class McapLineSink : public LineSink {
public:
  explicit McapLineSink(std::unique_ptr<ByteSink> file);

  /* Throws Error also for a line that is no text, which no message can hold. */
  void line(const std::string &text) override;
  void repeat_every_row() override { repeats_every_row_ = true; }
  void finish() override;
  const std::string &path() const override { return file_->path(); }

private:
  struct Device {
    std::string serial, frame_id;
    std::uint16_t contact = 0, wrench = 0, place = 0, pressures = 0; /* channels */
    std::vector<float> x_mm, y_mm;
    unsigned sensors = 0;
    std::optional<std::uint32_t> warnings; /* as last written */
    std::uint64_t period = UINT64_MAX;     /* of the messages that repeat a row */
  };

  void begin();
  void put(const std::string &text);
  void put_line(const std::string &text);
  bool put_row(const std::string &text);
  void comment(const std::string &text);
  void device_key(Device &device, const std::string &key, const std::string &value);
  void add(std::uint16_t channel, const std::string &message);
  /* The fingertip that a comment's key is about, whose number is taken off. */
  Device *device_of(std::string &key);

  std::unique_ptr<ByteSink> file_;
  mcap::Writer writer_;
  bool repeats_every_row_ = false;
  bool in_head_ = true; /* until the header line */
  std::vector<std::string> head_;
  std::uint64_t number_ = 0;
  bool joint_ = false;
  std::uint8_t sensor_count_ = 0;
  int sets_ = 0;          /* of columns that came later, as in the header */
  bool has_rows_ = false; /* the header is a known one */
  std::vector<Device> devices_;
  std::uint16_t lines_ = 0, periodic_lines_ = 0, diagnostics_ = 0; /* channels */
  LogClock clock_;
  std::uint64_t last_ns_ = 0; /* of the messages */
};

/* The lines in the order of their numbers, in whatever order a tool has written them. A file with the topics of one
 * fingertip alone, as `ros2 bag record` makes them, gets a head and an end of what its first messages hold. */
class McapLineSource : public LineSource {
public:
  /* path: for messages. */
  McapLineSource(std::string path, std::unique_ptr<ByteSource> bytes);

  /* Throws Error also for another MCAP file. */
  bool next(Line &line) override;
  Place place() override;
  void go_to(const Place &place) override;
  void want(double from_s, double to_s) override { wanted_s_ = {from_s, to_s}; }

private:
  using Waiting = std::multimap<std::uint64_t, mcap::Reader::Message>;

  void take(mcap::Reader::Message message);
  void make_head(const mcap::Reader::Message &contact);
  Line line_of(std::uint64_t number, const mcap::Reader::Message &message);
  std::string text_of(const ros::Row &row) const;

  std::string path_;
  mcap::Reader reader_;
  std::uint64_t number_ = 0;
  Waiting waiting_;             /* by their numbers, for those before them */
  std::string topic_;           /* of contacts in a file without lines, whose numbers are counted here */
  std::uint64_t latest_ns_ = 0; /* log time of them */
  bool is_ended_ = false;
  TimeSpan wanted_s_;
  std::optional<std::uint64_t> begin_ns_; /* of the first line */
  std::uint64_t left_out_until_ = 0;      /* lines before this one may be those of chunks that were left out */
  bool joint_ = false;
  std::uint8_t sensor_count_ = 0;
  int sets_ = 0;                                /* of columns that came later, as in the header */
  bool has_first_ = false, has_header_ = false; /* lines seen */
  bool reported_torn_ = false;
  std::string unpacked_; /* a message; room for any */
};

} // namespace fingertip
