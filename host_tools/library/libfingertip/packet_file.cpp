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
    state_.ended = true;
    state_.statistics = reader_->end_statistics().value_or(state_.statistics);
  } else if (item->kind == Item::Kind::packet) {
    state_.statistics.packets++;
    state_.sequence.follow(item->packet.sequence, state_.statistics);
  } else if (item->event.rfind(EVENT_GONE, 0) == 0) {
    state_.sequence.restart();
  }
  return item;
}

std::optional<PacketFile::Item> PacketFile::next_of_capture() {
  std::uint8_t bytes[4096];
  while (state_.decoded.empty() && !state_.ended) {
    bytes_.read(reinterpret_cast<char *>(bytes), sizeof bytes);
    auto length = static_cast<std::size_t>(bytes_.gcount());
    state_.ended = length == 0;
    state_.decoder.feed(bytes, length, [this](const wire_packet &packet) {
      state_.decoded.push_back({Item::Kind::packet, packet, ""});
    });
    state_.statistics = state_.decoder.statistics();
  }
  if (state_.decoded.empty()) {
    return std::nullopt;
  }
  Item item = std::move(state_.decoded.front());
  state_.decoded.pop_front();
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
  place.state = state_;
  return place;
}

void PacketFile::go_to(const Place &place) {
  if (place.in_recording) {
    reader_->go_to(*place.in_recording);
  } else {
    bytes_.clear();
    bytes_.seekg(place.offset);
  }
  state_ = place.state;
}

} // namespace fingertip
