/* The lines that the packets of one fingertip become, for the writers of recordings. */
#pragma once

#include "libfingertip/edge_counter.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/wire.hpp"

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

namespace fingertip {

class PacketLines {
public:
  using CommentHandler = std::function<void(const std::string &key, const std::string &value)>;
  /* Without the columns of the fingertip's number and the recorder's clock. */
  using RowHandler = std::function<void(std::uint64_t t_us, const std::string &cells)>;

  PacketLines(std::string path, std::uint8_t sensor_count, bool raw_expected, CommentHandler comment, RowHandler row);

  /* Throws Error if a raw packet has another number of sensors. */
  void packet(const wire_packet &packet);
  /* Those of its fields that are new. */
  void info(const wire_info &info);
  /* What waits for the other packet of its frame. */
  void write_pending();

  std::uint64_t frames() const { return frames_; }
  /* For the end of a recording: " edges=7 edges_missing=0", at the sync pin; nothing if none came. */
  std::string edges_text() const;
  /* Device time over all runs of a device that restarted. */
  double seconds() const;

private:
  void row(const wire_packet *contact, const wire_packet *raw);

  std::string path_;
  std::uint8_t sensor_count_;
  bool raw_expected_;
  CommentHandler comment_;
  RowHandler row_;
  std::optional<wire_packet> pending_contact_;
  Metadata info_;                       /* as last written */
  std::uint64_t before_restart_us_ = 0; /* device time of earlier runs of the device */
  std::optional<std::uint64_t> first_us_;
  std::uint64_t last_us_ = 0;
  std::uint64_t frames_ = 0;
  EdgeCounter edges_;
};

} // namespace fingertip
