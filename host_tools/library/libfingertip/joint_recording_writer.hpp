/* Writes several fingertips into one recording on one clock; recording.hpp has the format. */
#pragma once

#include "libfingertip/clock_fit.hpp"
#include "libfingertip/decoder.hpp"
#include "libfingertip/edge_alignment.hpp"
#include "libfingertip/line_sink.hpp"
#include "libfingertip/recording_lines.hpp"

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace fingertip {

class JointRecordingWriter {
public:
  /* All of them with equally many sensors, or Error. */
  JointRecordingWriter(const std::string &path, bool replace, const std::vector<wire_info> &infos,
                       const Metadata &extra, std::int64_t host_zero_us, bool raw_expected,
                       OutputFile::Appears appears);

  /* To other lines than those of a file. */
  JointRecordingWriter(std::unique_ptr<LineSink> file, const std::vector<wire_info> &infos, const Metadata &extra,
                       std::int64_t host_zero_us, bool raw_expected);

  /* host_us: its time on the recorder's clock, unless edges at the sync pins give a better one. */
  void packet(std::size_t device, const wire_packet &packet, double host_us);
  void event(std::size_t device, const std::string &text);
  void clock(std::size_t device, const ClockEstimate &estimate, unsigned jumps);
  /* A comment of the recorder's own, "# key: value", in order of time with the rows. The key holds no slash
   * and is no key of the format. */
  void comment(const std::string &key, double host_us, const std::string &value);
  /* Lines older than this on the recorder's clock may go to the file. */
  void settle(double host_us);
  void finish(const std::vector<LineStatistics> &statistics, const std::string &reason);

  std::uint64_t frames() const;
  std::uint64_t frames(std::size_t device) const { return devices_[device].lines.frames(); }
  /* The bound on the distance in time of two rows of different fingertips, so far. */
  double alignment_us() const { return alignment_us_; }
  /* The same of rows that edges have placed; 0: none. */
  double edges_alignment_us() const { return edges_alignment_us_; }
  const std::string &path() const { return file_->path(); }

private:
  struct Device {
    explicit Device(PacketLines packet_lines) : lines(std::move(packet_lines)) {}
    PacketLines lines;
    std::uint64_t packet_t_us = 0;   /* of the packet under way, */
    double packet_host_us = 0;       /* on both clocks */
    double last_line_us = 0;         /* position of its last line among those that wait */
    std::uint64_t newest_us = 0;     /* of its times */
    double edges_uncertainty_us = 0; /* of its last packet, if edges have placed it; else 0 */
    std::optional<ClockEstimate> clock;
    unsigned jumps = 0;
    double clock_written_us = 0;
  };

  void line(const std::string &text);
  /* Among those that wait, but never before an earlier one of the same fingertip. */
  void line(std::size_t device, double host_us, const std::string &text);
  std::string time_text(double host_us) const;

  std::unique_ptr<LineSink> file_;
  std::int64_t host_zero_us_;
  std::vector<Device> devices_;
  bool head_written_ = false;
  std::multimap<double, std::string> waiting_; /* lines by their time */
  EdgeAlignment edges_;
  double alignment_us_ = 0, edges_alignment_us_ = 0;
  double last_us_ = 0;
};

} // namespace fingertip
