/* A live recording: of one fingertip, or of several on one clock. */
#pragma once

#include "libfingertip/device_loop.hpp"
#include "libfingertip/recording_writer.hpp"

namespace fingertip {

inline constexpr const char *STDOUT_NAME = "-"; /* of a file */
/* How long a row may wait for earlier ones of other fingertips. */
constexpr double SETTLE_us = 250e3;

/* Another sink, written by a thread of its own within 20 ms unless the disk stalls; a killed program loses what waits. After an error
 * nothing is written any more, and append, flush and finish throw it, each time. */
class QueuedSink : public ByteSink {
public:
  /* A file that grows. */
  QueuedSink(const std::string &path, bool overwrite);
  /* capacity_bytes: while these or more wait, append does too; 64 MB are 5 s of the CSV text of sixteen fingertips at 1308 frames/s. */
  explicit QueuedSink(std::unique_ptr<ByteSink> sink, std::size_t capacity_bytes = 64 << 20);
  /* Writes what waits; its error is lost. */
  ~QueuedSink() override;

  void append(const void *bytes, std::size_t length) override;
  /* Returns once fewer bytes wait: once everything is written. If that takes more than a second after a signal, the next SIGINT throws
   * Interrupted, and the destructor ends the program. */
  void flush(std::size_t below_bytes = 1);
  void finish() override;
  const std::string &path() const override { return sink_->path(); }

private:
  void run();

  std::unique_ptr<ByteSink> sink_;
  const std::size_t capacity_bytes_;
  Wake wanted_, written_;
  std::atomic<bool> ends_{false};
  std::mutex mutex_; /* of what follows */
  std::deque<std::string> queue_;
  std::size_t queued_bytes_ = 0;
  std::exception_ptr failure_;
  bool is_given_up_ = false;
  Thread thread_;
};

/* Now, as recordings write it. */
std::string utc_now();

class LiveRecording {
public:
  /* ready: the update of that kind of each fingertip; port: of the only one. extra: for the head of a recording of several. */
  LiveRecording(const std::string &path, bool overwrite, const std::vector<DeviceUpdate> &ready, const std::string &port,
                std::int64_t host_zero_us, const Metadata &extra = {});

  void packet(const DeviceUpdate &update);
  void event(std::size_t device, const std::string &text);
  void finish(const std::vector<LineStatistics> &statistics, const std::string &reason);
  std::uint64_t frames(std::size_t device) const { return writer_.frames(device); }

  RecordingWriter &writer() { return writer_; }

private:
  bool can_write();

  bool given_up_ = false;
  QueuedSink *queue_ = nullptr; /* the writer's; of a file, not of standard output */
  RecordingWriter writer_;
};

} // namespace fingertip
