#include "simulation/twin/held_object.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>

using fingertip::twin::HeldObject;

constexpr double MASS_kg = 0.15, FRICTION = 0.5, KINETIC_SHARE = 0.8;
constexpr double FORCE_N = 6.0, STIFFNESS_N_mm = 4.5;
constexpr double HOLDS_N = FRICTION * FORCE_N;
constexpr double DEAD_TRAVEL_mm = 1.5 * HOLDS_N / STIFFNESS_N_mm;

static HeldObject object() { return HeldObject(MASS_kg, FRICTION, KINETIC_SHARE); }

static double mindlin_mm(double load_share) { return DEAD_TRAVEL_mm * (1.0 - std::pow(1.0 - load_share, 2.0 / 3.0)); }

static void play(
    HeldObject &held, double seconds, const std::function<double(double)> &load_N,
    const std::function<double(double)> &force_N = [](double) { return FORCE_N; }, double step_s = HeldObject::STEP_s) {
  const long steps = std::lround(seconds / step_s);
  for (long i = 0; i < steps; i++) {
    const double t_s = static_cast<double>(i) * step_s;
    held.step(step_s, force_N(t_s), STIFFNESS_N_mm, load_N(t_s));
  }
}

// From one load to another, from rest to rest, in a second.
static std::function<double(double)> ramp(double from_N, double to_N) {
  return [=](double t_s) {
    const double u = std::min(t_s, 1.0);
    return from_N + (to_N - from_N) * u * u * (3.0 - 2.0 * u);
  };
}

TEST(HeldObject, GivesWayAsMindlinsContactDoes) {
  for (double share : {0.1, 0.3, 0.5, 0.8, 0.95}) {
    HeldObject held = object();
    play(held, 1.5, ramp(0.0, share * HOLDS_N));
    EXPECT_NEAR(held.way_mm(), mindlin_mm(share), 0.004 * DEAD_TRAVEL_mm) << share;
    EXPECT_NEAR(held.tangential_N(), share * HOLDS_N, 1e-3);
    EXPECT_NEAR(held.speed_mm_s(), 0.0, 0.05);
  }
}

TEST(HeldObject, ComesBackOnTheCurveWithBothAxesDoubled) {
  HeldObject held = object();
  play(held, 1.5, ramp(0.0, 0.8 * HOLDS_N));
  play(held, 1.5, ramp(0.8 * HOLDS_N, 0.0));
  EXPECT_NEAR(held.way_mm(), mindlin_mm(0.8) - 2.0 * mindlin_mm(0.4), 0.006 * DEAD_TRAVEL_mm);
  EXPECT_GT(held.way_mm(), 0.05);
}

TEST(HeldObject, SticksUntilFrictionGivesWay) {
  for (double share : {0.9, 0.98, 1.02, 1.1}) {
    HeldObject held = object();
    bool slips = false;
    double most = 0.0;
    for (long i = 0; i < 40000 && held.way_mm() < 5.0; i++) {
      held.step(HeldObject::STEP_s, FORCE_N, STIFFNESS_N_mm, ramp(0.0, share * HOLDS_N)(HeldObject::STEP_s * static_cast<double>(i)));
      slips = slips || held.slips();
      most = std::max(most, held.tangential_N() / HOLDS_N);
      EXPECT_LE(held.tangential_N(), HOLDS_N * (1.0 + 1e-9));
      if (held.slips()) {
        EXPECT_GE(held.way_mm(), 0.95 * DEAD_TRAVEL_mm);
      }
    }
    EXPECT_EQ(slips, share > 1.0) << share;
    EXPECT_NEAR(most, std::min(share, 1.0), 0.003);
  }
}

TEST(HeldObject, FallsByWhatKineticFrictionLeaves) {
  HeldObject held = object();
  const double load_N = 1.5 * HOLDS_N;
  play(held, 0.15, [=](double) { return load_N; });
  const double before_mm_s = held.speed_mm_s();
  EXPECT_TRUE(held.slips());
  play(held, 0.05, [=](double) { return load_N; });
  const double expected_mm_s2 = 1e3 * (load_N - KINETIC_SHARE * HOLDS_N) / MASS_kg;
  EXPECT_NEAR((held.speed_mm_s() - before_mm_s) / 0.05, expected_mm_s2, 0.002 * expected_mm_s2);
  EXPECT_NEAR(held.tangential_N(), KINETIC_SHARE * HOLDS_N, 0.01 * HOLDS_N);
}

TEST(HeldObject, StopsWhereTheGripBecomesStrongerAndFrictionComesBack) {
  HeldObject held = object();
  const double load_N = 1.02 * HOLDS_N;
  play(held, 1.05, ramp(0.0, load_N));
  ASSERT_TRUE(held.slips());
  ASSERT_GT(held.speed_mm_s(), 10.0);
  ASSERT_LT(held.friction(), 0.85 * FRICTION);
  const auto grips = [](double) { return 2.0 * FORCE_N; };
  play(
      held, 0.5, [=](double) { return load_N; }, grips);
  const double there_mm = held.way_mm();
  EXPECT_FALSE(held.slips());
  EXPECT_NEAR(held.tangential_N(), load_N, 0.01);
  play(
      held, 0.5, [=](double) { return load_N; }, grips);
  EXPECT_NEAR(held.way_mm(), there_mm, 1e-3);
  EXPECT_NEAR(held.friction(), FRICTION, 0.001 * FRICTION);
}

TEST(HeldObject, LosesNoEnergyAndMakesNone) {
  HeldObject held = object();
  // Shaken within what sticks, let fall, held again, all at one force.
  const auto load_N = [](double t_s) {
    return t_s < 0.6 ? 0.7 * HOLDS_N * std::sin(60.0 * t_s) : t_s < 0.7 ? 1.3 * HOLDS_N : 0.2 * HOLDS_N;
  };
  double damped = 0.0, rubbed = 0.0;
  for (int i = 0; i < 24000; i++) {
    held.step(HeldObject::STEP_s, FORCE_N, STIFFNESS_N_mm, load_N(HeldObject::STEP_s * i));
    const HeldObject::Energy now = held.energy();
    // Within the step in which something turns back.
    EXPECT_GE(now.damped, damped - 2e-4);
    EXPECT_GE(now.rubbed, rubbed - 2e-4);
    damped = now.damped;
    rubbed = now.rubbed;
    if (i % 100 == 0) {
      EXPECT_NEAR(now.work, now.kinetic + now.elastic + now.damped + now.rubbed,
                  0.003 * (now.elastic + now.kinetic + now.rubbed + now.damped) + 0.002)
          << i;
    }
  }
  EXPECT_GT(rubbed, 5.0);
  EXPECT_GT(held.way_mm(), 2.0);
}

TEST(HeldObject, StepsAreShortEnough) {
  const auto ends_mm = [](double step_s) {
    HeldObject held = object();
    const auto load_N = [](double t_s) { return 1.2 * HOLDS_N * std::min(t_s / 0.1, 1.0); };
    const auto force_N = [](double t_s) { return FORCE_N * (1.0 + std::clamp((t_s - 0.13) / 0.05, 0.0, 1.0)); };
    play(held, 0.4, load_N, force_N, step_s);
    EXPECT_FALSE(held.slips());
    return held.way_mm();
  };
  const double exact_mm = ends_mm(HeldObject::STEP_s / 50.0);
  EXPECT_GT(exact_mm, 2.0);
  EXPECT_NEAR(ends_mm(HeldObject::STEP_s), exact_mm, 0.003);
}
