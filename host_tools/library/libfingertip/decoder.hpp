/* Bytes of the line to packets, with counters of everything that went wrong on the way.
 *
 * After any damage the decoder goes on after the next 0x00 (PROTOCOL.md, resynchronisation). A
 * receiver that joins gets only the end of the first frame. Its failure counts as nothing. */
#pragma once

#include "libfingertip/wire.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#pragma GCC visibility push(default)
namespace fingertip {

struct LineStatistics {
  std::uint64_t bytes = 0;
  std::uint64_t packets = 0;         /* undamaged and of a known type */
  std::uint64_t dropped_packets = 0; /* missing from the sequence */
  std::uint64_t out_of_order = 0;    /* repeated, or older than one before */
  std::uint64_t crc_errors = 0;
  std::uint64_t format_errors = 0; /* right or no CRC, but no frame of this protocol */
  std::uint64_t version_errors = 0;
  std::uint64_t unknown_types = 0; /* undamaged, from a newer firmware */

  /* All but bytes, by their names. */
  struct Named {
    const char *name;
    std::uint64_t LineStatistics::*count;
  };
  static const std::array<Named, 7> counts;

  /* "packets=7 dropped_packets=0 ...", as recordings end with. */
  std::string text() const;
  /* Takes one of these; false if it is none. */
  bool set(std::string_view key, std::uint64_t value);

  LineStatistics &operator+=(const LineStatistics &other);
  LineStatistics operator-(const LineStatistics &before) const;
};

/* Packet loss, by the sequence numbers. */
class SequenceFollower {
public:
  void follow(std::uint16_t sequence, LineStatistics &statistics);
  /* Expect no particular number next. */
  void restart() { expected_.reset(); }

private:
  std::optional<std::uint16_t> expected_;
};

class Decoder {
public:
  using Handler = std::function<void(const wire_packet &)>;

  Decoder();

  /* Calls the handler for each packet that these bytes complete. */
  void feed(const std::uint8_t *bytes, std::size_t length, const Handler &handler);

  /* The line was interrupted: join again, and expect no particular sequence number. */
  void restart();

  const LineStatistics &statistics() const { return statistics_; }
  /* The version of the last packet that counted as a version error. */
  std::uint8_t other_version() const { return other_version_; }

private:
  wire_receiver receiver_;
  bool joining_ = true;
  SequenceFollower sequence_;
  LineStatistics statistics_;
  std::uint8_t other_version_ = 0;
};

} // namespace fingertip
#pragma GCC visibility pop
