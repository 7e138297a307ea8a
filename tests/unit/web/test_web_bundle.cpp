#include "web/wasm/bundle.hpp"

#include <cmath>
#include <gtest/gtest.h>

using namespace fingertip::web;

constexpr double FRICTION = 0.5, KINETIC_SHARE = 0.8, FORCE_N = 6.0, STIFFNESS_N_mm = 4.5;
constexpr double STEP_s = 5e-5;
constexpr double HOLDS_N = FRICTION * FORCE_N;

static void move(Bundle &bundle, const Motion &motion, double seconds) {
  for (long i = 0; i < std::lround(seconds / STEP_s); i++) {
    bundle.step(STEP_s, FORCE_N, STIFFNESS_N_mm, motion);
  }
}

TEST(Bundle, GivesWayAsMindlinsContactDoes) {
  const double dead_travel_mm = 1.5 * HOLDS_N / STIFFNESS_N_mm;
  for (const double direction : {0.0, 0.7, 2.0}) {
    for (const double share : {0.1, 0.3, 0.6, 0.9}) {
      Bundle bundle(FRICTION, KINETIC_SHARE);
      constexpr double SPEED_mm_s = 1.0;
      const Motion motion{SPEED_mm_s * std::cos(direction), SPEED_mm_s * std::sin(direction)};
      move(bundle, motion, share * dead_travel_mm / SPEED_mm_s);
      const double expected_N = HOLDS_N * (1.0 - std::pow(1.0 - share, 1.5));
      EXPECT_NEAR(std::hypot(bundle.pull_x_N(), bundle.pull_y_N()), expected_N, 0.01 * HOLDS_N) << share;
      EXPECT_NEAR(std::atan2(bundle.pull_y_N(), bundle.pull_x_N()), direction, 1e-6);
      EXPECT_FALSE(bundle.slips());
    }
  }
}

TEST(Bundle, SlidesAtKineticFrictionAndHealsAtRest) {
  Bundle bundle(FRICTION, KINETIC_SHARE);
  double most_N = 0.0;
  for (int i = 0; i < 40000; i++) {
    bundle.step(STEP_s, FORCE_N, STIFFNESS_N_mm, {20.0, 0.0});
    most_N = std::max(most_N, bundle.pull_x_N());
  }
  EXPECT_NEAR(most_N, HOLDS_N, 0.01 * HOLDS_N);
  EXPECT_TRUE(bundle.slips());
  EXPECT_NEAR(bundle.slip_mm_s(), 20.0, 0.1);
  // h = 1 / (1 + HEALS u / SETTLES) in steady slip: 1 / 11.
  EXPECT_NEAR(bundle.friction(), FRICTION * (KINETIC_SHARE + 0.2 / 11.0), 1e-3);
  move(bundle, {}, 1.0);
  EXPECT_FALSE(bundle.slips());
  EXPECT_NEAR(bundle.friction(), FRICTION, 1e-3);
}
