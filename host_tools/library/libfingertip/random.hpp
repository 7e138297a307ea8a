/* Random numbers for simulations, the same on every machine and library: splitmix64. */
#pragma once

#include <cmath>
#include <cstdint>

namespace fingertip {

class Random {
public:
  /* Different streams, and different indices in one, are independent of each other. */
  Random(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) : state_(seed) {
    state_ = next() ^ stream;
    state_ = next() ^ index;
  }

  std::uint64_t next() {
    state_ += 0x9E3779B97F4A7C15u;
    std::uint64_t z = state_;
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
    z = (z ^ z >> 27) * 0x94D049BB133111EBu;
    return z ^ z >> 31;
  }

  double uniform(double low, double high) { return low + (high - low) * static_cast<double>(next() >> 11) * 0x1p-53; }

  double log_uniform(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }

  /* Mean 0, standard deviation 1. */
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform(0.0, 1.0)));
    return radius * std::cos(uniform(0.0, 2.0 * M_PI));
  }

private:
  std::uint64_t state_;
};

} // namespace fingertip
