/* Counts the edges at a sync pin that came, and those that their numbers show to be missing: they
 * followed too fast for the fingertip to send them, or their packets were lost. */
#pragma once

#include "libfingertip/wire.hpp"

#include <cstdint>
#include <optional>

namespace fingertip {

class EdgeCounter {
public:
  void take(const wire_sync &edge) {
    const std::uint32_t ahead = edge.number - last_.value_or(edge.number - 1);
    if (ahead >= 1 && ahead <= UINT32_MAX / 2) { /* else the pin was set again */
      missing_ += ahead - 1;
    }
    last_ = edge.number;
    edges_++;
  }
  std::uint64_t edges() const { return edges_; }
  std::uint64_t missing() const { return missing_; }

private:
  std::optional<std::uint32_t> last_;
  std::uint64_t edges_ = 0, missing_ = 0;
};

} // namespace fingertip
