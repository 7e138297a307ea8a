// Bytes of a fingertip's line, made of an input: raw bytes, and packets with a header, a CRC and
// COBS that are right, so that what is behind them is reached.
#pragma once

#include "fuzz.h"
#include "libfingertip/framing.hpp"
#include "libfingertip/wire.hpp"

namespace fuzz {

// On the line; what was decoded can always be encoded.
inline fingertip::Bytes encoded(const wire_packet &packet) {
  fingertip::Bytes frame(WIRE_MAX_FRAME_BYTES);
  std::size_t length = 0;
  FUZZ_CHECK(wire_encode(wire_find_layout(wire_all_layouts, packet.type), &packet, frame.data(), &length) == FT_OK);
  FUZZ_CHECK(length <= WIRE_MAX_FRAME_BYTES);
  frame.resize(length);
  return frame;
}

inline void append_packet(fingertip::Bytes &line, fuzz_input &input, std::uint8_t type, std::size_t body_length) {
  fingertip::Bytes packet = {WIRE_VERSION, type};
  for (int i = 2; i < WIRE_HEADER_BYTES; i++) {
    packet.push_back(fuzz_u8(&input));
  }
  const std::uint8_t *body = fuzz_bytes(&input, &body_length);
  packet.insert(packet.end(), body, body + body_length);
  fingertip::Envelope(std::move(packet)).append_frame(line);
}

// What the first byte says; types of both directions.
inline void append_part(fingertip::Bytes &line, fuzz_input &input) {
  const std::uint8_t kind = fuzz_u8(&input);
  if (kind >= 0xC0) { // raw
    std::size_t length = kind & 0x3F;
    const std::uint8_t *bytes = fuzz_bytes(&input, &length);
    line.insert(line.end(), bytes, bytes + length);
    return;
  }
  const auto type = static_cast<std::uint8_t>((kind & 0x80) | (kind & 0x0F));
  const std::size_t start = line.size();
  append_packet(line, input, type, fuzz_u16(&input) % (WIRE_MAX_BODY_BYTES + 8));
  if (kind & 0x40) { // damaged
    line[start + fuzz_u16(&input) % (line.size() - start)] ^= fuzz_u8(&input);
  }
}

inline fingertip::Bytes line_of(fuzz_input &input) {
  fingertip::Bytes line;
  while (fuzz_left(&input) > 0) {
    append_part(line, input);
  }
  return line;
}

} // namespace fuzz
