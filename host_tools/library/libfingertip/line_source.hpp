/* The lines of a recording, whatever file they are in: CSV, or MCAP (mcap_recording.hpp). */
#pragma once

#include <any>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <ios>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#pragma GCC visibility push(default)
namespace fingertip {

/* Where the bytes of a recording come from: a file, or a program's own memory. */
class ByteSource {
public:
  virtual ~ByteSource() = default;

  /* Fewer than length only where the bytes end. Throws Error where they cannot be read. */
  virtual std::size_t read(std::uint64_t at, char *to, std::size_t length) = 0;
  /* The total size. */
  virtual std::uint64_t size() const = 0;
};

class LineSource {
public:
  static constexpr std::size_t LINE_MOST_bytes = 1 << 20; /* a longer one is damaged */
  struct Line {
    std::uint64_t number;                                     /* from 1; where lines are lost, the next one's */
    std::string text;                                         /* without its end */
    bool torn;                                                /* the file ends within it, or it is too long */
    std::uint64_t left_out = 0;                               /* lines before it, which were not wanted */
    double time_s = std::numeric_limits<double>::quiet_NaN(); /* by the log time, since the recording began */
  };
  struct Place {
    std::streamoff offset = 0;
    std::size_t message = 0; /* of a chunk that begins there */
    std::uint64_t number = 0;
    std::any waiting = {}; /* the source's own */
  };

  virtual ~LineSource() = default;

  /* False at the end. Throws Error with file and place where they are damaged; the next call goes on behind the damage. */
  virtual bool next(Line &line) = 0;
  /* The position of reading, to go back to. */
  virtual Place place() = 0;
  virtual void go_to(const Place &place) = 0;
  /* What lies outside of these seconds since the recording began may be left out, notes and settings apart. */
  virtual void want(double from_s, double to_s) { (void)from_s, (void)to_s; }
};

/* Whether they begin as an MCAP file does. */
bool is_mcap(ByteSource &bytes);

/* Whether the first bytes are those of a recording, else of a capture of the line. path: for messages. Throws Error for what is neither. */
bool is_recording(const std::string &path, ByteSource &bytes);

/* The lines of a recording. path: for messages. */
std::unique_ptr<LineSource> lines_of(const std::string &path, std::unique_ptr<ByteSource> bytes);

/* The same of files. They throw Error if one cannot be read. */
std::unique_ptr<ByteSource> open_bytes(const std::string &path);
std::vector<std::uint8_t> all_bytes(const std::string &path);
std::unique_ptr<LineSource> open_lines(const std::string &path);

/* Seconds since a recording began, as the log times of an MCAP file count them (RECORDING.md). */
struct TimeSpan {
  double from_s = 0, to_s = std::numeric_limits<double>::infinity();
  bool is_all() const { return from_s == 0 && std::isinf(to_s); }
};
/* Its rows, packets and events within the interval, and all else that it holds. */
std::unique_ptr<LineSource> within(std::unique_ptr<LineSource> lines, const TimeSpan &interval);

} // namespace fingertip
#pragma GCC visibility pop
