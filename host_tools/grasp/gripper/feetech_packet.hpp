// Packets of Feetech's serial bus (feetech_table.hpp), to bytes and back.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace fingertip::feetech {

using Bytes = std::vector<std::uint8_t>;

struct Packet {
  std::uint8_t id = 0;
  std::uint8_t code = 0; // an instruction, or of an answer bits of enum Trouble
  Bytes parameters = {};
};

Bytes encoded(const Packet &packet);

// The first whole packet, taken out of the bytes together with what was before it. skipped counts
// bytes that belong to none: noise, or a packet whose checksum is wrong.
std::optional<Packet> take_packet(Bytes *bytes, std::size_t *skipped);

} // namespace fingertip::feetech
