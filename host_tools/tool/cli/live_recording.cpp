#include "tool/cli/live_recording.hpp"

#include "libfingertip/clock.hpp"
#include "libfingertip/recording.hpp"

#include <chrono>
#include <cstdio>
#include <ctime>

namespace fingertip {

namespace {

constexpr std::uint32_t CAN_BOTH = WIRE_CAPABILITY_FIT | WIRE_CAPABILITY_RAW_STREAM;

/* A raw packet follows each contact packet. */
bool raw_expected(const wire_info &info) { return (info.capabilities & CAN_BOTH) == CAN_BOTH; }

Metadata begun(const Metadata &extra = {}) {
  Metadata all = {{"recorded_by", "fingertip " FINGERTIP_VERSION}, {"started_utc", utc_now()}};
  all.insert(all.end(), extra.begin(), extra.end());
  return all;
}

class SingleRecording : public LiveRecording {
public:
  SingleRecording(const LiveOptions &options, const DeviceNews &ready, const std::string &port)
      : to_standard_output_(options.recording == STDOUT_NAME),
        writer_(options.recording, options.overwrite, &ready.packet.body.info, ready.packet.body.info.sensor_count,
                metadata(ready, port), raw_expected(ready.packet.body.info),
                to_standard_output_ ? OutputFile::Appears::on_standard_output : OutputFile::Appears::at_once) {
    writer_.packet(ready.packet);
  }

  void packet(const DeviceNews &news) override {
    if (can_write()) {
      writer_.packet(news.packet);
    }
  }
  void event(std::size_t, const std::string &text) override {
    if (can_write()) {
      writer_.event(text + " " + utc_now());
    }
  }
  void finish(const std::vector<LineStatistics> &statistics, const std::string &reason) override {
    if (can_write()) {
      writer_.finish(statistics[0], reason);
    }
  }
  std::uint64_t frames(std::size_t) const override { return writer_.frames(); }

private:
  static Metadata metadata(const DeviceNews &ready, const std::string &port) {
    Metadata extra = begun();
    extra.emplace_back("port", port);
    if (ready.relation) {
      auto device_us = steady_now_us() + ready.relation->device_minus_host_us;
      extra.emplace_back("started_device_us", std::to_string(device_us));
      extra.emplace_back("started_uncertainty_us", std::to_string(ready.relation->uncertainty_us));
    }
    return extra;
  }

  /* A reader of standard output that is slow is waited for, unless the end is wanted. */
  bool can_write() {
    given_up_ = given_up_ || (to_standard_output_ && !wait_for_standard_output());
    return !given_up_;
  }

  bool to_standard_output_;
  bool given_up_ = false;
  RecordingWriter writer_;
};

class JointRecording : public LiveRecording {
public:
  JointRecording(const LiveOptions &options, const std::vector<DeviceNews> &ready, std::int64_t host_zero_us,
                 const Metadata &extra)
      : writer_(options.recording, options.overwrite, infos(ready), begun(extra), host_zero_us,
                raw_expected(ready[0].packet.body.info), OutputFile::Appears::at_once) {
    for (std::size_t i = 0; i < ready.size(); i++) {
      writer_.packet(i, ready[i].packet, static_cast<double>(host_zero_us));
    }
  }

  void packet(const DeviceNews &news) override { writer_.packet(news.device, news.packet, news.host_us); }
  void event(std::size_t device, const std::string &text) override { writer_.event(device, text + " " + utc_now()); }
  void clock(const DeviceNews &news) override { writer_.clock(news.device, news.estimate, news.jumps); }
  void comment(const std::string &key, double host_us, const std::string &value) override {
    writer_.comment(key, host_us, value);
  }
  void settle(double host_us) override { writer_.settle(host_us); }
  void finish(const std::vector<LineStatistics> &statistics, const std::string &reason) override {
    writer_.finish(statistics, reason);
  }
  std::uint64_t frames(std::size_t device) const override { return writer_.frames(device); }
  double alignment_us() const override { return writer_.alignment_us(); }
  double edges_alignment_us() const override { return writer_.edges_alignment_us(); }

private:
  static std::vector<wire_info> infos(const std::vector<DeviceNews> &ready) {
    std::vector<wire_info> all;
    for (const DeviceNews &each : ready) {
      all.push_back(each.packet.body.info);
    }
    return all;
  }

  JointRecordingWriter writer_;
};

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

std::unique_ptr<LiveRecording> make_recording(const LiveOptions &options, const std::vector<DeviceNews> &ready,
                                              const std::vector<std::string> &ports, std::int64_t host_zero_us,
                                              const Metadata &extra) {
  if (ready.size() == 1) {
    return std::make_unique<SingleRecording>(options, ready[0], ports[0]);
  }
  return std::make_unique<JointRecording>(options, ready, host_zero_us, extra);
}

} // namespace fingertip
