/* Writes recordings of one fingertip or of several on one clock; RECORDING.md has the formats. */
#pragma once

#include "libfingertip/decoder.hpp"
#include "libfingertip/edge_alignment.hpp"
#include "libfingertip/edge_counter.hpp"
#include "libfingertip/line_sink.hpp"
#include "libfingertip/packet_fields.hpp"

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace fingertip {

class RecordingWriter {
public:
  /* Of one. info: nullptr: not known yet. sensor_count: columns for raw packets, 0 to FT_MAX_SENSORS; extra: the
   * recorder's own metadata. raw_expected: a contact packet waits for the raw packet of its frame, to share its row. */
  RecordingWriter(std::unique_ptr<LineSink> file, const wire_info *info, std::uint8_t sensor_count, const Metadata &extra,
                  bool raw_expected);
  /* Of several, with equally many sensors, or Error. */
  RecordingWriter(std::unique_ptr<LineSink> file, const std::vector<wire_info> &infos, const Metadata &extra, std::int64_t host_zero_us,
                  bool raw_expected);
  RecordingWriter(const RecordingWriter &) = delete;
  RecordingWriter &operator=(const RecordingWriter &) = delete;

  /* Throws Error if the disk is full, or a raw packet has another number of sensors. host_us: of several, its time on
   * the recorder's clock, unless edges at the sync pins give a better one. */
  void packet(std::size_t device, const wire_packet &packet, double host_us);
  void packet(const wire_packet &packet) { this->packet(0, packet, 0); }
  void event(std::size_t device, const std::string &text);
  /* Last of all. statistics: of each. */
  void finish(const std::vector<LineStatistics> &statistics, const std::string &reason);

  /* The rest is for recordings of several, and does nothing in others. */
  void clock(std::size_t device, const ClockEstimate &estimate, unsigned jumps);
  /* A comment of the recorder's own, "# key: value", in order of time with the rows. The key holds no slash and is no key of the format. */
  void comment(const std::string &key, double host_us, const std::string &value);
  /* Lines older than this on the recorder's clock may go to the file. */
  void settle(double host_us);

  std::uint64_t frames() const;
  std::uint64_t frames(std::size_t device) const { return devices_[device].frames; }
  /* The bound on the distance in time of two rows of different fingertips, so far. */
  double alignment_us() const { return alignment_us_; }
  /* The same of rows that edges have placed; 0: none. */
  double edges_alignment_us() const { return edges_alignment_us_; }
  const std::string &path() const { return file_->path(); }

private:
  struct Device {
    std::optional<wire_packet> pending_contact;
    Metadata info;                       /* as last written */
    std::uint64_t before_restart_us = 0; /* device time of earlier runs of the device */
    std::optional<std::uint64_t> first_us;
    std::uint64_t last_us = 0;
    std::uint64_t frames = 0;
    EdgeCounter edges;

    std::uint64_t packet_t_us = 0;   /* of the packet under way, */
    double packet_host_us = 0;       /* on both clocks */
    double last_line_us = 0;         /* position of its last line among those that wait */
    std::uint64_t newest_us = 0;     /* of its times */
    double edges_uncertainty_us = 0; /* of its last packet, if edges have placed it; else 0 */
    std::optional<ClockEstimate> clock;
    unsigned jumps = 0;
    double clock_written_us = 0;
  };

  void begin(const Metadata &extra, const std::vector<wire_info> &infos);
  void place(std::size_t device, const wire_packet &packet, double host_us);
  /* At once in a recording of one; else among those that wait, but never before an earlier one of the same fingertip. */
  void line(std::size_t device, double host_us, const std::string &text);
  void write_comment(std::size_t device, const std::string &key, const std::string &value);
  void write_row(std::size_t device, const wire_packet *contact, const wire_packet *raw);
  void write_pending(std::size_t device);
  /* Those of its fields that are new. */
  void write_info(std::size_t device, const wire_info &info);
  std::string time_text(double host_us) const;

  std::unique_ptr<LineSink> file_;
  std::uint8_t sensor_count_;
  bool raw_expected_;
  std::optional<std::int64_t> host_zero_us_; /* of several */
  std::vector<Device> devices_;
  bool head_written_ = false;
  std::multimap<double, std::string> waiting_; /* lines by their time */
  EdgeAlignment edges_;
  double alignment_us_ = 0, edges_alignment_us_ = 0;
  double last_us_ = 0;
};

} // namespace fingertip
