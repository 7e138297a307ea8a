#include "libfingertip/recording_writer.hpp"

#include "libfingertip/recording_fields.hpp"

#include <utility>

namespace fingertip {

using namespace recording;

RecordingWriter::RecordingWriter(const std::string &path, bool replace, const wire_info *info,
                                 std::uint8_t sensor_count, const Metadata &extra, bool raw_expected,
                                 OutputFile::Appears appears)
    : RecordingWriter(make_lines(path, replace, appears), info, sensor_count, extra, raw_expected) {}

RecordingWriter::RecordingWriter(std::unique_ptr<LineSink> file, const wire_info *info, std::uint8_t sensor_count,
                                 const Metadata &extra, bool raw_expected)
    : file_(std::move(file)),
      lines_(
          file_->path(), sensor_count, raw_expected,
          [this](const std::string &key, const std::string &value) { line("# " + key + ": " + value); },
          [this](std::uint64_t, const std::string &cells) { line(cells); }) {
  line(std::string(FIRST_WORDS) + FORMAT_OF_ONE);
  for (const auto &[key, value] : extra) {
    line("# " + key + ": " + printable(value));
  }
  if (info) {
    lines_.info(*info);
  }
  line(header_text(sensor_count));
}

void RecordingWriter::line(const std::string &text) { file_->line(text); }

void RecordingWriter::packet(const wire_packet &packet) { lines_.packet(packet); }

void RecordingWriter::event(const std::string &text) {
  lines_.write_pending();
  line("# event: " + text);
}

void RecordingWriter::finish(const LineStatistics &statistics, const std::string &reason) {
  lines_.write_pending();
  line("# end: reason=" + reason + " frames=" + std::to_string(lines_.frames()) +
       " seconds=" + fixed(lines_.seconds(), 6) + lines_.edges_text() + " " + statistics.text());
  file_->finish();
}

} // namespace fingertip
