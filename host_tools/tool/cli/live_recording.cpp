#include "tool/cli/live_recording.hpp"

#include "libfingertip/clock.hpp"
#include "tool/cli/terminal.hpp"

#include <cstdio>
#include <ctime>
#include <future>
#include <utility>

namespace fingertip {

namespace {

constexpr std::size_t QUEUE_bytes = 64 << 20; /* 5 s of the CSV text of sixteen fingertips at 1308 frames/s */
constexpr std::chrono::milliseconds WRITE_INTERVAL{20};

/* Another sink, written by another thread. */
class QueuedSink : public ByteSink {
public:
  explicit QueuedSink(std::unique_ptr<ByteSink> sink) : sink_(std::move(sink)) {}
  ~QueuedSink() override {
    try {
      write();
      wait();
    } catch (...) { /* finish would have thrown it */
    }
  }
  void append(const void *bytes, std::size_t length) override {
    if (!std::exchange(has_begun_, true)) {
      sink_->append(bytes, length); /* here it throws where nothing can be written */
      return;
    }
    queue_.emplace_back(static_cast<const char *>(bytes), length);
    queued_bytes_ += length;
    const bool is_idle = !writing_.valid() || writing_.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
    if (queued_bytes_ >= QUEUE_bytes || (is_idle && host_now() >= next_)) {
      write();
    }
  }
  void finish() override {
    write();
    wait();
    sink_->finish();
  }
  const std::string &path() const override { return sink_->path(); }

private:
  void write() {
    wait();
    next_ = host_now() + WRITE_INTERVAL;
    queued_bytes_ = 0;
    writing_ = std::async(std::launch::async, [this, queue = std::exchange(queue_, {})] {
      for (const std::string &bytes : queue) {
        sink_->append(bytes.data(), bytes.size());
      }
    });
  }
  void wait() {
    if (writing_.valid()) {
      auto queue = std::exchange(queue_, {}); /* nothing is written behind a gap */
      writing_.get();
      queue_ = std::move(queue);
    }
  }

  std::unique_ptr<ByteSink> sink_;
  std::vector<std::string> queue_;
  std::size_t queued_bytes_ = 0;
  bool has_begun_ = false;
  HostTime next_{};
  std::future<void> writing_;
};

} // namespace

std::unique_ptr<ByteSink> make_queued_file(const std::string &path, bool overwrite) {
  return std::make_unique<QueuedSink>(std::make_unique<OutputFile>(path, overwrite, OutputFile::Appears::at_once));
}

static RecordingWriter writer_of(const std::string &path, bool overwrite, const std::vector<DeviceNews> &ready, const std::string &port,
                                 std::int64_t host_zero_us, const Metadata &extra) {
  Metadata head = {{"recorded_by", "fingertip " FINGERTIP_VERSION}, {"started_utc", utc_now()}};
  std::vector<wire_info> infos;
  for (const DeviceNews &each : ready) {
    infos.push_back(each.packet.body.info);
  }
  const bool both = sends_both(infos[0]);
  auto lines = path == STDOUT_NAME ? make_lines(path, overwrite, OutputFile::Appears::on_standard_output)
                                   : make_lines(make_queued_file(path, overwrite), is_mcap_name(path));
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
