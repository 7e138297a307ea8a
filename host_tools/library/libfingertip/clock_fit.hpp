/* A fingertip's clock in terms of the host's, from commands and their acknowledgements.
 *
 * An exchange shows that the host's clock was between sent and received when the fingertip's was at device_us. A straight line, offset and
 * drift, must pass between all of these of the last half minute. The distance between the possible lines at one time bounds the error,
 * whatever the delays were. The estimate is the line in the middle, as far from the nearest limits on both sides as it can be. Slow
 * exchanges do not touch it. It is exact where the fastest command and the fastest answer took equally long. If no line passes, the clock
 * has jumped, and the older half of the exchanges is dropped. */
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#pragma GCC visibility push(default)
namespace fingertip {

struct ClockExchange {
  std::int64_t sent_us, received_us; /* host's clock */
  std::uint64_t device_us;
};

struct ClockEstimate {
  std::uint64_t device_us; /* of the last exchange */
  double host_us;          /* at that time */
  double drift_ppm;        /* positive: the fingertip's clock is fast */
  double uncertainty_us;   /* no error at that time is larger */

  double host_at(std::uint64_t other_device_us) const;
};

class ClockFit {
public:
  /* Add them in order of device time. */
  void add(const ClockExchange &exchange);
  /* Nothing before the first exchange. */
  const std::optional<ClockEstimate> &estimate() const { return estimate_; }
  unsigned jumps() const { return jumps_; }

private:
  std::optional<ClockEstimate> fit() const;

  std::deque<ClockExchange> exchanges_;
  std::optional<ClockEstimate> estimate_;
  unsigned jumps_ = 0;
};

} // namespace fingertip
#pragma GCC visibility pop
