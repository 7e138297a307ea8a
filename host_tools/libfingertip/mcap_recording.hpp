/* Recordings as MCAP files of ROS 2 messages (profile ros2, schemas ros2msg, CDR), line by line:
 *
 *   /fingertip/SERIAL/contact    fingertip_msgs/msg/Contact           each row
 *   /fingertip/SERIAL/wrench     geometry_msgs/msg/WrenchStamped      for programs that know no
 *   /fingertip/SERIAL/place      geometry_msgs/msg/PointStamped       fingertip: what may be
 * trusted, /fingertip/SERIAL/pressures  sensor_msgs/msg/PointCloud2          or NaN /diagnostics
 * diagnostic_msgs/msg/DiagnosticArray  each health packet; and warnings, where they change
 *   /fingertip/lines             fingertip_msgs/msg/Line              every other line
 *
 * What the numbers mean is in the definitions (host_tools/python/fingertip/msg), which the file
 * holds too. The coordinate frames are fingertip_SERIAL: x across the strips, y along them, z out
 * of the rubber. A serial number that begins with a digit has an "s" before it there and in the
 * topics.
 *
 * Contact and Line are all that is read back: they are the CSV file, byte by byte, whatever is in
 * it, for a row that is not written as this library writes it becomes a Line. The others repeat
 * what is in them. The head of the recording is also metadata (fingertip_recording); gains, force
 * scale and the pad's profile of each fingertip are also an attachment (calibration_SERIAL.json).
 *
 * Log times are the computer's: when the recording began, and device time since then, or in a
 * recording of several the recorder's clock. Chunks last a second, or a megabyte: what a killed
 * recorder loses. The head has a chunk of its own.
 */
#pragma once

#include "libfingertip/line_sink.hpp"
#include "libfingertip/line_source.hpp"
#include "libfingertip/mcap_reader.hpp"
#include "libfingertip/mcap_writer.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/ros_messages.hpp"

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace fingertip {

class McapLineSink : public LineSink {
public:
  McapLineSink(const std::string &path, bool replace, OutputFile::Appears appears);

  /* Throws Error also for a line that is no text, which no message can hold. */
  void line(const std::string &text) override;
  void torn_line(const std::string &text) override;
  void finish() override;
  const std::string &path() const override { return file_.path(); }

private:
  /* When a row was measured. */
  class LogClock {
  public:
    LogClock() = default;
    LogClock(const std::string &started_utc, const std::string &started_device_us);
    void event(std::string_view text);
    void row(std::uint64_t t_us, std::optional<double> time_us);
    std::uint64_t now_ns() const { return now_ns_; }

  private:
    struct Anchor {
      std::uint64_t utc_ns, device_us;
    };
    std::uint64_t begin_ns_ = 0, now_ns_ = 0, event_ns_ = 0, last_us_ = 0;
    std::optional<Anchor> anchor_;
  };

  struct Device {
    std::string serial, frame_id;
    std::uint16_t contact = 0, wrench = 0, place = 0, pressures = 0; /* channels */
    std::vector<float> x_mm, y_mm;
    unsigned sensors = 0;
    std::optional<std::uint32_t> warnings; /* as last said */
    mcap::Pairs calibration;
  };

  void take(const std::string &text, bool torn);
  void begin();
  void put(const std::string &text, bool torn);
  void put_line(const std::string &text, bool torn);
  bool put_row(const std::string &text);
  void comment(const std::string &text);
  void device_key(Device &device, const std::string &key, const std::string &value);
  void diagnose(const std::string &message);
  /* The fingertip that a comment's key is about, whose number is taken off. */
  Device *device_of(std::string &key);

  OutputFile file_;
  mcap::Writer writer_;
  bool in_head_ = true; /* until the header line */
  std::vector<std::pair<std::string, bool>> head_;
  std::uint64_t number_ = 0;
  bool joint_ = false;
  std::uint8_t sensor_count_ = 0;
  bool has_tangential_ = true;
  bool has_rows_ = false; /* the header is a known one */
  std::vector<Device> devices_;
  std::uint16_t lines_ = 0, diagnostics_ = 0; /* channels */
  LogClock clock_;
};

class McapLineSource : public LineSource {
public:
  /* Throws Error if it cannot be read. */
  explicit McapLineSource(const std::string &path);

  /* Throws Error also for another MCAP file. */
  bool next(Line &line) override;
  Place place() override;
  void go_to(const Place &place) override;

private:
  std::string text_of(const ros::Row &row) const;

  std::string path_;
  mcap::Reader reader_;
  std::uint64_t number_ = 0;
  bool joint_ = false;
  std::uint8_t sensor_count_ = 0;
  bool has_tangential_ = true;
  bool has_first_ = false, has_header_ = false; /* lines seen */
  bool told_torn_ = false;
};

} // namespace fingertip
