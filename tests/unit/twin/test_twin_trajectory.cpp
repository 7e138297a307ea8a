#include "simulation/twin/trajectory.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <stdexcept>

using namespace fingertip::twin;

TEST(Profile, IsContinuousAndHitsItsValues) {
  Profile profile(1.0);
  profile.hold(0.5).ease(0.2, 5.0).line(1.0, 3.0).hold(0.1).ease(0.3, 0.0);
  EXPECT_NEAR(profile.end_s(), 2.1, 1e-12);
  EXPECT_EQ(profile.at(-1.0), 1.0);
  EXPECT_EQ(profile.at(0.25), 1.0);
  EXPECT_NEAR(profile.at(0.6), 3.0, 1e-12);
  EXPECT_NEAR(profile.at(0.7), 5.0, 1e-12);
  EXPECT_NEAR(profile.at(1.2), 4.0, 1e-12);
  EXPECT_NEAR(profile.at(1.75), 3.0, 1e-12);
  EXPECT_EQ(profile.at(2.1), 0.0);
  EXPECT_EQ(profile.at(99.0), 0.0);
  for (double t_s = 0.0; t_s < 2.2; t_s += 1e-5) {
    EXPECT_LT(std::abs(profile.at(t_s + 1e-5) - profile.at(t_s)), 31e-5) << t_s;
  }
}

TEST(Profile, TravelsAtConstantSpeedBetweenConstantAccelerations) {
  for (double speed : {20.0, 50.0, 100.0, 150.0, 200.0}) {
    Profile way;
    way.hold(1.0).travel(24.0, speed, 0.01);
    EXPECT_NEAR(way.end_value(), 24.0, 1e-12);
    EXPECT_NEAR(way.end_s(), 1.0 + 24.0 / speed + 0.01, 0.6e-3);
    const auto rate = [&](double t_s) { return (way.at(t_s + 1e-6) - way.at(t_s - 1e-6)) / 2e-6; };
    const double cruise = rate(1.03);
    EXPECT_NEAR(cruise, speed, 0.005 * speed);
    EXPECT_NEAR(rate(way.end_s() - 0.02), cruise, 1e-4);
    EXPECT_NEAR(rate(1.005), 0.5 * cruise, 1e-3);
    EXPECT_NEAR(rate(way.end_s() - 0.0025), 0.25 * cruise, 1e-3);
  }
  EXPECT_THROW(Profile().travel(0.5, 100.0, 0.01), std::invalid_argument);
}

TEST(Profile, TracesValuesWithFewerPieces) {
  std::vector<double> values;
  for (int i = 1; i <= 4000; i++) {
    values.push_back(i < 2000 ? std::sin(1e-3 * i) : i < 3000 ? 5.0 : 5.0 + 0.01 * (i - 3000));
  }
  Profile profile(0.0);
  profile.hold(0.5).trace(values, 1e-3);
  EXPECT_NEAR(profile.end_s(), 4.5, 1e-9);
  EXPECT_EQ(profile.at(0.3), 0.0);
  for (int i = 1; i <= 4000; i++) {
    EXPECT_NEAR(profile.at(0.5 + 1e-3 * i), values[std::size_t(i - 1)], 1e-3 + 1e-12) << i;
  }
  EXPECT_EQ(profile.at(4.5), values.back());
}

TEST(WindUp, BeginsLikeASpringAndEndsWhereAllSlides) {
  constexpr double FRICTION_N = 3.0, SHEAR_MPa = 0.19, RADIUS_mm = 2.5;
  const double limit_Nmm = 3.0 * M_PI / 16.0 * FRICTION_N * RADIUS_mm;
  const double spring_Nmm = 16.0 / 3.0 * SHEAR_MPa * std::pow(RADIUS_mm, 3);
  EXPECT_NEAR(wind_up_rad(1e-3, FRICTION_N, SHEAR_MPa, RADIUS_mm), 1e-3 * limit_Nmm / spring_Nmm, 1e-3 * 1e-3 * limit_Nmm / spring_Nmm);
  double before = 0.0;
  for (double share = 0.05; share < 1.01; share += 0.05) {
    const double now = wind_up_rad(share, FRICTION_N, SHEAR_MPa, RADIUS_mm);
    EXPECT_GT(now - before, 0.05 * limit_Nmm / spring_Nmm); // softer and softer
    EXPECT_EQ(wind_up_rad(-share, FRICTION_N, SHEAR_MPa, RADIUS_mm), -now);
    before = now;
  }
  EXPECT_NEAR(before, 0.21895 * FRICTION_N / (SHEAR_MPa * RADIUS_mm * RADIUS_mm), 1e-3 * before);
}

TEST(WindUp, IsNearLubkinsIntegrals) {
  // The stiffness of what sticks, a disc of radius c, (16 / 3) G c^3, over the turn that leaves it: 3 mu F / (4 pi G
  // a^2) (K - E), elliptic integrals of k, k^2 = 1 - (c / a)^2. All in their units.
  const double limit = 3.0 * M_PI / 16.0;
  constexpr int STEPS = 20000;
  double torque = 0.0;
  std::vector<std::pair<double, double>> errors{{0.2, -0.004}, {0.5, -0.034}, {0.8, -0.140}};
  for (int i = 0; i < STEPS; i++) {
    const double k = (i + 0.5) / STEPS, rest = std::sqrt(1.0 - k * k);
    const double turn = 3.0 / (4.0 * M_PI) * (std::comp_ellint_1(k) - std::comp_ellint_2(k));
    torque += 4.0 / M_PI * k * rest * std::comp_ellint_2(k) / STEPS;
    if (!errors.empty() && torque >= errors.front().first * limit) {
      EXPECT_NEAR(wind_up_rad(torque / limit, 1.0, 1.0, 1.0) / turn - 1.0, errors.front().second, 0.001);
      errors.erase(errors.begin());
    }
  }
  EXPECT_TRUE(errors.empty());
  EXPECT_NEAR(torque, limit, 1e-5); // where nothing sticks
}

TEST(Grip, CreepsThenFollows) {
  const Grip grip{2.0, 0.25, 0.0};
  EXPECT_EQ(grip.way_mm(0.0), 0.0);
  EXPECT_NEAR(grip.way_mm(1.0), 0.5 * (1.0 - std::pow(0.5, 1.5)), 1e-12);
  EXPECT_NEAR(grip.way_mm(2.0), 0.5, 1e-12);
  EXPECT_NEAR(grip.way_mm(7.0), 5.5, 1e-12);
  EXPECT_NEAR(grip.pusher_mm(5.5), 7.0, 1e-12);
  EXPECT_NEAR((Grip{0.0, 0.5, 0.0}.way_mm(3.0)), 3.0, 1e-12);
  double before = 0.0;
  for (double pusher = 0.0; pusher < 5.0; pusher += 1e-4) {
    const double way = grip.way_mm(pusher);
    EXPECT_GE(way, before);
    EXPECT_LT(way - before, 1.01e-4);
    before = way;
  }
}

TEST(Grip, SticksAndJumps) {
  const Grip grip{1.0, 0.5, 1.5};
  EXPECT_NEAR(grip.way_mm(1.0 + 0.79 * 1.5), 0.5, 1e-9);
  EXPECT_NEAR(grip.way_mm(1.0 + 1.5), 0.5 + 1.5, 1e-9);
  EXPECT_NEAR(grip.way_mm(1.0 + 0.9 * 1.5), 0.5 + 0.75, 1e-9);
  EXPECT_NEAR(grip.way_mm(1.0 + 4.0 * 1.5 + 0.5), 0.5 + 4.0 * 1.5, 1e-9);
  EXPECT_NEAR(grip.pusher_mm(24.0), 1.0 + 16 * 1.5, 1e-9); // whole jumps
  double before = 0.0;
  for (double pusher = 0.0; pusher < 12.0; pusher += 1e-4) {
    const double way = grip.way_mm(pusher);
    EXPECT_GE(way, before - 1e-12);
    EXPECT_LT(way - before, 8e-4); // a jump is 1.5 times 5 times as fast as the pusher at most
    before = way;
  }
}

TEST(DiscBeforeEdge, IsWhatCountingGives) {
  for (double ahead : {-0.9, -0.4, 0.0, 0.3, 0.8}) {
    int all = 0, on = 0;
    double sum = 0.0;
    constexpr int N = 1000;
    for (int i = -N; i <= N; i++) {
      for (int j = -N; j <= N; j++) {
        const double x = double(i) / N, y = double(j) / N;
        if (x * x + y * y <= 1.0) {
          all++;
          if (x <= ahead) {
            on++;
            sum += x;
          }
        }
      }
    }
    const DiscPart part = disc_before_edge(ahead);
    EXPECT_NEAR(part.share, double(on) / all, 2e-3);
    EXPECT_NEAR(part.back, -sum / on, 5e-3);
  }
  EXPECT_NEAR(disc_before_edge(1.0).share, 1.0, 1e-12);
  EXPECT_NEAR(disc_before_edge(1.0).back, 0.0, 1e-12);
  EXPECT_NEAR(disc_before_edge(-1.0).share, 0.0, 1e-12);
  EXPECT_NEAR(disc_before_edge(-0.9999).back, 1.0, 1e-3);
}

TEST(Track, LeavesThePadSmoothly) {
  Track track;
  track.force_N = Profile(6.0);
  track.along_x = 1.0;
  track.along_y = 0.0;
  track.edge_x_mm = 15.0;
  track.radius_mm = 3.0;
  track.pusher_mm.line(1.8, 18.0);
  Touch before = track.at(0.0);
  for (int ms = 1; ms <= 1800; ms++) {
    const Touch now = track.at(1e-3 * ms);
    EXPECT_LE(now.force_N, before.force_N + 1e-9);
    EXPECT_GE(now.x_mm, before.x_mm - 1e-9);
    EXPECT_LE(now.x_mm, 15.0 + 1e-9);
    EXPECT_LT(before.force_N - now.force_N, 0.05);
    EXPECT_LT(now.x_mm - before.x_mm, 0.011);
    before = now;
  }
  EXPECT_NEAR(track.at(1.2).force_N, 6.0, 1e-9);
  EXPECT_NEAR(track.at(1.5).force_N, 3.0, 1e-9);
  EXPECT_NEAR(before.force_N, 0.0, 1e-9);
}
