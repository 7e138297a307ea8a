/* Recordings: what a fingertip said, as a CSV file that people, pandas and numpy read as it is.
 *
 *   # fingertip-recording 1
 *   # key: value              of the info packet: serial, board, scene, firmware, git, sensors,
 *                             rate_mHz, osr, ..., x_mm and y_mm of the sensors; of a calibrated
 *                             fingertip (stored, bit 0) date, force scale, gains, ...; of the
 * recorder t_us,frame,sequence,flags,...,total_us,raw_sequence,...,s0_Pa,...,tare0_Pa,... one row
 * per frame: a contact and a raw packet; cells of one that did not come are empty # packet: NAME
 * key=value  every other packet, where it came; before an info packet stand those of its fields
 * that are new, as "# key: value" # event: text             "gone" and "back" of the port among
 * others # end: key=value ...      totals, over all runs of a device that restarted; absent if the
 *                             recorder was killed or the disk was full
 *
 * Times are device time in us, pressures Pa with four decimals (exact: the wire carries 1/1024 Pa),
 * floats the shortest text that reads back the same. So nothing of the packets is lost. Pressures
 * are as measured, whatever the calibration: reading - tare, over gain, is what the fit got.
 *
 * Several fingertips on one clock are a recording of format 2:
 *
 *   # fingertip-recording 2
 *   # devices: SERIAL SERIAL...   numbered from 0
 *   # host_zero_us: N             time_us 0 on the recorder's steady clock (CLOCK_MONOTONIC)
 *   # 0/key: value                every comment of format 1 with the number of its fingertip before
 * it device,time_us,t_us,frame,... the number; the recorder's clock; then the columns of format 1
 *   # 0/clock: t_us=... time_us=... drift_ppm=... uncertainty_us=...
 *                             once a second: the device time t_us is time_us on the recorder's
 * clock, surely within the uncertainty; a positive drift is a fast fingertip # 0/end: frames=...
 * jumps=... drift_ppm=... uncertainty_us=... packets=... # end: reason=... frames=... seconds=...
 * alignment_us=... alignment_us: no two rows of different fingertips were ever further from their
 * true distance in time
 *
 * Rows are in order of time_us unless one came more than a quarter of a second late.
 * Acknowledgements are left out: they are in the clock lines.
 *
 * Lines end with \n and are written whole, one at a time: a killed recorder loses at most the line
 * under way.
 */
#pragma once

#include "libfingertip/clock_fit.hpp"
#include "libfingertip/decoder.hpp"
#include "libfingertip/output_file.hpp"
#include "libfingertip/wire.hpp"

#include <cstdint>
#include <deque>
#include <fstream>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace fingertip {

using Metadata = std::vector<std::pair<std::string, std::string>>;

/* The scalar fields of an info packet and the sensor positions, as recordings and people name them.
 */
Metadata info_metadata(const wire_info &info);

/* The counters of a health packet by name. */
std::vector<std::pair<std::string, std::uint32_t>> health_fields(const wire_health &health);

/* The lines that the packets of one fingertip become. */
class PacketLines {
public:
  using CommentHandler = std::function<void(const std::string &key, const std::string &value)>;
  /* Without the columns of the fingertip's number and the recorder's clock. */
  using RowHandler = std::function<void(std::uint64_t t_us, const std::string &cells)>;

  PacketLines(std::string path, std::uint8_t sensor_count, bool raw_expected,
              CommentHandler comment, RowHandler row);

  /* Throws Error if a raw packet has another number of sensors. */
  void packet(const wire_packet &packet);
  /* Those of its fields that are new. */
  void info(const wire_info &info);
  /* What waits for the other packet of its frame. */
  void write_pending();

  std::uint64_t frames() const { return frames_; }
  /* Device time over all runs of a device that restarted. */
  double seconds() const;

private:
  void row(const wire_packet *contact, const wire_packet *raw);

  std::string path_;
  std::uint8_t sensor_count_;
  bool raw_expected_;
  CommentHandler comment_;
  RowHandler row_;
  std::optional<wire_packet> pending_contact_;
  Metadata info_;                       /* as last written */
  std::uint64_t before_restart_us_ = 0; /* device time of earlier runs of the device */
  std::optional<std::uint64_t> first_us_;
  std::uint64_t last_us_ = 0;
  std::uint64_t frames_ = 0;
};

class RecordingWriter {
public:
  /* sensor_count: columns for raw packets, 0 to FT_MAX_SENSORS; extra: the recorder's own metadata.
   * raw_expected: a contact packet waits for the raw packet of its frame, to share its row. */
  RecordingWriter(const std::string &path, bool replace, const wire_info *info,
                  std::uint8_t sensor_count, const Metadata &extra, bool raw_expected,
                  OutputFile::Appears appears);

  /* Throws Error if the disk is full, or a raw packet has another number of sensors. */
  void packet(const wire_packet &packet);
  void event(const std::string &text);
  /* Last of all. */
  void finish(const LineStatistics &statistics, const std::string &reason);

  std::uint64_t frames() const { return lines_.frames(); }
  const std::string &path() const { return file_.path(); }

private:
  void line(const std::string &text);

  OutputFile file_;
  PacketLines lines_;
};

/* Several fingertips in one file. */
class JointRecordingWriter {
public:
  /* All of them with equally many sensors, or Error. */
  JointRecordingWriter(const std::string &path, bool replace, const std::vector<wire_info> &infos,
                       const Metadata &extra, std::int64_t host_zero_us, bool raw_expected,
                       OutputFile::Appears appears);

  /* host_us: its time on the recorder's clock. */
  void packet(std::size_t device, const wire_packet &packet, double host_us);
  void event(std::size_t device, const std::string &text);
  void clock(std::size_t device, const ClockEstimate &estimate, unsigned jumps);
  /* Rows older than this on the recorder's clock may go to the file. */
  void settle(double host_us);
  void finish(const std::vector<LineStatistics> &statistics, const std::string &reason);

  std::uint64_t frames() const;
  std::uint64_t frames(std::size_t device) const { return devices_[device].lines.frames(); }
  /* The bound on the distance in time of two rows of different fingertips, so far. */
  double alignment_us() const { return alignment_us_; }
  const std::string &path() const { return file_.path(); }

private:
  struct Device {
    explicit Device(PacketLines packet_lines) : lines(std::move(packet_lines)) {}
    PacketLines lines;
    std::uint64_t packet_t_us = 0; /* of the packet under way, */
    double packet_host_us = 0;     /* on both clocks */
    std::optional<ClockEstimate> clock;
    unsigned jumps = 0;
    double clock_written_us = 0;
  };

  void line(const std::string &text);
  std::string time_text(double host_us) const;

  OutputFile file_;
  std::int64_t host_zero_us_;
  std::vector<Device> devices_;
  std::multimap<double, std::string> waiting_; /* rows by their time */
  double alignment_us_ = 0;
  double last_us_ = 0;
};

class RecordingReader {
public:
  struct Item {
    enum class Kind { packet, event } kind;
    wire_packet packet;
    std::string event;
  };

  /* salvage: skip damaged lines and count them, instead of throwing Error with file and line.
   * device: the serial number of one of several fingertips; empty: the only one. */
  RecordingReader(const std::string &path, bool salvage, const std::string &device = "");

  /* Nothing at the end of the file. */
  std::optional<Item> next();

  std::uint64_t skipped_lines() const { return skipped_lines_; }
  /* Whether the end line was seen: without one the recording was cut short. */
  bool has_end() const { return has_end_; }

private:
  void read_line(const std::string &text);
  void read_comment(const std::string &text);
  void read_row(std::string_view text);
  void choose_device(const std::string &serials);
  [[noreturn]] void damaged(const std::string &what) const;

  std::string path_;
  bool salvage_;
  std::ifstream file_;
  std::uint64_t line_number_ = 0;
  std::uint64_t skipped_lines_ = 0;
  bool header_seen_ = false;
  bool has_end_ = false;
  std::uint8_t sensor_count_ = 0;
  bool joint_ = false; /* of several fingertips */
  std::string wanted_; /* serial number */
  std::string number_; /* of the wanted one in a joint recording */
  wire_info info_;
  std::deque<Item> items_;
};

} // namespace fingertip
