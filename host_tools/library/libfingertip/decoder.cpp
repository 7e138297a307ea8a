#include "libfingertip/decoder.hpp"

#include "libfingertip/text.hpp"

namespace fingertip {

const std::array<LineStatistics::Named, 7> LineStatistics::counts = {{{"packets", &LineStatistics::packets},
                                                                      {"dropped_packets", &LineStatistics::dropped_packets},
                                                                      {"out_of_order", &LineStatistics::out_of_order},
                                                                      {"crc_errors", &LineStatistics::crc_errors},
                                                                      {"format_errors", &LineStatistics::format_errors},
                                                                      {"version_errors", &LineStatistics::version_errors},
                                                                      {"unknown_types", &LineStatistics::unknown_types}}};

std::string LineStatistics::text() const {
  return joined(counts, " ", [&](const Named &each) { return each.name + ("=" + std::to_string(this->*each.count)); });
}

bool LineStatistics::set(std::string_view key, std::uint64_t value) {
  for (const auto &[name, count] : counts) {
    if (name == key) {
      this->*count = value;
      return true;
    }
  }
  return false;
}

LineStatistics &LineStatistics::operator+=(const LineStatistics &other) {
  bytes += other.bytes;
  for (const auto &[name, count] : counts) {
    this->*count += other.*count;
  }
  return *this;
}

LineStatistics LineStatistics::operator-(const LineStatistics &before) const {
  LineStatistics now = *this;
  now.bytes -= before.bytes;
  for (const auto &[name, count] : counts) {
    now.*count -= before.*count;
  }
  return now;
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
    case FT_PENDING: break;
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
    case FT_ERR_CRC: statistics_.crc_errors += torn_by_joining ? 0 : 1; break;
    default: statistics_.format_errors += torn_by_joining ? 0 : 1; break;
    }
  }
}

} // namespace fingertip
