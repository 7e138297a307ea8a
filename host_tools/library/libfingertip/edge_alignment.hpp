/* Several fingertips on one clock, by edges that they stamp on one wire.
 *
 * The recorder knows each fingertip's clock to some ten or hundred microseconds (clock_fit.hpp). An edge that two of them have stamped ties
 * their clocks to a microsecond. Two stamps are of one edge if both rise or both fall, and the recorder places them as near as it must, and
 * no others. So edges are no help that follow one another faster than the recorder can distinguish.
 *
 * One fingertip is the reference. Its time goes to the recorder's clock along a line with knots, a second apart, each
 * set by the estimate of the moment, ahead of the rows. So a time of the reference has one place, whenever a row with
 * it comes. The others' times go to the reference's by a ClockFit. */
#pragma once

#include "libfingertip/clock_fit.hpp"

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

namespace fingertip {

class EdgeAlignment {
public:
  explicit EdgeAlignment(std::size_t devices) : members_(devices) {}

  /* The recorder's estimate of a clock, as often as it has one. */
  void clock(std::size_t device, const ClockEstimate &estimate);
  /* An edge, in order of the device's time. */
  void edge(std::size_t device, std::uint64_t t_us, bool rises);
  /* Its clock begins again. */
  void restart(std::size_t device);

  struct Place {
    double host_us;
    double uncertainty_us; /* against the reference; no error is larger */
  };
  /* The place of a device's time, by edges; nothing if the recorder knows it better. */
  std::optional<Place> place(std::size_t device, std::uint64_t t_us) const;

private:
  struct Edge {
    std::uint64_t t_us;
    double host_us, uncertainty_us;
    bool rises;
  };
  struct Member {
    std::optional<ClockEstimate> clock; /* to the recorder's */
    std::deque<Edge> edges;             /* the last, not yet tied */
    ClockFit fit;                       /* to the reference's */
    unsigned ties = 0;
    std::uint64_t first_tie_us = 0, last_tie_us = 0;
  };
  struct Knot {
    double reference_us, host_us;
  };

  void tie(std::size_t device, const Edge &own, const Edge &reference);
  void extend(std::uint64_t until_us);
  double to_host(double reference_us) const;

  std::vector<Member> members_;
  std::optional<std::size_t> reference_;
  std::deque<Knot> knots_;
};

} // namespace fingertip
