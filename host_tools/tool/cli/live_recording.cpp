#include "tool/cli/live_recording.hpp"

#include "libfingertip/clock.hpp"
#include "tool/cli/terminal.hpp"

#include <cstdio>
#include <ctime>

namespace fingertip {

static RecordingWriter writer_of(const std::string &path, bool overwrite, const std::vector<DeviceNews> &ready, const std::string &port,
                                 std::int64_t host_zero_us, const Metadata &extra) {
  Metadata head = {{"recorded_by", "fingertip " FINGERTIP_VERSION}, {"started_utc", utc_now()}};
  std::vector<wire_info> infos;
  for (const DeviceNews &each : ready) {
    infos.push_back(each.packet.body.info);
  }
  const bool both = sends_both(infos[0]);
  auto lines = make_lines(path, overwrite, path == STDOUT_NAME ? OutputFile::Appears::on_standard_output : OutputFile::Appears::at_once);
  if (ready.size() > 1) {
    head.insert(head.end(), extra.begin(), extra.end());
    return RecordingWriter(std::move(lines), infos, head, host_zero_us, both);
  }
  head.emplace_back("port", port);
  if (const auto &relation = ready[0].relation) {
    head.emplace_back("started_device_us", std::to_string(steady_now_us() + relation->device_minus_host_us));
    head.emplace_back("started_uncertainty_us", std::to_string(relation->uncertainty_us));
  }
  return RecordingWriter(std::move(lines), &infos[0], infos[0].sensor_count, head, both);
}

std::string utc_now() {
  auto now = wall_now();
  std::time_t seconds = std::chrono::system_clock::to_time_t(now);
  auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch()).count() % 1000;
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", &parts);
  char whole[48];
  std::snprintf(whole, sizeof whole, "%s.%03dZ", text, static_cast<int>(ms));
  return whole;
}

LiveRecording::LiveRecording(const std::string &path, bool overwrite, const std::vector<DeviceNews> &ready, const std::string &port,
                             std::int64_t host_zero_us, const Metadata &extra)
    : to_standard_output_(path == STDOUT_NAME), writer_(writer_of(path, overwrite, ready, port, host_zero_us, extra)) {
  for (std::size_t i = 0; i < ready.size(); i++) {
    writer_.packet(i, ready[i].packet, static_cast<double>(host_zero_us));
  }
}

/* A reader of standard output that is slow is waited for, unless the end is wanted. */
bool LiveRecording::can_write() {
  given_up_ = given_up_ || (to_standard_output_ && !wait_for_standard_output());
  return !given_up_;
}

void LiveRecording::packet(const DeviceNews &news) {
  if (can_write()) {
    writer_.packet(news.device, news.packet, news.host_us);
  }
}

void LiveRecording::event(std::size_t device, const std::string &text) {
  if (can_write()) {
    writer_.event(device, text + " " + utc_now());
  }
}

void LiveRecording::finish(const std::vector<LineStatistics> &statistics, const std::string &reason) {
  if (can_write()) {
    writer_.finish(statistics, reason);
  }
}

} // namespace fingertip
