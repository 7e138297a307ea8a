#include "libfingertip/clock_fit.hpp"
#include "libfingertip/edge_alignment.hpp"
#include "libfingertip/edge_counter.hpp"
#include "libfingertip/random.hpp"

#include <cmath>
#include <gtest/gtest.h>

using namespace fingertip;

/* A fingertip whose clock is off, and the delays of USB and of a busy main loop between. */
struct Device {
  double zero_us; /* host time at which its clock was zero */
  double drift_ppm;
  double wander_ppm = 0; /* in a minute, as a crystal that warms up */

  double us(double host_us) const {
    double s = (host_us - zero_us) / 60e6;
    return (host_us - zero_us) * (1 + 1e-6 * (drift_ppm + wander_ppm * s / 2));
  }
  std::uint64_t at(double host_us) const { return static_cast<std::uint64_t>(us(host_us)); }
  std::uint64_t stamp(double host_us) const { return static_cast<std::uint64_t>(std::llround(us(host_us))); }
};

constexpr double HOST_us = 5e12; /* two months of uptime */

/* Exchanges every 100 ms, after a burst, and the largest error of any frame after that, us; the bound must hold at every exchange. */
static double worst_error_us(const Device &device, double seconds, std::uint64_t seed, double burst_us = 0) {
  ClockFit fit;
  double worst = 0;
  double sent_us = HOST_us;
  for (std::uint64_t i = 0; sent_us < HOST_us + seconds * 1e6; i++) {
    Random random(seed, 0, i);
    /* up to 1 ms for the next USB frame, main loop and sleep of the host, now and then far more */
    double there_us = 60 + random.uniform(0, 1000) + random.uniform(0, i < 32 ? 0 : 4000);
    double back_us = 60 + random.uniform(0, 1000) - 300 * std::log(random.uniform(1e-9, 1));
    back_us += random.uniform(0, 1) < 0.05 ? burst_us : 0;
    double received_us = sent_us + there_us + back_us;
    fit.add({std::llround(std::floor(sent_us)), std::llround(std::ceil(received_us)), device.at(sent_us + there_us)});
    const ClockEstimate &now = *fit.estimate();
    double error_us = now.host_at(device.at(sent_us + there_us)) - (sent_us + there_us);
    EXPECT_LE(std::abs(error_us), now.uncertainty_us + 2) << i;
    double step_us = i < 32 ? 6000 : 100000;
    for (double later_us = received_us; i >= 32 && later_us < received_us + step_us; later_us += 2500) {
      worst = std::max(worst, std::abs(now.host_at(device.at(later_us)) - later_us));
    }
    sent_us = received_us + step_us;
  }
  EXPECT_EQ(fit.jumps(), 0u);
  return worst;
}

constexpr double UNCERTAINTY_us = 80;

/* Devices on one wire, and what a recorder knows of their clocks: wrong by up to its bound, and another estimate ten times a second. */
class Bench {
public:
  explicit Bench(std::vector<Device> devices) : devices_(std::move(devices)), alignment_(devices_.size()) {}

  /* Until so many seconds have passed; an edge each period on the wires of these. */
  void run(double seconds, double period_us, const std::vector<std::size_t> &wired) {
    const double end_us = now_us_ + 1e6 * seconds;
    for (double next_edge_us = now_us_ + 777.3; now_us_ < end_us; now_us_ += STEP_us) {
      for (std::size_t i = 0; i < devices_.size(); i++) {
        if (steps_ % 20 == i) {
          Random random(7, i, steps_);
          const std::uint64_t device_us = devices_[i].stamp(now_us_);
          alignment_.clock(i, {device_us, now_us_ + random.uniform(-UNCERTAINTY_us, UNCERTAINTY_us),
                               devices_[i].drift_ppm + random.uniform(-0.3, 0.3), UNCERTAINTY_us});
        }
      }
      for (; next_edge_us < now_us_ + STEP_us; next_edge_us += period_us) {
        for (std::size_t i : wired) {
          alignment_.edge(i, devices_[i].stamp(next_edge_us), edges_ % 2 == 0);
        }
        edges_++;
      }
      compare();
      steps_++;
    }
  }

  void restart(std::size_t device, double ago_us) {
    devices_[device].zero_us = now_us_ - ago_us;
    alignment_.restart(device);
  }

  double worst_us = 0, worst_bound_us = 0;
  unsigned placed = 0, compared = 0;
  const EdgeAlignment &alignment() const { return alignment_; }
  std::uint64_t device_us(std::size_t i) const { return devices_[i].stamp(now_us_); }

private:
  static constexpr double STEP_us = 5000;

  /* Rows of one moment, of the first two. */
  void compare() {
    const auto a = alignment_.place(0, devices_[0].stamp(now_us_));
    const auto b = alignment_.place(1, devices_[1].stamp(now_us_));
    compared++;
    if (a && b) {
      placed++;
      const double apart_us = std::abs(a->host_us - b->host_us);
      const double bound_us = a->uncertainty_us + b->uncertainty_us;
      EXPECT_LE(apart_us, bound_us + 1); /* the times are whole microseconds */
      worst_us = std::max(worst_us, apart_us);
      worst_bound_us = std::max(worst_bound_us, bound_us);
      EXPECT_LE(std::abs(a->host_us - now_us_), 2 * UNCERTAINTY_us);
    }
  }

  std::vector<Device> devices_;
  EdgeAlignment alignment_;
  double now_us_ = HOST_us;
  std::uint64_t steps_ = 0, edges_ = 0;
};

const std::vector<Device> APART = {{HOST_us - 3e6, 25}, {HOST_us - 7.5e6, -25}, {HOST_us - 1e6, 3}};

TEST(ClockFit, AMinuteFiftyPartsPerMillionApart) {
  for (std::uint64_t seed = 1; seed <= 3; seed++) {
    double a_us = worst_error_us({HOST_us - 1e6, +25}, 60, seed);
    double b_us = worst_error_us({HOST_us - 3e9, -25}, 60, seed + 100);
    EXPECT_LT(a_us + b_us, 1000) << seed << ": " << a_us << " " << b_us;
  }
}

TEST(ClockFit, WarmingUpAndBurstsOfDelay) { EXPECT_LT(worst_error_us({HOST_us - 1e6, 90, -1}, 240, 7, 100000), 500); }

TEST(ClockFit, FindsTheDrift) {
  ClockFit fit;
  Device device = {HOST_us - 1e6, 50};
  for (int i = 0; i < 120; i++) {
    double sent_us = HOST_us + i * 250e3;
    fit.add({std::llround(sent_us), std::llround(sent_us + 400), device.at(sent_us + 200)});
  }
  EXPECT_NEAR(fit.estimate()->drift_ppm, 50, 1);
  EXPECT_NEAR(fit.estimate()->uncertainty_us, 200, 5);
}

TEST(ClockFit, WithoutDelayThereIsNothingToGuess) {
  ClockFit fit;
  fit.add({1000, 1000, 77});
  EXPECT_DOUBLE_EQ(fit.estimate()->host_at(77), 1000);
  EXPECT_DOUBLE_EQ(fit.estimate()->uncertainty_us, 0);
}

TEST(ClockFit, AJumpIsNoticedAndForgotten) {
  ClockFit fit;
  for (int i = 0; i < 200; i++) {
    std::int64_t sent_us = 1000000 + i * 250000;
    std::uint64_t jump_us = i < 100 ? 0 : 50000;
    fit.add({sent_us, sent_us + 400, static_cast<std::uint64_t>(sent_us + 200) + jump_us});
  }
  EXPECT_GE(fit.jumps(), 1u);
  std::int64_t end_us = 1000000 + 199 * 250000 + 200;
  EXPECT_NEAR(fit.estimate()->host_at(static_cast<std::uint64_t>(end_us) + 50000), static_cast<double>(end_us), 100);
}

TEST(ClockFit, WhatCannotBeIsLeftOut) {
  ClockFit fit;
  fit.add({1000, 1200, 5000});
  fit.add({900, 800, 6000});
  fit.add({1300, 1500, 4000});
  EXPECT_EQ(fit.estimate()->device_us, 5000u);
}

TEST(EdgeAlignment, AnEdgeASecondTiesTwoClocksToMicroseconds) {
  Bench bench(APART);
  bench.run(40, 1e6, {0, 1});
  EXPECT_GT(bench.placed, 0.8 * bench.compared);
  EXPECT_LE(bench.worst_us, 2);
  EXPECT_LE(bench.worst_bound_us, 4);
  EXPECT_FALSE(bench.alignment().place(2, bench.device_us(2))) << "it has no wire";
}

TEST(EdgeAlignment, EdgesThatTheRecorderCannotTellApartAreNoHelp) {
  Bench bench(APART);
  bench.run(20, 70, {0, 1});
  EXPECT_EQ(bench.placed, 0u);
}

TEST(EdgeAlignment, EdgesOfOneAloneAreNoHelp) {
  Bench bench(APART);
  bench.run(20, 1e6, {1});
  EXPECT_EQ(bench.placed, 0u);
}

TEST(EdgeAlignment, AClockThatBeginsAnewIsTiedAnew) {
  for (std::size_t device : {0u, 1u}) {
    Bench bench(APART);
    bench.run(10, 0.3e6, {0, 1});
    const unsigned placed = bench.placed;
    EXPECT_GT(placed, 0u);
    bench.restart(device, 123456.7);
    EXPECT_FALSE(bench.alignment().place(device, bench.device_us(device)));
    bench.run(10, 0.3e6, {0, 1});
    EXPECT_GT(bench.placed, placed + 500);
    EXPECT_LE(bench.worst_us, 2);
  }
}

TEST(EdgeAlignment, AfterTheLastEdgeTheBoundGrowsUntilTheRecorderKnowsBetter) {
  Bench bench(APART);
  bench.run(10, 1e6, {0, 1});
  const unsigned placed = bench.placed;
  bench.run(400, 1e9, {0, 1});
  EXPECT_GT(bench.placed, placed);
  EXPECT_FALSE(bench.alignment().place(1, bench.device_us(1)));
}

TEST(EdgeCounter, CountsWhatIsMissing) {
  EdgeCounter counter;
  for (std::uint32_t number : {7u, 8u, 12u, 1u, 2u, 4u}) {
    counter.take({number, static_cast<std::uint8_t>(number % 2)});
  }
  EXPECT_EQ(counter.edges(), 6u);
  EXPECT_EQ(counter.missing(), 3u + 1u);
}
