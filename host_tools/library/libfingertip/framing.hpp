/* Packets as bytes, for programs that pass them on without a look at their content, also those of
 * types that this library does not know (PROTOCOL.md, frame and header). */
#pragma once

#include "libfingertip/wire.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace fingertip {

using Bytes = std::vector<std::uint8_t>;

/* Header and body of an undamaged packet, of whatever version and type. */
class Envelope {
public:
  /* A frame without its delimiter; nothing if it is damaged. */
  static std::optional<Envelope> opened(Bytes frame);
  /* packet: header and body. */
  explicit Envelope(Bytes packet) : packet_(std::move(packet)) {}

  /* The version without what a wide packet adds. */
  std::uint8_t version() const { return packet_[0] & (WIRE_WIDE - 1); }
  std::uint8_t type() const { return packet_[1]; }
  std::uint16_t sequence() const;
  void set_sequence(std::uint16_t sequence);
  std::uint8_t *body() { return packet_.data() + WIRE_HEADER_BYTES; }
  std::size_t body_length() const { return packet_.size() - WIRE_HEADER_BYTES; }

  /* Appends the frame with its CRC and delimiter. */
  void append_frame(Bytes &to) const;

private:
  Bytes packet_;
};

/* Cuts a line at its delimiters. */
class FrameCutter {
public:
  /* frame: without its delimiter, never empty. Of a frame that is longer than any valid one it is
   * the beginning, which is too long as well. joining: it may have begun before the first byte. */
  using Handler = std::function<void(const Bytes &frame, bool joining)>;

  void feed(const std::uint8_t *bytes, std::size_t length, const Handler &handler);

private:
  Bytes frame_;
  bool joining_ = true;
};

} // namespace fingertip
