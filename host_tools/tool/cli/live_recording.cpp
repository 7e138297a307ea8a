#include "tool/cli/live_recording.hpp"

#include "libfingertip/clock.hpp"

#include <cstdio>
#include <ctime>

namespace fingertip {

namespace {

/* A raw packet follows each contact packet. */
bool raw_expected(const wire_info &info) {
  constexpr std::uint32_t can_both = WIRE_CAPABILITY_FIT | WIRE_CAPABILITY_RAW_STREAM;
  return (info.capabilities & can_both) == can_both;
}

} // namespace

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

LiveRecording::LiveRecording(const LiveOptions &options, const std::vector<DeviceNews> &ready, const std::string &port,
                             std::int64_t host_zero_us, const Metadata &extra)
    : to_standard_output_(options.recording == STDOUT_NAME) {
  Metadata head = {{"recorded_by", "fingertip " FINGERTIP_VERSION}, {"started_utc", utc_now()}};
  std::vector<wire_info> infos;
  for (const DeviceNews &each : ready) {
    infos.push_back(each.packet.body.info);
  }
  const bool both = raw_expected(infos[0]);
  if (ready.size() > 1) {
    head.insert(head.end(), extra.begin(), extra.end());
    several_.emplace(options.recording, options.overwrite, infos, head, host_zero_us, both,
                     OutputFile::Appears::at_once);
    for (std::size_t i = 0; i < ready.size(); i++) {
      several_->packet(i, ready[i].packet, static_cast<double>(host_zero_us));
    }
    return;
  }
  head.emplace_back("port", port);
  if (const auto &relation = ready[0].relation) {
    head.emplace_back("started_device_us", std::to_string(steady_now_us() + relation->device_minus_host_us));
    head.emplace_back("started_uncertainty_us", std::to_string(relation->uncertainty_us));
  }
  one_.emplace(options.recording, options.overwrite, &infos[0], infos[0].sensor_count, head, both,
               to_standard_output_ ? OutputFile::Appears::on_standard_output : OutputFile::Appears::at_once);
  one_->packet(ready[0].packet);
}

/* A reader of standard output that is slow is waited for, unless the end is wanted. */
bool LiveRecording::can_write() {
  given_up_ = given_up_ || (to_standard_output_ && !wait_for_standard_output());
  return !given_up_;
}

void LiveRecording::packet(const DeviceNews &news) {
  if (several_) {
    several_->packet(news.device, news.packet, news.host_us);
  } else if (can_write()) {
    one_->packet(news.packet);
  }
}

void LiveRecording::event(std::size_t device, const std::string &text) {
  const std::string line = text + " " + utc_now();
  if (several_) {
    several_->event(device, line);
  } else if (can_write()) {
    one_->event(line);
  }
}

void LiveRecording::finish(const std::vector<LineStatistics> &statistics, const std::string &reason) {
  if (several_) {
    several_->finish(statistics, reason);
  } else if (can_write()) {
    one_->finish(statistics[0], reason);
  }
}

} // namespace fingertip
