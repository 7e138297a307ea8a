#include "libfingertip/recording_lines.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/recording_fields.hpp"

#include <algorithm>

namespace fingertip {

using namespace recording;

PacketLines::PacketLines(std::string path, std::uint8_t sensor_count, bool raw_expected, CommentHandler comment,
                         RowHandler row)
    : path_(std::move(path)), sensor_count_(sensor_count), raw_expected_(raw_expected), comment_(std::move(comment)),
      row_(std::move(row)) {}

void PacketLines::info(const wire_info &info) {
  Metadata all = info_metadata(info);
  for (const auto &pair : all) {
    if (std::find(info_.begin(), info_.end(), pair) == info_.end()) {
      comment_(pair.first, pair.second);
    }
  }
  info_ = all;
}

double PacketLines::seconds() const {
  return static_cast<double>(before_restart_us_ + (first_us_ ? last_us_ - *first_us_ : 0)) / 1e6;
}

std::string PacketLines::edges_text() const {
  return edges_.edges() == 0
             ? ""
             : " edges=" + std::to_string(edges_.edges()) + " edges_missing=" + std::to_string(edges_.missing());
}

void PacketLines::row(const wire_packet *contact, const wire_packet *raw) {
  const wire_packet &any = contact ? *contact : *raw;
  row_(any.t_us, row_text(contact, raw, sensor_count_));
  frames_++;
  if (first_us_ && any.t_us < last_us_) {
    before_restart_us_ += last_us_ - *first_us_;
    first_us_.reset();
  }
  first_us_ = first_us_.value_or(any.t_us);
  last_us_ = any.t_us;
}

void PacketLines::write_pending() {
  if (pending_contact_) {
    wire_packet contact = *pending_contact_;
    pending_contact_.reset();
    row(&contact, nullptr);
  }
}

void PacketLines::packet(const wire_packet &packet) {
  wire_packet copy = packet;
  PairWriter writer;
  writer("sequence", packet.sequence);
  writer("t_us", packet.t_us);
  switch (packet.type) {
  case WIRE_CONTACT:
    write_pending();
    if (raw_expected_) {
      pending_contact_ = packet;
    } else {
      row(&packet, nullptr);
    }
    return;
  case WIRE_RAW:
    if (packet.body.raw.sensor_count != sensor_count_) {
      throw Error(ErrorCode::other_sensor_count, path_ + ": the fingertip now has " +
                                                     std::to_string(packet.body.raw.sensor_count) +
                                                     " sensors instead of " + std::to_string(sensor_count_));
    }
    if (pending_contact_ && pending_contact_->body.contact.frame == packet.body.raw.frame &&
        pending_contact_->t_us == packet.t_us) {
      wire_packet contact = *pending_contact_;
      pending_contact_.reset();
      row(&contact, &packet);
    } else {
      write_pending();
      row(nullptr, &packet);
    }
    return;
  case WIRE_HEALTH:
    write_pending();
    visit_health(writer, copy.body.health);
    comment_("packet", PACKET_HEALTH + writer.text());
    return;
  case WIRE_ACK:
    write_pending();
    visit_ack(writer, copy.body.ack);
    comment_("packet", PACKET_ACK + writer.text());
    return;
  case WIRE_SYNC:
    write_pending();
    edges_.take(packet.body.sync);
    visit_sync(writer, copy.body.sync);
    comment_("packet", PACKET_SYNC + writer.text());
    return;
  case WIRE_INFO:
    write_pending();
    info(packet.body.info);
    comment_("packet", PACKET_INFO + writer.text());
    return;
  default:
    return;
  }
}

} // namespace fingertip
