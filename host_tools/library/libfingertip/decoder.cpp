#include "libfingertip/decoder.hpp"

#include <utility>

namespace fingertip {

std::string LineStatistics::text() const {
  auto pair = [](const char *key, std::uint64_t value) { return std::string(key) + "=" + std::to_string(value); };
  return pair("packets", packets) + " " + pair("dropped_packets", dropped_packets) + " " +
         pair("out_of_order", out_of_order) + " " + pair("crc_errors", crc_errors) + " " +
         pair("format_errors", format_errors) + " " + pair("version_errors", version_errors) + " " +
         pair("unknown_types", unknown_types);
}

bool LineStatistics::set(std::string_view key, std::uint64_t value) {
  const std::pair<std::string_view, std::uint64_t &> fields[] = {{"packets", packets},
                                                                 {"dropped_packets", dropped_packets},
                                                                 {"out_of_order", out_of_order},
                                                                 {"crc_errors", crc_errors},
                                                                 {"format_errors", format_errors},
                                                                 {"version_errors", version_errors},
                                                                 {"unknown_types", unknown_types}};
  for (const auto &[name, field] : fields) {
    if (name == key) {
      field = value;
      return true;
    }
  }
  return false;
}

LineStatistics &LineStatistics::operator+=(const LineStatistics &other) {
  bytes += other.bytes;
  packets += other.packets;
  dropped_packets += other.dropped_packets;
  out_of_order += other.out_of_order;
  crc_errors += other.crc_errors;
  format_errors += other.format_errors;
  version_errors += other.version_errors;
  unknown_types += other.unknown_types;
  return *this;
}

Decoder::Decoder() { wire_receiver_init(&receiver_, wire_all_layouts); }

void Decoder::restart() {
  wire_receiver_init(&receiver_, wire_all_layouts);
  joining_ = true;
  sequence_.restart();
}

void SequenceFollower::follow(std::uint16_t sequence, LineStatistics &statistics) {
  if (expected_) {
    auto ahead = static_cast<std::uint16_t>(sequence - *expected_);
    if (ahead < 0x8000) {
      statistics.dropped_packets += ahead;
    } else {
      statistics.out_of_order++;
    }
  }
  expected_ = static_cast<std::uint16_t>(sequence + 1);
}

void Decoder::feed(const std::uint8_t *bytes, std::size_t length, const Handler &handler) {
  statistics_.bytes += length;
  for (std::size_t i = 0; i < length; i++) {
    wire_packet packet;
    ft_status status = wire_receive(&receiver_, bytes[i], &packet);
    bool torn_by_joining = joining_;
    if (bytes[i] == 0) {
      joining_ = false;
    }
    switch (status) {
    case FT_PENDING:
      break;
    case FT_OK:
      statistics_.packets++;
      sequence_.follow(packet.sequence, statistics_);
      handler(packet);
      break;
    case FT_ERR_TYPE:
      statistics_.unknown_types++;
      sequence_.follow(packet.sequence, statistics_);
      break;
    case FT_ERR_VERSION:
      statistics_.version_errors++;
      other_version_ = receiver_.frame[0]; /* the packet was decoded in place */
      break;
    case FT_ERR_CRC:
      statistics_.crc_errors += torn_by_joining ? 0 : 1;
      break;
    default:
      statistics_.format_errors += torn_by_joining ? 0 : 1;
      break;
    }
  }
}

} // namespace fingertip
