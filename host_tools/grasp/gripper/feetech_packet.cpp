#include "grasp/gripper/feetech_packet.hpp"

#include <cstddef>
#include <numeric>

namespace fingertip::feetech {

namespace {

constexpr std::size_t HEAD = 4; // FF FF id length
constexpr std::uint8_t LEAST_LENGTH = 2;

std::uint8_t checksum(Bytes::const_iterator from, Bytes::const_iterator to) {
  return static_cast<std::uint8_t>(~std::accumulate(from, to, 0u));
}

} // namespace

Bytes encoded(const Packet &packet) {
  Bytes bytes;
  bytes.reserve(packet.parameters.size() + HEAD + LEAST_LENGTH);
  for (std::size_t byte : {std::size_t{0xFF}, std::size_t{0xFF}, std::size_t{packet.id},
                           packet.parameters.size() + LEAST_LENGTH, std::size_t{packet.code}}) {
    bytes.push_back(static_cast<std::uint8_t>(byte));
  }
  for (std::uint8_t byte : packet.parameters) {
    bytes.push_back(byte);
  }
  bytes.push_back(checksum(bytes.begin() + 2, bytes.end()));
  return bytes;
}

std::optional<Packet> take_packet(Bytes *bytes, std::size_t *skipped) {
  std::size_t at = 0;
  std::optional<Packet> packet;
  for (; at < bytes->size() && !packet; at++) {
    const std::size_t left = bytes->size() - at;
    const Bytes::const_iterator begin = bytes->begin() + static_cast<std::ptrdiff_t>(at);
    if (begin[0] != 0xFF || (left > 1 && begin[1] != 0xFF)) {
      continue;
    }
    if (left > 2 && begin[2] == 0xFF) {
      continue; // the head begins a byte later
    }
    if (left < HEAD) {
      break;
    }
    if (begin[3] < LEAST_LENGTH) {
      continue;
    }
    const std::ptrdiff_t size = static_cast<std::ptrdiff_t>(HEAD) + begin[3];
    if (static_cast<std::ptrdiff_t>(left) < size) {
      break;
    }
    if (checksum(begin + 2, begin + size - 1) != begin[size - 1]) {
      continue;
    }
    packet = Packet{begin[2], begin[4], Bytes(begin + 5, begin + size - 1)};
    *skipped += at;
    bytes->erase(bytes->begin(), begin + size);
    return packet;
  }
  *skipped += at;
  bytes->erase(bytes->begin(), bytes->begin() + static_cast<std::ptrdiff_t>(at));
  return packet;
}

} // namespace fingertip::feetech
