#include "libfingertip/clock_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace fingertip {

constexpr double WINDOW_us = 30e6;
constexpr std::size_t EXCHANGES = 512;
/* Crystals are good to 100 ppm with all their errors, at both ends. */
constexpr double SLOPE_LIMIT = 200e-6;
/* What drift is worth in gap: exchanges that span less time than this do not determine it. */
constexpr double DRIFT_COST_us = 1.5e6;
/* (2/3)^40 of SLOPE_LIMIT, over WINDOW_us: nanoseconds. */
constexpr int STEPS = 40;

/* Where a function that first rises and then falls is highest. */
template <typename Function> static double highest(double low, double high, Function value) {
  for (int i = 0; i < STEPS; i++) {
    double a = low + (high - low) / 3;
    double b = high - (high - low) / 3;
    if (value(a) < value(b)) {
      low = a;
    } else {
      high = b;
    }
  }
  return (low + high) / 2;
}

/* The last place on the way from inside to outside where the function is not negative. */
template <typename Function> static double edge(double inside, double outside, Function value) {
  if (value(outside) >= 0) {
    return outside;
  }
  for (int i = 0; i < STEPS; i++) {
    double middle = (inside + outside) / 2;
    (value(middle) >= 0 ? inside : outside) = middle;
  }
  return inside;
}

double ClockEstimate::host_at(std::uint64_t other_device_us) const {
  auto passed_us = static_cast<double>(static_cast<std::int64_t>(other_device_us - device_us));
  return host_us + passed_us / (1 + drift_ppm * 1e-6);
}

std::optional<ClockEstimate> ClockFit::fit() const {
  const ClockExchange &last = exchanges_.back();
  /* Limits at the time of the last exchange of a line of this slope, relative to its sending. */
  auto limit = [&](double slope, bool upper) {
    double tightest = upper ? std::numeric_limits<double>::infinity() : -std::numeric_limits<double>::infinity();
    for (const ClockExchange &exchange : exchanges_) {
      auto ago_us = static_cast<double>(last.device_us - exchange.device_us);
      auto host_us = static_cast<double>((upper ? exchange.received_us : exchange.sent_us) - last.sent_us);
      double here = host_us + ago_us * (1 + slope);
      tightest = upper ? std::min(tightest, here) : std::max(tightest, here);
    }
    return tightest;
  };
  auto gap = [&](double slope) { return limit(slope, true) - limit(slope, false); };

  double widest = highest(-SLOPE_LIMIT, SLOPE_LIMIT, gap);
  if (gap(widest) < 0) {
    return std::nullopt;
  }
  double slowest = edge(widest, -SLOPE_LIMIT, gap);
  double fastest = edge(widest, SLOPE_LIMIT, gap);
  double slope = highest(slowest, fastest, [&](double candidate) { return gap(candidate) - DRIFT_COST_us * std::abs(candidate); });
  double middle = (limit(slope, true) + limit(slope, false)) / 2;
  double latest = limit(highest(slowest, fastest, [&](double s) { return limit(s, true); }), true);
  double earliest = limit(highest(slowest, fastest, [&](double s) { return -limit(s, false); }), false);
  ClockEstimate estimate;
  estimate.device_us = last.device_us;
  estimate.host_us = static_cast<double>(last.sent_us) + middle;
  estimate.drift_ppm = (1 / (1 + slope) - 1) * 1e6;
  estimate.uncertainty_us = std::max(latest - middle, middle - earliest);
  return estimate;
}

void ClockFit::add(const ClockExchange &exchange) {
  if (exchange.received_us < exchange.sent_us || (!exchanges_.empty() && exchange.device_us < exchanges_.back().device_us)) {
    return;
  }
  exchanges_.push_back(exchange);
  while (exchanges_.size() > EXCHANGES || static_cast<double>(exchange.device_us - exchanges_.front().device_us) > WINDOW_us) {
    exchanges_.pop_front();
  }
  estimate_ = fit();
  if (!estimate_) {
    jumps_++;
    while (!estimate_) {
      exchanges_.erase(exchanges_.begin(), exchanges_.begin() + static_cast<std::ptrdiff_t>((exchanges_.size() + 1) / 2));
      if (exchanges_.empty()) {
        exchanges_.push_back(exchange);
      }
      estimate_ = fit();
    }
  }
}

} // namespace fingertip
