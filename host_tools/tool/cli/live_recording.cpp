#include "tool/cli/live_recording.hpp"

#include "libfingertip/clock.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/text.hpp"
#include "tool/cli/terminal.hpp"

#include <ctime>
#include <utility>

namespace fingertip {

constexpr std::chrono::milliseconds WRITE_INTERVAL{20}, LOOK_INTERVAL{100};
constexpr std::chrono::seconds LONG{1};

QueuedSink::QueuedSink(const std::string &path, bool overwrite)
    : QueuedSink(std::make_unique<OutputFile>(path, overwrite, OutputFile::Appears::at_once)) {}

QueuedSink::QueuedSink(std::unique_ptr<ByteSink> sink, std::size_t capacity_bytes)
    : sink_(std::move(sink)), capacity_bytes_(capacity_bytes), thread_([this] { run(); }) {}

QueuedSink::~QueuedSink() {
  ends_ = true;
  wanted_.set();
  if (is_given_up_) { /* the thread hangs in the kernel */
    std::fprintf(stderr, "%s: took nothing; its last %zu bytes are lost\n", printable(path()).c_str(), queued_bytes_);
    std::_Exit(1);
  }
  thread_.join();
}

void QueuedSink::append(const void *bytes, std::size_t length) {
  flush(capacity_bytes_);
  std::lock_guard<std::mutex> lock(mutex_);
  queue_.emplace_back(static_cast<const char *>(bytes), length);
  queued_bytes_ += length;
}

void QueuedSink::finish() {
  flush();
  sink_->finish();
}

void QueuedSink::flush(std::size_t below_bytes) {
  const HostTime long_after = host_now() + LONG;
  std::optional<unsigned> interrupts_before; /* once the user knows that another one ends it */
  std::unique_lock<std::mutex> lock(mutex_);
  while (!failure_ && queued_bytes_ >= below_bytes) {
    lock.unlock();
    wanted_.set();
    written_.wait(host_now() + LOOK_INTERVAL);
    if (stop_requested() && !interrupts_before && host_now() > long_after) {
      std::fprintf(stderr, "%s: takes nothing; waiting, Ctrl-C ends without the rest\n", printable(path()).c_str());
      interrupts_before = interrupts();
    }
    lock.lock();
    if (interrupts_before && interrupts() > *interrupts_before) {
      is_given_up_ = true;
      failure_ = std::make_exception_ptr(Interrupted());
    }
  }
  if (failure_) {
    std::rethrow_exception(failure_);
  }
}

void QueuedSink::run() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!failure_ && !(ends_ && queue_.empty())) {
    if (queue_.empty()) {
      lock.unlock();
      wanted_.wait(host_now() + WRITE_INTERVAL);
      lock.lock();
      continue;
    }
    const std::string &next = queue_.front(); /* append moves none of them */
    lock.unlock();
    std::exception_ptr failure;
    try {
      sink_->append(next.data(), next.size());
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    failure_ = failure;
    queued_bytes_ -= next.size();
    queue_.pop_front();
    written_.set();
  }
}

static RecordingWriter writer_of(const std::string &path, bool overwrite, const std::vector<DeviceUpdate> &ready, const std::string &port,
                                 std::int64_t host_zero_us, const Metadata &extra, QueuedSink *&queue) {
  Metadata head = {{"recorded_by", "fingertip " FINGERTIP_VERSION}, {"started_utc", utc_now()}};
  std::vector<wire_info> infos;
  for (const DeviceUpdate &each : ready) {
    infos.push_back(each.packet.body.info);
  }
  const bool both = sends_both(infos[0]);
  auto file = path == STDOUT_NAME ? nullptr : std::make_unique<QueuedSink>(path, overwrite);
  queue = file.get();
  auto lines =
      file ? make_lines(std::move(file), is_mcap_name(path)) : make_lines(path, overwrite, OutputFile::Appears::on_standard_output);
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
  return std::string(text) + "." + std::to_string(1000 + ms).substr(1) + "Z";
}

LiveRecording::LiveRecording(const std::string &path, bool overwrite, const std::vector<DeviceUpdate> &ready, const std::string &port,
                             std::int64_t host_zero_us, const Metadata &extra)
    : writer_(writer_of(path, overwrite, ready, port, host_zero_us, extra, queue_)) {
  if (queue_) {
    queue_->flush(); /* the head: what cannot be written is known before anything moves */
  }
  for (std::size_t i = 0; i < ready.size(); i++) {
    writer_.packet(i, ready[i].packet, static_cast<double>(host_zero_us));
  }
}

/* A reader of standard output that is slow is waited for, unless the end is wanted. */
bool LiveRecording::can_write() {
  given_up_ = given_up_ || (!queue_ && !wait_for_standard_output());
  return !given_up_;
}

void LiveRecording::packet(const DeviceUpdate &update) {
  if (can_write()) {
    writer_.packet(update.device, update.packet, update.host_us);
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
