#include "libfingertip/joint_recording_writer.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/recording_fields.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>
#include <limits>

namespace fingertip {

using namespace recording;

namespace {

/* A clock that goes back by more than packets overtake each other has begun again. */
constexpr std::uint64_t RESTART_us = 1'000'000;
/* The resolution of written times. */
constexpr double ROUNDING_us = 0.1;

} // namespace

JointRecordingWriter::JointRecordingWriter(const std::string &path, bool replace, const std::vector<wire_info> &infos,
                                           const Metadata &extra, std::int64_t host_zero_us, bool raw_expected,
                                           OutputFile::Appears appears)
    : JointRecordingWriter(make_lines(path, replace, appears), infos, extra, host_zero_us, raw_expected) {}

JointRecordingWriter::JointRecordingWriter(std::unique_ptr<LineSink> file, const std::vector<wire_info> &infos,
                                           const Metadata &extra, std::int64_t host_zero_us, bool raw_expected)
    : file_(std::move(file)), host_zero_us_(host_zero_us), edges_(infos.size()) {
  std::string serials;
  for (std::size_t i = 0; i < infos.size(); i++) {
    if (infos[i].sensor_count != infos[0].sensor_count) {
      throw Error(ErrorCode::other_sensor_count, "fingertips with " + std::to_string(infos[0].sensor_count) + " and " +
                                                     std::to_string(infos[i].sensor_count) +
                                                     " sensors do not fit into one file");
    }
    serials += " " + text_field(infos[i].serial);
    auto number = std::to_string(i);
    devices_.emplace_back(PacketLines(
        file_->path(), infos[i].sensor_count, raw_expected,
        [this, number, i](const std::string &key, const std::string &value) {
          std::string text = "# " + number + "/" + key + ": " + value;
          if (head_written_) {
            line(i, devices_[i].packet_host_us, text);
          } else {
            line(text);
          }
        },
        [this, number, i](std::uint64_t t_us, const std::string &cells) {
          const Device &device = devices_[i];
          double host_us =
              device.packet_host_us + static_cast<double>(static_cast<std::int64_t>(t_us - device.packet_t_us));
          line(i, host_us, number + "," + time_text(host_us) + "," + cells);
          last_us_ = std::max(last_us_, host_us);
        }));
  }
  line(std::string(FIRST_WORDS) + FORMAT_OF_SEVERAL);
  line("# devices:" + serials);
  line("# host_zero_us: " + std::to_string(host_zero_us));
  for (const auto &[key, value] : extra) {
    line("# " + key + ": " + printable(value));
  }
  for (std::size_t i = 0; i < infos.size(); i++) {
    devices_[i].lines.info(infos[i]);
  }
  line(JOINT_COLUMNS + header_text(infos[0].sensor_count));
  head_written_ = true;
}

void JointRecordingWriter::line(const std::string &text) { file_->line(text); }

void JointRecordingWriter::line(std::size_t device, double host_us, const std::string &text) {
  double &last_us = devices_[device].last_line_us;
  last_us = std::max(last_us, host_us);
  waiting_.emplace(last_us, text);
}

std::string JointRecordingWriter::time_text(double host_us) const {
  return fixed(host_us - static_cast<double>(host_zero_us_), 1);
}

void JointRecordingWriter::packet(std::size_t device, const wire_packet &packet, double host_us) {
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
    std::vector<double> bounds;
    for (const Device &each : devices_) {
      bounds.push_back(each.edges_uncertainty_us);
    }
    std::sort(bounds.rbegin(), bounds.rend());
    edges_alignment_us_ = std::max(edges_alignment_us_, bounds[0] + (bounds.size() > 1 ? bounds[1] : 0));
  }
  state.lines.packet(packet);
}

void JointRecordingWriter::event(std::size_t device, const std::string &text) {
  devices_[device].lines.write_pending();
  line(device, devices_[device].last_line_us, "# " + std::to_string(device) + "/event: " + text);
}

void JointRecordingWriter::clock(std::size_t device, const ClockEstimate &estimate, unsigned jumps) {
  constexpr double interval_us = 1e6;
  Device &state = devices_[device];
  state.clock = estimate;
  state.jumps = jumps;
  edges_.clock(device, estimate);
  std::vector<double> bounds;
  for (const Device &each : devices_) {
    bounds.push_back(each.clock ? each.clock->uncertainty_us : 0);
  }
  std::sort(bounds.rbegin(), bounds.rend());
  alignment_us_ = std::max(alignment_us_, bounds[0] + (bounds.size() > 1 ? bounds[1] : 0));
  if (estimate.host_us - state.clock_written_us >= interval_us) {
    state.clock_written_us = estimate.host_us;
    line(device, estimate.host_us,
         "# " + std::to_string(device) + "/clock: t_us=" + std::to_string(estimate.device_us) +
             " time_us=" + time_text(estimate.host_us) + " drift_ppm=" + fixed(estimate.drift_ppm, 3) +
             " uncertainty_us=" + fixed(estimate.uncertainty_us, 1));
  }
}

void JointRecordingWriter::comment(const std::string &key, double host_us, const std::string &value) {
  waiting_.emplace(host_us, "# " + key + ": " + printable(value));
}

void JointRecordingWriter::settle(double host_us) {
  while (!waiting_.empty() && waiting_.begin()->first <= host_us) {
    line(waiting_.begin()->second);
    waiting_.erase(waiting_.begin());
  }
}

std::uint64_t JointRecordingWriter::frames() const {
  std::uint64_t sum = 0;
  for (const Device &device : devices_) {
    sum += device.lines.frames();
  }
  return sum;
}

void JointRecordingWriter::finish(const std::vector<LineStatistics> &statistics, const std::string &reason) {
  for (Device &device : devices_) {
    device.lines.write_pending();
  }
  settle(std::numeric_limits<double>::infinity());
  LineStatistics sum;
  for (std::size_t i = 0; i < devices_.size(); i++) {
    const Device &device = devices_[i];
    std::string clock = device.clock ? " drift_ppm=" + fixed(device.clock->drift_ppm, 3) +
                                           " uncertainty_us=" + fixed(device.clock->uncertainty_us, 1)
                                     : "";
    line("# " + std::to_string(i) + "/end: frames=" + std::to_string(device.lines.frames()) +
         " jumps=" + std::to_string(device.jumps) + clock + device.lines.edges_text() + " " + statistics[i].text());
    sum += statistics[i];
  }
  double seconds = frames() > 0 ? (last_us_ - static_cast<double>(host_zero_us_)) / 1e6 : 0;
  line("# end: reason=" + reason + " frames=" + std::to_string(frames()) + " seconds=" + fixed(seconds, 6) +
       " alignment_us=" + fixed(alignment_us_, 1) +
       (edges_alignment_us_ > 0 ? " edges_alignment_us=" + fixed(edges_alignment_us_, 1) : "") + " " + sum.text());
  file_->finish();
}

} // namespace fingertip
