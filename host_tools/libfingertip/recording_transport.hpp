/* A file in place of a fingertip: a recording (CSV, recording.hpp), or the bytes of the line as
 * they came (.ftr, also what the emulator captures). A recording is told by its first line.
 *
 * A recording is given back as the bytes that made it. Where the port was gone while recording,
 * read says gone and reopen succeeds at once. Nothing waits: the speed is the caller's matter.
 */
#pragma once

#include "libfingertip/recording.hpp"
#include "libfingertip/transport.hpp"

#include <memory>

namespace fingertip {

/* In recordings: the port vanished here. */
inline constexpr const char *EVENT_GONE = "gone";

class RecordingTransport : public Transport {
public:
  /* Throws Error if the file cannot be read; so does read for a damaged line, unless salvaging.
   * device: the serial number of one of several fingertips in the file. */
  RecordingTransport(const std::string &path, bool salvage, const std::string &device = "");

  Result read(std::uint8_t *bytes, std::size_t capacity, std::size_t *length,
              std::chrono::milliseconds timeout) override;
  bool write(const std::uint8_t *bytes, std::size_t length) override;
  bool reopen() override;
  std::string description() const override { return path_; }

  /* At the end of the file: a recording without its end line. */
  bool is_cut_short() const { return ended_ && reader_ && !reader_->has_end(); }
  std::uint64_t skipped_lines() const { return reader_ ? reader_->skipped_lines() : 0; }

private:
  std::string path_;
  std::unique_ptr<RecordingReader> reader_; /* of a recording */
  std::ifstream bytes_;                     /* of a capture */
  std::vector<std::uint8_t> waiting_;
  bool interrupted_ = false;
  bool ended_ = false;
};

} // namespace fingertip
