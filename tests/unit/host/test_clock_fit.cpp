#include "libfingertip/clock_fit.hpp"
#include "libfingertip/random.hpp"

#include <cmath>
#include <gtest/gtest.h>

using namespace fingertip;

namespace {

/* A fingertip whose clock is off, and the delays of USB and of a busy main loop between. */
struct Device {
  double zero_us; /* host time at which its clock was zero */
  double drift_ppm;
  double wander_ppm = 0; /* in a minute, as a crystal that warms up */

  std::uint64_t at(double host_us) const {
    double s = (host_us - zero_us) / 60e6;
    double passed_us = host_us - zero_us;
    return static_cast<std::uint64_t>(passed_us * (1 + 1e-6 * (drift_ppm + wander_ppm * s / 2)));
  }
};

constexpr double HOST_us = 5e12; /* two months of uptime */

/* Exchanges every 100 ms, after a burst, and the largest error of any frame after that, us; the
 * bound must hold at every exchange. */
double worst_error_us(const Device &device, double seconds, std::uint64_t seed, double burst_us = 0) {
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

} // namespace

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
