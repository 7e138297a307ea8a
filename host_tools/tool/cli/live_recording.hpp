/* A live recording: of one fingertip, or of several on one clock. */
#pragma once

#include "libfingertip/device_loop.hpp"
#include "libfingertip/packet_fields.hpp"
#include "tool/cli/live.hpp"

#include <memory>
#include <string>
#include <vector>

namespace fingertip {

/* How long a row may wait for earlier ones of other fingertips. */
constexpr double SETTLE_us = 250e3;

/* Now, as recordings write it. */
std::string utc_now();

class LiveRecording {
public:
  virtual ~LiveRecording() = default;

  virtual void packet(const DeviceNews &news) = 0;
  virtual void event(std::size_t device, const std::string &text) = 0;
  virtual void clock(const DeviceNews &) {}
  /* The recorder's own, "# key: value" between the rows of several. */
  virtual void comment(const std::string & /*key*/, double /*host_us*/, const std::string & /*value*/) {}
  /* What waits to be put in order with news of other fingertips waits no longer, if it is older. */
  virtual void settle(double /*host_us*/) {}
  virtual void finish(const std::vector<LineStatistics> &statistics, const std::string &reason) = 0;

  virtual std::uint64_t frames(std::size_t device) const = 0;
  /* The bound on the distance in time of two rows of different fingertips, so far. */
  virtual double alignment_us() const { return 0; }
  /* The same of rows that edges at the sync pins have placed; 0: there are none. */
  virtual double edges_alignment_us() const { return 0; }
};

/* ready: the news of that kind of each fingertip, and its port. extra: for the head of a recording
 * of several. */
std::unique_ptr<LiveRecording> make_recording(const LiveOptions &options, const std::vector<DeviceNews> &ready,
                                              const std::vector<std::string> &ports, std::int64_t host_zero_us,
                                              const Metadata &extra = {});

} // namespace fingertip
