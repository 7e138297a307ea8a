/* A live recording: of one fingertip, or of several on one clock. */
#pragma once

#include "libfingertip/device_loop.hpp"
#include "libfingertip/recording_writer.hpp"

#include <string>
#include <vector>

namespace fingertip {

inline constexpr const char *STDOUT_NAME = "-"; /* of a file */
/* How long a row may wait for earlier ones of other fingertips. */
constexpr double SETTLE_us = 250e3;

/* A file that grows, whose disk may stall: append waits only while 64 MB are queued. An error is thrown by a later call. */
std::unique_ptr<ByteSink> make_queued_file(const std::string &path, bool overwrite);
/* Now, as recordings write it. */
std::string utc_now();

class LiveRecording {
public:
  /* ready: the news of that kind of each fingertip; port: of the only one. extra: for the head of a recording of several. */
  LiveRecording(const std::string &path, bool overwrite, const std::vector<DeviceNews> &ready, const std::string &port,
                std::int64_t host_zero_us, const Metadata &extra = {});

  void packet(const DeviceNews &news);
  void event(std::size_t device, const std::string &text);
  void finish(const std::vector<LineStatistics> &statistics, const std::string &reason);
  std::uint64_t frames(std::size_t device) const { return writer_.frames(device); }

  RecordingWriter &writer() { return writer_; }

private:
  bool can_write();

  bool to_standard_output_, given_up_ = false;
  RecordingWriter writer_;
};

} // namespace fingertip
