#include "libfingertip/packet_file.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/packet_fields.hpp"

#include <utility>

namespace fingertip {

PacketFile::PacketFile(const std::string &path, bool salvage, const std::string &device, const TimeSpan &interval)
    : bytes_(open_bytes(path)) {
  state_.begun = interval.from_s <= 0;
  if (is_recording(path, *bytes_)) {
    reader_ = std::make_unique<RecordingReader>(path, salvage, device, interval);
  } else if (!interval.is_all()) {
    throw Error(path + ": bytes of a line have no times to choose from; fingertip convert makes a recording of them");
  }
}

PacketFile::PacketFile(const std::string &path, bool salvage, std::unique_ptr<ByteSource> bytes) : bytes_(std::move(bytes)) {
  if (is_recording(path, *bytes_)) {
    reader_ = std::make_unique<RecordingReader>(path, salvage, lines_of(path, std::move(bytes_)));
  }
}

std::optional<PacketFile::Item> PacketFile::next() { return reader_ ? next_of_recording() : next_of_capture(); }

std::optional<PacketFile::Item> PacketFile::next_of_recording() {
  auto item = reader_->next();
  if (!item) {
    state_.ended = true;
    state_.statistics = reader_->end_statistics().value_or(state_.statistics);
  } else if (item->kind == Item::Kind::packet && !item->made) {
    state_.statistics.packets++;
    state_.sequence.follow(item->packet.sequence, state_.statistics);
    state_.begun = state_.begun || is_frame(item->packet);
    if (!state_.begun) {
      state_.sequence.restart();
    }
  } else if (item->kind == Item::Kind::event && item->event.rfind(EVENT_GONE, 0) == 0) {
    state_.sequence.restart();
  }
  return item;
}

std::optional<PacketFile::Item> PacketFile::next_of_capture() {
  char bytes[4096];
  while (state_.decoded.empty() && !state_.ended) {
    const std::size_t length = bytes_->read(state_.offset, bytes, sizeof bytes);
    state_.offset += length;
    state_.ended = length == 0;
    state_.decoder.feed(reinterpret_cast<const std::uint8_t *>(bytes), length, [this](const wire_packet &packet) {
      state_.decoded.push_back({Item::Kind::packet, packet, "", {}, 0, false});
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

PacketFile::Place PacketFile::place() { return {reader_ ? std::optional(reader_->place()) : std::nullopt, state_}; }

void PacketFile::go_to(const Place &place) {
  if (place.in_recording) {
    reader_->go_to(*place.in_recording);
  }
  state_ = place.state;
}

} // namespace fingertip
