#include "libfingertip/random.hpp"
#include "web/wasm/bundle.hpp"

#include <cmath>
#include <gtest/gtest.h>

using namespace fingertip::web;

constexpr double FRICTION = 0.5, KINETIC_SHARE = 0.8, FORCE_N = 6.0, STIFFNESS_N_mm = 4.5;
constexpr double RADIUS_mm = 4.0, STEP_s = 5e-5;
constexpr double HOLDS_N = FRICTION * FORCE_N;

static Wrench move(Bundle &bundle, const Motion &motion, double seconds) {
  Wrench last;
  for (long i = 0; i < std::lround(seconds / STEP_s); i++) {
    last = bundle.step(STEP_s, FORCE_N, STIFFNESS_N_mm, RADIUS_mm, motion);
  }
  return last;
}

TEST(Bundle, GivesWayAsMindlinsContactDoes) {
  const double dead_travel_mm = 1.5 * HOLDS_N / STIFFNESS_N_mm;
  for (const double direction : {0.0, 0.7, 2.0}) {
    for (const double share : {0.1, 0.3, 0.6, 0.9}) {
      Bundle bundle(FRICTION, KINETIC_SHARE);
      constexpr double SPEED_mm_s = 1.0;
      const Motion motion{SPEED_mm_s * std::cos(direction), SPEED_mm_s * std::sin(direction), 0.0};
      const Wrench held = move(bundle, motion, share * dead_travel_mm / SPEED_mm_s);
      const double expected_N = HOLDS_N * (1.0 - std::pow(1.0 - share, 1.5));
      EXPECT_NEAR(std::hypot(held.x_N, held.y_N), expected_N, 0.01 * HOLDS_N) << share;
      EXPECT_NEAR(std::atan2(-held.y_N, -held.x_N), direction, 1e-6);
      EXPECT_FALSE(bundle.slips());
    }
  }
}

TEST(Bundle, SlidesAtKineticFrictionAndHealsAtRest) {
  Bundle bundle(FRICTION, KINETIC_SHARE);
  double most_N = 0.0;
  for (int i = 0; i < 40000; i++) {
    const Wrench held = bundle.step(STEP_s, FORCE_N, STIFFNESS_N_mm, RADIUS_mm, {20.0, 0.0, 0.0});
    most_N = std::max(most_N, -held.x_N);
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

TEST(Bundle, SpinsAtTheTorqueOfAHertzContact) {
  Bundle bundle(FRICTION, 1.0);
  const Wrench held = move(bundle, {0.0, 0.0, 5.0}, 1.0);
  EXPECT_NEAR(-held.turn_Nmm, 3.0 * M_PI / 16.0 * HOLDS_N * RADIUS_mm, 0.01 * HOLDS_N * RADIUS_mm);
  EXPECT_TRUE(bundle.slips());
}

TEST(Bundle, WindsUpAsStifflyAsAHalfSpace) {
  Bundle bundle(FRICTION, 1.0);
  constexpr double TURN_rad = 0.001;
  const double lever_mm = Bundle::LEVER * RADIUS_mm;
  const Wrench held = move(bundle, {0.0, 0.0, TURN_rad}, 1.0);
  // 16 G a^3 / 3 where 8 G a / (2 - nu) is the stiffness along it, nu = 0.5.
  const double expected_Nmm = STIFFNESS_N_mm * RADIUS_mm * RADIUS_mm * TURN_rad;
  EXPECT_NEAR(-held.turn_Nmm, expected_Nmm, 0.06 * expected_Nmm);
  EXPECT_NEAR(Bundle::TURN_STIFFNESS * lever_mm * lever_mm, RADIUS_mm * RADIUS_mm, 0.02 * RADIUS_mm * RADIUS_mm);
}

TEST(Bundle, SharesFrictionBetweenSlidingAndSpinning) {
  for (const double turn_rad_s : {1.0, 4.0, 20.0}) {
    Bundle bundle(FRICTION, 1.0);
    const Motion motion{6.0, -8.0, turn_rad_s};
    const Wrench held = move(bundle, motion, 1.0);
    const double lever_mm = Bundle::LEVER * RADIUS_mm, spin_mm_s = lever_mm * turn_rad_s;
    const double speed_mm_s = std::hypot(10.0, spin_mm_s);
    EXPECT_NEAR(std::hypot(held.x_N, held.y_N, held.turn_Nmm / lever_mm), HOLDS_N, 1e-3);
    EXPECT_NEAR(-held.x_N, HOLDS_N * motion.x_mm_s / speed_mm_s, 0.01);
    EXPECT_NEAR(-held.y_N, HOLDS_N * motion.y_mm_s / speed_mm_s, 0.01);
    EXPECT_NEAR(-held.turn_Nmm, HOLDS_N * lever_mm * spin_mm_s / speed_mm_s, 0.02);
  }
}

TEST(Bundle, NeverGivesEnergyAway) {
  fingertip::Random random(1, 1, 1);
  Bundle bundle(FRICTION, KINETIC_SHARE);
  double work_mJ = 0.0, lost_mJ = 0.0;
  for (int leg = 0; leg < 200; leg++) {
    const Motion motion{30.0 * random.normal(), 30.0 * random.normal(), 5.0 * random.normal()};
    for (int i = 0; i < 200; i++) {
      const Wrench held = bundle.step(STEP_s, FORCE_N, STIFFNESS_N_mm, RADIUS_mm, motion);
      work_mJ -= STEP_s * (held.x_N * motion.x_mm_s + held.y_N * motion.y_mm_s + held.turn_Nmm * motion.turn_rad_s);
      ASSERT_GE(bundle.lost_mJ(), lost_mJ - 1e-12);
      lost_mJ = bundle.lost_mJ();
    }
  }
  EXPECT_GT(lost_mJ, 10.0);
  EXPECT_NEAR(work_mJ, lost_mJ + bundle.elastic_mJ(STIFFNESS_N_mm), 0.01 * work_mJ);
}
