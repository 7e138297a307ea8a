/* Recordings: what a fingertip said, as a CSV file that people, pandas and numpy read as it is.
 *
 *   # fingertip-recording 1
 *   # key: value              of the info packet: serial, board, scene, firmware, git, sensors,
 *                             rate_mHz, osr, ..., x_mm and y_mm of the sensors; of the recorder
 *   t_us,frame,sequence,flags,...,total_us,raw_sequence,...,s0_Pa,...,tare0_Pa,...
 *                             one row per frame: a contact and a raw packet; cells of one that
 *                             did not come are empty
 *   # packet: NAME key=value  every other packet, where it came; before an info packet stand those
 *                             of its fields that are new, as "# key: value"
 *   # event: text             "gone" and "back" of the port among others
 *   # end: key=value ...      totals, over all runs of a device that restarted; absent if the
 *                             recorder was killed or the disk was full
 *
 * Times are device time in us, pressures Pa with four decimals (exact: the wire carries 1/1024 Pa),
 * floats the shortest text that reads back the same. So nothing of the packets is lost.
 *
 * Lines end with \n and are written whole, one at a time: a killed recorder loses at most the line
 * under way.
 */
#pragma once

#include "libfingertip/decoder.hpp"
#include "libfingertip/output_file.hpp"
#include "libfingertip/wire.hpp"

#include <cstdint>
#include <deque>
#include <fstream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace fingertip {

using Metadata = std::vector<std::pair<std::string, std::string>>;

/* The scalar fields of an info packet and the sensor positions, as recordings and people name them.
 */
Metadata info_metadata(const wire_info &info);

/* The counters of a health packet by name. */
std::vector<std::pair<std::string, std::uint32_t>> health_fields(const wire_health &health);

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

  std::uint64_t frames() const { return frames_; }
  const std::string &path() const { return file_.path(); }

private:
  void line(const std::string &text);
  void row(const wire_packet *contact, const wire_packet *raw);
  void write_pending();
  void write_info(const wire_info &info);

  OutputFile file_;
  std::uint8_t sensor_count_;
  bool raw_expected_;
  std::optional<wire_packet> pending_contact_;
  Metadata info_; /* as last written */
  std::uint64_t before_restart_us_ = 0; /* device time of earlier runs of the device */
  std::optional<std::uint64_t> first_us_;
  std::uint64_t last_us_ = 0;
  std::uint64_t frames_ = 0;
};

class RecordingReader {
public:
  struct Item {
    enum class Kind { packet, event } kind;
    wire_packet packet;
    std::string event;
  };

  /* salvage: skip damaged lines and count them, instead of throwing Error with file and line. */
  RecordingReader(const std::string &path, bool salvage);

  /* Nothing at the end of the file. */
  std::optional<Item> next();

  std::uint64_t skipped_lines() const { return skipped_lines_; }
  /* Whether the end line was seen: without one the recording was cut short. */
  bool has_end() const { return has_end_; }

private:
  void read_line(const std::string &text);
  void read_comment(const std::string &text);
  void read_row(const std::string &text);
  [[noreturn]] void damaged(const std::string &what) const;

  std::string path_;
  bool salvage_;
  std::ifstream file_;
  std::uint64_t line_number_ = 0;
  std::uint64_t skipped_lines_ = 0;
  bool header_seen_ = false;
  bool has_end_ = false;
  std::uint8_t sensor_count_ = 0;
  wire_info info_;
  std::deque<Item> items_;
};

} // namespace fingertip
