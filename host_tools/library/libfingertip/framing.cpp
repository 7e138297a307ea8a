#include "libfingertip/framing.hpp"

extern "C" {
#include "common/bytes.h"
#include "common/crc32.h"
}

namespace fingertip {

namespace {

constexpr std::size_t SEQUENCE_AT = 2;
constexpr std::size_t LONGEST_RUN = 255;

/* PROTOCOL.md: COBS. Nothing for bytes that no encoder produces. */
std::optional<Bytes> unstuffed(const Bytes &frame) {
  Bytes packet;
  packet.reserve(frame.size());
  for (std::size_t at = 0; at < frame.size();) {
    std::size_t run = frame[at];
    if (run == 0 || run > frame.size() - at) {
      return std::nullopt;
    }
    auto begin = frame.begin() + static_cast<std::ptrdiff_t>(at);
    packet.insert(packet.end(), begin + 1, begin + static_cast<std::ptrdiff_t>(run));
    at += run;
    if (run != LONGEST_RUN && at < frame.size()) {
      packet.push_back(0);
    }
  }
  return packet;
}

} // namespace

std::optional<Envelope> Envelope::opened(const Bytes &frame) {
  auto packet = unstuffed(frame);
  if (!packet || packet->size() < WIRE_HEADER_BYTES + WIRE_CRC_BYTES) {
    return std::nullopt;
  }
  std::size_t length = packet->size() - WIRE_CRC_BYTES;
  if (crc32_iso_hdlc(packet->data(), length) != bytes_get_u32(packet->data() + length)) {
    return std::nullopt;
  }
  packet->resize(length);
  return Envelope(std::move(*packet));
}

std::uint16_t Envelope::sequence() const { return bytes_get_u16(packet_.data() + SEQUENCE_AT); }

void Envelope::set_sequence(std::uint16_t sequence) { bytes_put_u16(packet_.data() + SEQUENCE_AT, sequence); }

void Envelope::append_frame(Bytes &to) const {
  std::uint8_t crc[WIRE_CRC_BYTES];
  bytes_put_u32(crc, crc32_iso_hdlc(packet_.data(), packet_.size()));
  std::size_t code_at = to.size();
  to.push_back(0);
  auto end_run = [&] {
    to[code_at] = static_cast<std::uint8_t>(to.size() - code_at);
    code_at = to.size();
    to.push_back(0);
  };
  auto put = [&](std::uint8_t byte) {
    if (to.size() - code_at == LONGEST_RUN) {
      end_run(); /* of a full run no zero follows, and none is needed at the end */
    }
    if (byte == 0) {
      end_run();
    } else {
      to.push_back(byte);
    }
  };
  for (std::uint8_t byte : packet_) {
    put(byte);
  }
  for (std::uint8_t byte : crc) {
    put(byte);
  }
  to[code_at] = static_cast<std::uint8_t>(to.size() - code_at);
  to.push_back(0);
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
