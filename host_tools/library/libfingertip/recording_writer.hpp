/* Writes the recording of one fingertip; recording.hpp has the format. */
#pragma once

#include "libfingertip/decoder.hpp"
#include "libfingertip/line_sink.hpp"
#include "libfingertip/recording_lines.hpp"

#include <cstdint>
#include <memory>
#include <string>

namespace fingertip {

class RecordingWriter {
public:
  /* sensor_count: columns for raw packets, 0 to FT_MAX_SENSORS; extra: the recorder's own metadata.
   * raw_expected: a contact packet waits for the raw packet of its frame, to share its row. */
  RecordingWriter(const std::string &path, bool replace, const wire_info *info, std::uint8_t sensor_count,
                  const Metadata &extra, bool raw_expected, OutputFile::Appears appears);

  /* To other lines than those of a file. */
  RecordingWriter(std::unique_ptr<LineSink> file, const wire_info *info, std::uint8_t sensor_count,
                  const Metadata &extra, bool raw_expected);

  /* Throws Error if the disk is full, or a raw packet has another number of sensors. */
  void packet(const wire_packet &packet);
  void event(const std::string &text);
  /* Last of all. */
  void finish(const LineStatistics &statistics, const std::string &reason);

  std::uint64_t frames() const { return lines_.frames(); }
  const std::string &path() const { return file_->path(); }

private:
  void line(const std::string &text);

  std::unique_ptr<LineSink> file_;
  PacketLines lines_;
};

} // namespace fingertip
