#include "simulation/cell/gripper_motion.hpp"

#include <cmath>
#include <gtest/gtest.h>

using namespace fingertip;

constexpr double STEP_s = 0.001;

static void run(GripperMotion &motion, double seconds) {
  const long steps = std::lround(seconds / STEP_s);
  for (long i = 0; i < steps; i++) {
    motion.step(STEP_s);
  }
}

static void run(GripperMotion &motion, const GripCommand &move, double seconds) {
  motion.move(move);
  run(motion, seconds);
}

static GripperMotion activated(const char *model) {
  GripperMotion motion(gripper_mechanics(model));
  motion.activate();
  run(motion, motion.mechanics().activation_s + 0.01);
  EXPECT_TRUE(motion.active());
  EXPECT_FALSE(motion.moving());
  return motion;
}

/* An object of this width that pushes back with so much a millimetre, as springs do. */
static auto spring(double width_mm, double stiffness_N_mm) {
  return [=](double at_mm, double force_N) { return force_N > 0 && at_mm < width_mm && (width_mm - at_mm) * stiffness_N_mm >= force_N; };
}

TEST(GripperMotion, MovesOnlyOnceActivated) {
  GripperMotion motion(gripper_mechanics("2f85"));
  run(motion, {.width_mm = 10, .speed_mm_s = 150, .force_N = 20}, 1.0);
  EXPECT_FALSE(motion.active());
  EXPECT_EQ(motion.width_mm(), 85.0);

  motion.activate();
  double least_mm = 85.0;
  for (int i = 0; !motion.active(); i++) {
    ASSERT_LT(i, 3000);
    EXPECT_TRUE(motion.moving());
    motion.step(STEP_s);
    least_mm = std::min(least_mm, motion.width_mm());
  }
  EXPECT_NEAR(motion.time_s(), 1.0 + motion.mechanics().activation_s, 0.01);
  EXPECT_EQ(least_mm, 0.0);
  EXPECT_EQ(motion.width_mm(), 85.0);
}

TEST(GripperMotion, BeginsAfterItsLatencyAndRunsAtItsSpeed) {
  for (const char *model : {"2f85", "sts3215", "ideal"}) {
    GripperMotion motion = activated(model);
    const GripperTraits &traits = motion.mechanics().traits;
    const double begin_mm = motion.reported_width_mm();
    run(motion, {.width_mm = 30, .speed_mm_s = 50}, traits.latency_s);
    EXPECT_EQ(motion.reported_width_mm(), begin_mm) << model;
    run(motion, 0.1);
    EXPECT_NEAR(motion.reported_width_mm(), begin_mm - 5, traits.step_mm / 2 + 0.051) << model;
    EXPECT_TRUE(motion.moving());
    run(motion, 1.5);
    EXPECT_NEAR(motion.reported_width_mm(), 30, traits.step_mm / 2 + 1e-9) << model;
    EXPECT_FALSE(motion.moving());
    EXPECT_EQ(motion.status().object, false);
  }
}

TEST(GripperMotion, SpeedsStayWithinItsLimits) {
  GripperMotion motion = activated("2f85");
  run(motion, {.width_mm = 0, .speed_mm_s = 1}, 1.025);
  EXPECT_NEAR(motion.width_mm(), 85 - 20, 0.05);
  run(motion, {.width_mm = 85, .speed_mm_s = 1e9}, 0.125);
  EXPECT_NEAR(motion.width_mm(), 85 - 20 - 0.025 * 20 + 15, 0.05);
}

TEST(GripperMotion, IgnoresMovesShorterThanItsDeadband) {
  GripperMotion motion = activated("2f85");
  const double one_mm = motion.mechanics().traits.step_mm;
  run(motion, {.width_mm = 85 - 100 * one_mm, .speed_mm_s = 150}, 1.0);
  const double stands_mm = motion.width_mm();
  run(motion, {.width_mm = stands_mm - one_mm, .speed_mm_s = 150}, 0.5);
  EXPECT_EQ(motion.width_mm(), stands_mm);
  EXPECT_FALSE(motion.moving());
  run(motion, {.width_mm = stands_mm - 2 * one_mm, .speed_mm_s = 150}, 0.5);
  EXPECT_NEAR(motion.width_mm(), stands_mm - 2 * one_mm, 1e-9);
}

TEST(GripperMotion, StopsWhereTheForceIsReached) {
  GripperMotion motion = activated("2f85");
  motion.blocked_at = spring(40, 10);
  run(motion, {.width_mm = 0, .speed_mm_s = 100, .force_N = 30}, 1.0);
  EXPECT_NEAR(motion.width_mm(), 37, 0.01);
  EXPECT_FALSE(motion.moving());
  EXPECT_EQ(motion.status().object, true);
  EXPECT_EQ(motion.blocked(), -1);

  run(motion, {.width_mm = 0, .speed_mm_s = 100, .force_N = 60}, 0.5);
  EXPECT_NEAR(motion.width_mm(), 34, 0.01);
  /* What yields is followed, */
  motion.blocked_at = spring(20, 10);
  run(motion, 0.5);
  EXPECT_NEAR(motion.width_mm(), 14, 0.01);
  /* and what is gone was no object. */
  motion.blocked_at = nullptr;
  run(motion, 0.5);
  EXPECT_EQ(motion.width_mm(), 0.0);
  EXPECT_EQ(motion.status().object, false);
}

TEST(GripperMotion, FeelsWhatIsAroundItWhileItOpens) {
  GripperMotion motion = activated("2f85");
  run(motion, {.width_mm = 10, .speed_mm_s = 150}, 1.0);
  motion.blocked_at = [](double width_mm, double force_N) { return force_N < 0 && width_mm > 50; };
  run(motion, {.width_mm = 85, .speed_mm_s = 150, .force_N = 20}, 1.0);
  EXPECT_NEAR(motion.width_mm(), 50, 0.01);
  EXPECT_EQ(motion.blocked(), 1);
}

TEST(GripperMotion, FingersLagByTheBacklash) {
  GripperMotion motion = activated("sts3215");
  const double half_mm = motion.mechanics().backlash_mm / 2;
  run(motion, {.width_mm = 40, .speed_mm_s = 100}, 1.0);
  EXPECT_NEAR(motion.width_mm(), motion.reported_width_mm() + half_mm, 0.08);
  const double closed_mm = motion.width_mm();
  run(motion, {.width_mm = 40.5, .speed_mm_s = 100}, 1.0);
  EXPECT_EQ(motion.width_mm(), closed_mm);
  run(motion, {.width_mm = 60, .speed_mm_s = 100}, 1.0);
  EXPECT_NEAR(motion.width_mm(), motion.reported_width_mm() - half_mm, 0.08);

  /* What presses on them takes it up. */
  motion.blocked_at = spring(70, 1);
  motion.step(STEP_s);
  EXPECT_NEAR(motion.width_mm(), motion.reported_width_mm() + half_mm, 0.08);
}

TEST(GripperMotion, ACommandCountsAfterItsOwnLatency) {
  GripperMotion motion = activated("2f85");
  for (int i = 0; i < 100; i++) {
    run(motion, {.width_mm = 85 - 0.5 * (i + 1), .speed_mm_s = 150}, 0.005);
  }
  /* Twenty-five milliseconds behind: five commands. */
  EXPECT_NEAR(motion.width_mm(), 85 - 0.5 * 95, 0.75);
}

TEST(GripperMotion, ActivationDropsWhatIsHeld) {
  GripperMotion motion = activated("2f85");
  motion.blocked_at = spring(40, 10);
  run(motion, {.width_mm = 0, .speed_mm_s = 100, .force_N = 30}, 1.0);
  motion.activate();
  run(motion, motion.mechanics().activation_s / 3 - 0.01);
  EXPECT_EQ(motion.width_mm(), 85.0);
}

TEST(GripperMotion, WithoutPowerTheFingersStay) {
  GripperMotion motion = activated("2f85");
  run(motion, {.width_mm = 0, .speed_mm_s = 100}, 0.2);
  const double stands_mm = motion.width_mm();
  motion.power_off();
  run(motion, {.width_mm = 0, .speed_mm_s = 100}, 1.0);
  EXPECT_EQ(motion.width_mm(), stands_mm);
  EXPECT_FALSE(motion.status().active);
}

TEST(GripperMotion, TheSameCommandAgainIsNone) {
  GripperMotion motion = activated("2f85");
  motion.blocked_at = spring(40, 10);
  const GripCommand grip = {.width_mm = 0, .speed_mm_s = 100, .force_N = 30};
  run(motion, grip, 1.0);
  motion.move(grip);
  EXPECT_FALSE(motion.moving());
  EXPECT_EQ(motion.status().object, true);
  motion.move({.width_mm = 85, .speed_mm_s = 100, .force_N = 30});
  EXPECT_TRUE(motion.moving());
  run(motion, grip, 1.0);
  EXPECT_EQ(motion.status().object, true);
}

TEST(GripperMotion, TheSameAtAnyStep) {
  GripperMotion fine = activated("2f85"), coarse = activated("2f85");
  for (GripperMotion *motion : {&fine, &coarse}) {
    motion->move({.width_mm = 20, .speed_mm_s = 60});
  }
  run(fine, 0.8);
  for (int i = 0; i < 40; i++) {
    coarse.step(0.02);
  }
  EXPECT_NEAR(fine.width_mm(), coarse.width_mm(), 1e-9);
}

TEST(GripperMotion, AnUnknownModelIsRefused) { EXPECT_THROW(gripper_mechanics("3f"), Error); }
