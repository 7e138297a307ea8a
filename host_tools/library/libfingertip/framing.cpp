#include "libfingertip/framing.hpp"

extern "C" {
#include "common/bytes.h"
#include "common/crc32.h"
#include "wire/cobs.h"
}

#include <algorithm>
#include <utility>

namespace fingertip {

constexpr std::size_t SEQUENCE_AT = 2;

std::optional<Envelope> Envelope::opened(Bytes frame) {
  const std::size_t used = cobs_decode(frame.data(), frame.size());
  if (used < WIRE_HEADER_BYTES + WIRE_CRC_BYTES) {
    return std::nullopt;
  }
  const std::size_t length = used - WIRE_CRC_BYTES;
  if (crc32_iso_hdlc(frame.data(), length) != bytes_get_u32(frame.data() + length)) {
    return std::nullopt;
  }
  frame.resize(length);
  return Envelope(std::move(frame));
}

std::uint16_t Envelope::sequence() const { return bytes_get_u16(packet_.data() + SEQUENCE_AT); }

void Envelope::set_sequence(std::uint16_t sequence) { bytes_put_u16(packet_.data() + SEQUENCE_AT, sequence); }

void Envelope::append_frame(Bytes &to) const {
  const std::size_t begin = to.size(), length = packet_.size() + WIRE_CRC_BYTES;
  to.resize(begin + length + length / 254 + 2);
  std::uint8_t *crc = std::copy(packet_.begin(), packet_.end(), to.data() + begin + 1);
  bytes_put_u32(crc, crc32_iso_hdlc(packet_.data(), packet_.size()));
  to.resize(begin + cobs_encode(to.data() + begin, length));
}

void FrameCutter::feed(const std::uint8_t *bytes, std::size_t length, const Handler &handler) {
  for (std::size_t i = 0; i < length; i++) {
    if (bytes[i] != 0) {
      if (frame_.size() <= WIRE_MAX_FRAME_BYTES) {
        frame_.push_back(bytes[i]);
      }
      continue;
    }
    if (!frame_.empty()) {
      handler(frame_, joining_);
      frame_.clear();
    }
    joining_ = false;
  }
}

} // namespace fingertip
