#include "libfingertip/recording_writer.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/recording_fields.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace fingertip {

using namespace recording;

/* A clock that goes back by more than packets overtake each other has begun again. */
constexpr std::uint64_t RESTART_us = 1'000'000;
/* The resolution of written times. */
constexpr double ROUNDING_us = 0.1;
constexpr double CLOCK_INTERVAL_us = 1e6;

/* The sum of the two largest. */
template <typename Device, typename Bound> static double two_largest(const std::vector<Device> &devices, Bound bound) {
  double largest = 0, second = 0;
  for (const Device &device : devices) {
    const double each = bound(device);
    second = std::max(second, std::min(largest, each));
    largest = std::max(largest, each);
  }
  return largest + second;
}

static std::string edges_text(const EdgeCounter &edges) {
  return edges.edges() == 0 ? "" : " edges=" + std::to_string(edges.edges()) + " edges_missing=" + std::to_string(edges.missing());
}

static std::string clock_text(const ClockEstimate &clock) {
  return " drift_ppm=" + fixed(clock.drift_ppm, 3) + " uncertainty_us=" + fixed(clock.uncertainty_us, 1);
}

RecordingWriter::RecordingWriter(std::unique_ptr<LineSink> file, const wire_info *info, std::uint8_t sensor_count, const Metadata &extra,
                                 bool raw_expected)
    : file_(std::move(file)), sensor_count_(sensor_count), raw_expected_(raw_expected), devices_(1), edges_(1) {
  file_->line(std::string(FIRST_WORDS) + FORMAT_OF_ONE);
  begin(extra, info ? std::vector<wire_info>{*info} : std::vector<wire_info>());
}

RecordingWriter::RecordingWriter(std::unique_ptr<LineSink> file, const std::vector<wire_info> &infos, const Metadata &extra,
                                 std::int64_t host_zero_us, bool raw_expected)
    : file_(std::move(file)), sensor_count_(infos[0].sensor_count), raw_expected_(raw_expected), host_zero_us_(host_zero_us),
      devices_(infos.size()), edges_(infos.size()) {
  std::string serials;
  for (const wire_info &info : infos) {
    if (info.sensor_count != sensor_count_) {
      throw Error(ErrorCode::other_sensor_count, "fingertips with " + std::to_string(sensor_count_) + " and " +
                                                     std::to_string(info.sensor_count) + " sensors do not fit into one file");
    }
    serials += " " + text_field(info.serial);
  }
  file_->line(std::string(FIRST_WORDS) + FORMAT_OF_SEVERAL);
  file_->line("# devices:" + serials);
  file_->line("# host_zero_us: " + std::to_string(host_zero_us));
  begin(extra, infos);
}

void RecordingWriter::begin(const Metadata &extra, const std::vector<wire_info> &infos) {
  for (const auto &[key, value] : extra) {
    file_->line("# " + key + ": " + printable(value));
  }
  for (std::size_t i = 0; i < infos.size(); i++) {
    write_info(i, infos[i]);
  }
  file_->line((host_zero_us_ ? JOINT_COLUMNS : "") + header_text(sensor_count_));
  head_written_ = true;
}

void RecordingWriter::line(std::size_t device, double host_us, const std::string &text) {
  if (!host_zero_us_ || !head_written_) {
    file_->line(text);
    return;
  }
  double &last_us = devices_[device].last_line_us;
  last_us = std::max(last_us, host_us);
  waiting_.emplace(last_us, text);
}

void RecordingWriter::write_comment(std::size_t device, const std::string &key, const std::string &value) {
  line(device, devices_[device].packet_host_us, "# " + (host_zero_us_ ? std::to_string(device) + "/" : "") + key + ": " + value);
}

std::string RecordingWriter::time_text(double host_us) const { return fixed(host_us - static_cast<double>(*host_zero_us_), 1); }

void RecordingWriter::write_info(std::size_t device, const wire_info &info) {
  Metadata &last = devices_[device].info;
  const Metadata all = info_metadata(info);
  for (const auto &pair : all) {
    if (std::find(last.begin(), last.end(), pair) == last.end()) {
      write_comment(device, pair.first, pair.second);
    }
  }
  last = all;
}

void RecordingWriter::write_row(std::size_t device, const wire_packet *contact, const wire_packet *raw) {
  Device &state = devices_[device];
  const std::uint64_t t_us = contact ? contact->t_us : raw->t_us;
  std::string before;
  double host_us = 0;
  if (host_zero_us_) {
    host_us = state.packet_host_us + static_cast<double>(static_cast<std::int64_t>(t_us - state.packet_t_us));
    before = std::to_string(device) + "," + time_text(host_us) + ",";
    last_us_ = std::max(last_us_, host_us);
  }
  line(device, host_us, before + row_text(contact, raw, sensor_count_));
  state.frames++;
  if (state.first_us && t_us < state.last_us) {
    state.before_restart_us += state.last_us - *state.first_us;
    state.first_us.reset();
  }
  state.first_us = state.first_us.value_or(t_us);
  state.last_us = t_us;
}

/* What waits for the other packet of its frame. */
void RecordingWriter::write_pending(std::size_t device) {
  if (const auto contact = std::exchange(devices_[device].pending_contact, std::nullopt)) {
    write_row(device, &*contact, nullptr);
  }
}

/* On the recorder's clock. */
void RecordingWriter::place(std::size_t device, const wire_packet &packet, double host_us) {
  Device &state = devices_[device];
  if (packet.t_us + RESTART_us < state.newest_us) {
    edges_.restart(device);
    state.newest_us = packet.t_us;
  }
  state.newest_us = std::max(state.newest_us, packet.t_us);
  if (packet.type == WIRE_SYNC) {
    edges_.edge(device, packet.t_us, packet.body.sync.level != 0);
  }
  const auto place = edges_.place(device, packet.t_us);
  state.edges_uncertainty_us = place ? std::max(place->uncertainty_us, ROUNDING_us) : 0;
  state.packet_t_us = packet.t_us;
  state.packet_host_us = place ? place->host_us : host_us;
  if (place) {
    edges_alignment_us_ =
        std::max(edges_alignment_us_, two_largest(devices_, [](const Device &each) { return each.edges_uncertainty_us; }));
  }
}

void RecordingWriter::packet(std::size_t device, const wire_packet &packet, double host_us) {
  if (host_zero_us_) {
    place(device, packet, host_us);
  }
  Device &state = devices_[device];
  wire_packet copy = packet;
  PairWriter fields;
  fields("sequence", packet.sequence);
  fields("t_us", packet.t_us);
  const char *name = nullptr;
  switch (packet.type) {
  case WIRE_CONTACT:
    write_pending(device);
    state.pending_contact = packet;
    if (!raw_expected_) {
      write_pending(device);
    }
    return;
  case WIRE_RAW:
    if (packet.body.raw.sensor_count != sensor_count_) {
      throw Error(ErrorCode::other_sensor_count, path() + ": the fingertip now has " + std::to_string(packet.body.raw.sensor_count) +
                                                     " sensors instead of " + std::to_string(sensor_count_));
    }
    if (state.pending_contact && state.pending_contact->body.contact.frame == packet.body.raw.frame &&
        state.pending_contact->t_us == packet.t_us) {
      const auto contact = std::exchange(state.pending_contact, std::nullopt);
      write_row(device, &*contact, &packet);
    } else {
      write_pending(device);
      write_row(device, nullptr, &packet);
    }
    return;
  case WIRE_HEALTH:
    name = PACKET_HEALTH;
    visit_health(fields, copy.body.health);
    break;
  case WIRE_ACK:
    name = PACKET_ACK;
    visit_ack(fields, copy.body.ack);
    break;
  case WIRE_SYNC:
    name = PACKET_SYNC;
    state.edges.take(packet.body.sync);
    visit_sync(fields, copy.body.sync);
    break;
  case WIRE_INFO: name = PACKET_INFO; break;
  default: return;
  }
  write_pending(device);
  if (packet.type == WIRE_INFO) {
    write_info(device, packet.body.info);
  }
  write_comment(device, "packet", name + fields.text());
}

void RecordingWriter::event(std::size_t device, const std::string &text) {
  write_pending(device);
  Device &state = devices_[device];
  state.packet_host_us = state.last_line_us;
  write_comment(device, "event", text);
}

void RecordingWriter::clock(std::size_t device, const ClockEstimate &estimate, unsigned jumps) {
  if (!host_zero_us_) {
    return;
  }
  Device &state = devices_[device];
  state.clock = estimate;
  state.jumps = jumps;
  edges_.clock(device, estimate);
  alignment_us_ =
      std::max(alignment_us_, two_largest(devices_, [](const Device &each) { return each.clock ? each.clock->uncertainty_us : 0; }));
  if (estimate.host_us - state.clock_written_us >= CLOCK_INTERVAL_us) {
    state.clock_written_us = estimate.host_us;
    line(device, estimate.host_us,
         "# " + std::to_string(device) + "/clock: t_us=" + std::to_string(estimate.device_us) + " time_us=" + time_text(estimate.host_us) +
             clock_text(estimate));
  }
}

void RecordingWriter::comment(const std::string &key, double host_us, const std::string &value) {
  if (host_zero_us_) {
    waiting_.emplace(host_us, "# " + key + ": " + printable(value));
  }
}

void RecordingWriter::settle(double host_us) {
  while (!waiting_.empty() && waiting_.begin()->first <= host_us) {
    file_->line(waiting_.begin()->second);
    waiting_.erase(waiting_.begin());
  }
}

std::uint64_t RecordingWriter::frames() const {
  std::uint64_t sum = 0;
  for (const Device &device : devices_) {
    sum += device.frames;
  }
  return sum;
}

void RecordingWriter::finish(const std::vector<LineStatistics> &statistics, const std::string &reason) {
  for (std::size_t i = 0; i < devices_.size(); i++) {
    write_pending(i);
  }
  settle(std::numeric_limits<double>::infinity());
  LineStatistics sum;
  for (std::size_t i = 0; i < devices_.size(); i++) {
    const Device &device = devices_[i];
    sum += statistics[i];
    if (host_zero_us_) {
      file_->line("# " + std::to_string(i) + "/end: frames=" + std::to_string(device.frames) + " jumps=" + std::to_string(device.jumps) +
                  (device.clock ? clock_text(*device.clock) : "") + edges_text(device.edges) + " " + statistics[i].text());
    }
  }
  /* Of one: device time over all runs of a device that restarted. */
  const Device &first = devices_[0];
  double us = static_cast<double>(first.before_restart_us + (first.first_us ? first.last_us - *first.first_us : 0));
  std::string more = edges_text(first.edges);
  if (host_zero_us_) {
    us = frames() > 0 ? last_us_ - static_cast<double>(*host_zero_us_) : 0;
    more = " alignment_us=" + fixed(alignment_us_, 1) +
           (edges_alignment_us_ > 0 ? " edges_alignment_us=" + fixed(edges_alignment_us_, 1) : "");
  }
  file_->line("# end: reason=" + reason + " frames=" + std::to_string(frames()) + " seconds=" + fixed(us / 1e6, 6) + more + " " +
              sum.text());
  file_->finish();
}

} // namespace fingertip
