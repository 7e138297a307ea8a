/* Fields of packets, by the names that recordings and people use. */
#pragma once

#include "libfingertip/wire.hpp"

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#pragma GCC visibility push(default)
namespace fingertip {

using Metadata = std::vector<std::pair<std::string, std::string>>;

/* The text of a field that is padded with zeros, if there is room. */
std::string text_field(const char *field);

/* Serial numbers are hexadecimal digits; people type either case. */
bool is_same_serial(const std::string &a, const std::string &b);

/* Whether it is of a frame: a contact or a raw packet; and the flags of one. */
inline bool is_frame(const wire_packet &packet) { return packet.type == WIRE_CONTACT || packet.type == WIRE_RAW; }
inline std::uint32_t flags_of(const wire_packet &packet) {
  return packet.type == WIRE_RAW ? packet.body.raw.flags : packet.body.contact.flags;
}
/* Whether its firmware runs on a computer, with simulated sensors. */
inline bool is_simulated(const wire_info &info) { return text_field(info.board) == "native"; }
/* Whether a raw packet follows each contact packet, where both are streamed. */
inline bool sends_both(const wire_info &info) {
  constexpr std::uint32_t BOTH = WIRE_CAPABILITY_FIT | WIRE_CAPABILITY_RAW_STREAM;
  return (info.capabilities & BOTH) == BOTH;
}

/* The scalar fields of an info packet, the sensor positions, and the calibration and the pad's profile where there are any. */
Metadata info_metadata(const wire_info &info);

/* The counters of a health packet. */
std::vector<std::pair<std::string, std::uint64_t>> health_fields(const wire_health &health);

} // namespace fingertip
#pragma GCC visibility pop
