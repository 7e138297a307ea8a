/* The packets in a file: a recording, or the bytes of the line as they came
 * (.ftr, also what the emulator captures). The first line shows that it is a recording. */
#pragma once

#include "libfingertip/decoder.hpp"
#include "libfingertip/recording_reader.hpp"

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>

#pragma GCC visibility push(default)
namespace fingertip {

/* Events in recordings: the port vanished here, and was there again. */
inline constexpr const char *EVENT_GONE = "gone";
inline constexpr const char *EVENT_BACK = "back";

class PacketFile {
public:
  using Item = RecordingReader::Item;

  /* Throws Error if the file cannot be read; so does next for a damaged line, unless salvaging.
   * device: the serial number of one of several fingertips in the file. */
  PacketFile(const std::string &path, bool salvage, const std::string &device = "", const TimeSpan &interval = {});
  /* All fingertips in other bytes than those of a file, whose other exceptions than Error pass: next may then be
   * called again. path: for messages. */
  PacketFile(const std::string &path, bool salvage, std::unique_ptr<ByteSource> bytes);

  /* Nothing at the end of the file. */
  std::optional<Item> next();

  /* The position of reading, to go back to. */
  struct State {
    SequenceFollower sequence;
    Decoder decoder; /* of a capture */
    std::deque<Item> decoded;
    std::uint64_t offset = 0;
    LineStatistics statistics;
    bool ended = false, begun = true; /* begun: a frame of the interval came. What is left out before it is no loss. */
  };
  struct Place {
    std::optional<RecordingReader::Place> in_recording;
    State state;
  };
  Place place();
  void go_to(const Place &place);

  /* The line's counters by the packets until now. At the end of a recording they are those of its recorder, which saw the line itself. */
  const LineStatistics &statistics() const { return state_.statistics; }
  /* Whether a recording has no end line; known at the end of the file. */
  bool is_cut_short() const { return state_.ended && !has_end(); }
  bool has_end() const { return reader_ ? reader_->has_end() : state_.ended; }
  std::uint64_t skipped_lines() const { return reader_ ? reader_->skipped_lines() : 0; }
  /* The recorder's own keys, once the first item was read. */
  Metadata recorder_metadata() const { return reader_ ? reader_->recorder_metadata() : Metadata(); }
  /* The reader of a recording, else nullptr. */
  const RecordingReader *recording() const { return reader_.get(); }
  /* The same as Decoder's, of a capture. */
  std::uint8_t other_version() const { return state_.decoder.other_version(); }

private:
  std::optional<Item> next_of_recording();
  std::optional<Item> next_of_capture();

  std::unique_ptr<RecordingReader> reader_; /* of a recording */
  std::unique_ptr<ByteSource> bytes_;       /* of a capture */
  State state_;
};

} // namespace fingertip
#pragma GCC visibility pop
