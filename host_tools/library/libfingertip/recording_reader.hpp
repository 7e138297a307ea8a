/* Reads recordings, CSV or MCAP; RECORDING.md has the formats. */
#pragma once

#include "libfingertip/decoder.hpp"
#include "libfingertip/line_source.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/wire.hpp"

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#pragma GCC visibility push(default)
namespace fingertip {

/* Serial numbers of the fingertips in a joint recording; of any other file none. */
std::vector<std::string> fingertips_in(const std::string &path);

class RecordingReader {
public:
  struct Item {
    enum class Kind { packet, event } kind;
    wire_packet packet;
    std::string event;
    std::optional<double> time_us = {}; /* of a joint recording's rows, on the recorder's clock */
    std::uint32_t device = 0;           /* in a joint recording */
    bool made = false;                  /* an info packet of the head's keys: no such packet is in the file before the first row */
  };

  /* salvage: skip damaged lines and count them, instead of throwing Error with file and line.
   * device: the serial number of one of several fingertips; empty: the only one. */
  RecordingReader(const std::string &path, bool salvage, const std::string &device = "", const TimeSpan &interval = {});
  /* Reads all fingertips, from other lines than those of a file. Nothing is read before next. Other
   * exceptions of the lines than Error pass: next may then be called again. path: for messages. */
  RecordingReader(std::string path, bool salvage, std::unique_ptr<LineSource> lines);

  ~RecordingReader();
  RecordingReader(RecordingReader &&) noexcept;
  RecordingReader &operator=(RecordingReader &&) noexcept;

  /* Nothing at the end of the file. */
  std::optional<Item> next();
  /* Called for each line that next meets; is_read: false where it is damaged, and skipped. */
  using OnLine = std::function<void(const LineSource::Line &line, bool is_read)>;
  void set_on_line(OnLine on_line) { on_line_ = std::move(on_line); }

  /* The position of reading, to go back to. */
  struct State {
    std::uint64_t line_number = 0, skipped_lines = 0;
    std::uint64_t unplaced = 0;       /* of them, each for a part of the file that shows no number of a line */
    std::vector<std::string> damages; /* the first ones */
    bool header_seen = false, has_end = false;
    std::vector<wire_info> infos{wire_info{}}; /* of each fingertip */
    std::vector<bool> has_info{false};         /* whether it was given */
    std::deque<Item> items;
  };
  struct Place {
    LineSource::Place in_file;
    State state;
  };
  Place place() { return {source_->place(), state_}; }
  void go_to(const Place &place);

  std::uint64_t skipped_lines() const { return state_.skipped_lines; }
  /* What was wrong where any were skipped, with file and place: the first ones. */
  const std::vector<std::string> &damages() const { return state_.damages; }
  /* Whether the end line was seen: without one the recording was cut short. */
  bool has_end() const { return state_.has_end; }
  /* This fingertip's counts by its recorder, once the end was read. */
  const std::optional<LineStatistics> &end_statistics() const { return end_statistics_; }
  /* The recorder's own keys (recorded_by, started_utc, port, ...), once the first item was read. */
  const Metadata &recorder_metadata() const { return recorder_metadata_; }

private:
  void begin();
  bool read_next();
  void read_line(const std::string &text);
  void read_comment(const std::string &text);
  void put_info(std::uint32_t device, wire_packet packet, bool made);
  void read_row(std::string_view text, std::uint32_t device, std::optional<double> time_us = {});
  void choose_device(const std::string &serials);
  void read_end(std::string_view text);
  void read_info_field(wire_info &info, const std::string &key, const std::string &value);
  std::optional<std::uint32_t> device_of(std::string_view number, bool is_row = false) const;
  friend std::vector<std::string> fingertips_in(const std::string &path);

  std::string path_;
  bool salvage_;
  std::unique_ptr<LineSource> source_;
  OnLine on_line_ = [](const LineSource::Line &, bool) {};
  State state_;
  std::optional<LineStatistics> end_statistics_;
  Metadata recorder_metadata_;
  std::uint8_t sensor_count_ = 0;
  int sets_ = 0;       /* of columns that came later, as in the header */
  bool joint_ = false; /* of several fingertips */
  bool all_ = false;   /* of them are read */
  bool begun_ = false;
  std::string wanted_;                  /* serial number */
  std::optional<std::uint32_t> number_; /* of the wanted one in a joint recording */
  std::vector<std::string> devices_;    /* serial numbers, in a joint recording */
};

} // namespace fingertip
#pragma GCC visibility pop
