#include "libfingertip/packet_file.hpp"

#include "libfingertip/error.hpp"

#include <cerrno>
#include <cstring>

namespace fingertip {

PacketFile::PacketFile(const std::string &path, bool salvage, const std::string &device) {
  bytes_.open(path, std::ios::binary);
  std::string start(4096, ' '); /* several frames, each of which would end with 0x00 */
  if (!bytes_ || (!bytes_.read(start.data(), 4096) && !bytes_.eof())) {
    throw Error(ErrorCode::cannot_read, path + ": " + std::strerror(errno));
  }
  start.resize(static_cast<std::size_t>(bytes_.gcount()));
  bytes_.clear();
  bytes_.seekg(0);
  if (start.rfind("# fingertip-", 0) == 0 || is_mcap(path)) {
    bytes_.close();
    reader_ = std::make_unique<RecordingReader>(path, salvage, device);
  } else if (!start.empty() && start.find('\0') == std::string::npos) {
    throw Error(ErrorCode::not_a_recording, path + ": neither a recording nor bytes of a fingertip's line");
  }
}

std::optional<PacketFile::Item> PacketFile::next() { return reader_ ? next_of_recording() : next_of_capture(); }

std::optional<PacketFile::Item> PacketFile::next_of_recording() {
  auto item = reader_->next();
  if (!item) {
    ended_ = true;
    statistics_ = reader_->end_statistics().value_or(statistics_);
  } else if (item->kind == Item::Kind::packet) {
    statistics_.packets++;
    sequence_.follow(item->packet.sequence, statistics_);
  } else if (item->event.rfind(EVENT_GONE, 0) == 0) {
    sequence_.restart();
  }
  return item;
}

std::optional<PacketFile::Item> PacketFile::next_of_capture() {
  std::uint8_t bytes[4096];
  while (decoded_.empty() && !ended_) {
    bytes_.read(reinterpret_cast<char *>(bytes), sizeof bytes);
    auto length = static_cast<std::size_t>(bytes_.gcount());
    ended_ = length == 0;
    decoder_.feed(bytes, length, [this](const wire_packet &packet) {
      decoded_.push_back({Item::Kind::packet, packet, ""});
    });
    statistics_ = decoder_.statistics();
  }
  if (decoded_.empty()) {
    return std::nullopt;
  }
  Item item = std::move(decoded_.front());
  decoded_.pop_front();
  return item;
}

PacketFile::Place PacketFile::place() {
  Place place;
  if (reader_) {
    place.in_recording = reader_->place();
  } else {
    bytes_.clear(); /* of the end */
    place.offset = bytes_.tellg();
  }
  place.decoder = decoder_;
  place.decoded = decoded_;
  place.sequence = sequence_;
  place.statistics = statistics_;
  place.ended = ended_;
  return place;
}

void PacketFile::go_to(const Place &place) {
  if (place.in_recording) {
    reader_->go_to(*place.in_recording);
  } else {
    bytes_.clear();
    bytes_.seekg(place.offset);
  }
  decoder_ = place.decoder;
  decoded_ = place.decoded;
  sequence_ = place.sequence;
  statistics_ = place.statistics;
  ended_ = place.ended;
}

} // namespace fingertip
