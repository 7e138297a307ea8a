#include "scenes.hpp"

#include <gtest/gtest.h>
#include <set>

using namespace fingertip;
using namespace fingertip::twin;

TEST(Scenarios, placements_are_one_weight_that_stands) {
  ScenarioOptions options;
  options.kind = "placements";
  const Scenario scenario = make_scenario(options, table_of("sphere15"));
  EXPECT_EQ(scenario.options.indenter, "sphere15");
  EXPECT_GE(scenario.episodes.size(), 30u);
  double farthest_x = 0.0, farthest_y = 0.0;
  for (const Episode &episode : scenario.episodes) {
    ASSERT_EQ(episode.phases.size(), 3u);
    EXPECT_EQ(episode.phases[1].name, "hold");
    EXPECT_NEAR(episode.phases[1].end_s - episode.phases[1].begin_s, 2.0, 1e-9);
    const double middle_s = 0.5 * (episode.phases[1].begin_s + episode.phases[1].end_s) - episode.begin_s;
    EXPECT_EQ(episode.tracks[0].at(middle_s).force_N, 3.0);
    farthest_x = std::max(farthest_x, std::abs(episode.tracks[0].x_mm));
    farthest_y = std::max(farthest_y, std::abs(episode.tracks[0].y_mm));
  }
  /* To the outer sensors, and not beyond. */
  EXPECT_GT(farthest_x, 7.5);
  EXPECT_LE(farthest_x, 9.0);
  EXPECT_GT(farthest_y, 16.0);
  EXPECT_LE(farthest_y, 18.0);
}

TEST(Scenarios, HaveQuietTimeAndNoJumps) {
  for (const ScenarioKind &kind : scenario_kinds()) {
    const Scenario scenario = scenario_of(kind.name);
    ASSERT_GE(scenario.episodes.size(), 3u) << kind.name;
    double free_s = START_QUIET_s;
    for (const Episode &episode : scenario.episodes) {
      EXPECT_GE(episode.begin_s, free_s - 1e-9) << kind.name;
      free_s = episode.end_s + scenario.options.quiet_s;
      EXPECT_LE(free_s, *scenario.options.seconds + 1e-9);
      EXPECT_EQ(episode.phases.front().begin_s, episode.begin_s);
      EXPECT_NEAR(episode.phases.back().end_s, episode.end_s, 1e-9);
      for (std::size_t i = 1; i < episode.phases.size(); i++) {
        EXPECT_EQ(episode.phases[i].begin_s, episode.phases[i - 1].end_s);
        EXPECT_GT(episode.phases[i].end_s, episode.phases[i].begin_s) << episode.phases[i].name;
      }
      for (const Track &track : episode.tracks) {
        const double length_s = episode.end_s - episode.begin_s;
        EXPECT_EQ(track.at(0.0).force_N, 0.0);
        EXPECT_NEAR(track.at(length_s).force_N, 0.0, 1e-9) << kind.name;
        Touch before = track.at(0.0);
        for (double t_s = 1e-3; t_s < length_s + 1e-9; t_s += 1e-3) {
          const Touch now = track.at(t_s);
          EXPECT_LE(now.force_N, ContactTable::FORCE_MAX_N);
          EXPECT_GE(now.force_N, 0.0);
          // At most 15 N in 0.1 s, what slides is caught faster; 200 mm/s and 180 degrees a second,
          // what falls or winds up is a little faster.
          const bool slides = kind.name == "slide", turned = kind.name == "screw";
          EXPECT_LT(std::abs(now.force_N - before.force_N), slides ? 0.6 : 0.3) << kind.name << t_s;
          EXPECT_LT(std::hypot(now.x_mm - before.x_mm, now.y_mm - before.y_mm), slides ? 0.27 : 0.202) << kind.name << t_s;
          EXPECT_LT(std::abs(now.angle_rad - before.angle_rad), turned ? 5e-3 : 3.2e-3) << kind.name << t_s;
          before = now;
        }
      }
    }
  }
}

TEST(Scenarios, SlipIsTruthWhereThePusherMovesAndNowhereElse) {
  for (const ScenarioKind &kind : scenario_kinds()) {
    if (kind.name == "slide") {
      continue; // there it is found
    }
    const bool set = kind.name == "slip" || kind.name == "drag";
    const Scenario scenario = scenario_of(kind.name);
    for (const Episode &episode : scenario.episodes) {
      const Track &track = episode.tracks[0];
      int slipping = 0;
      for (long ms = 0; ms < std::lround(1e3 * (episode.end_s - episode.begin_s)); ms++) {
        const double local_s = 1e-3 * static_cast<double>(ms);
        // Half a millisecond to either side tells at the very beginning and end.
        const bool moved = track.pusher_mm.at(local_s) > track.pusher_mm.at(local_s - 5e-4);
        const bool moves = track.pusher_mm.at(local_s + 5e-4) > track.pusher_mm.at(local_s);
        const bool slips = episode.slips(episode.begin_s + local_s);
        EXPECT_EQ(slips, set && moved && moves) << kind.name << local_s;
        EXPECT_TRUE(!slips || track.at(local_s).force_N > 0.0);
        slipping += slips;
      }
      EXPECT_EQ(slipping > 100, set);
    }
  }
}

TEST(Scenarios, SlipHasDeadTravelThenSpeed) {
  const Scenario scenario = scenario_of("slip", [](ScenarioOptions &o) { o.dead_travel_mm = 2.0; });
  std::set<double> speeds;
  for (const Episode &episode : scenario.episodes) {
    speeds.insert(episode.speed_mm_s);
    const Phase &dead = phase_of(episode, "dead_travel"), &slip = phase_of(episode, "slip");
    const auto y = [&](double t_s) { return episode.tracks[0].at(t_s - episode.begin_s).y_mm; };
    EXPECT_NEAR(std::abs(y(dead.end_s) - y(dead.begin_s)), 1.0, 0.21);
    EXPECT_NEAR(std::abs(y(slip.end_s) - y(dead.begin_s)), 24.0, 1e-6);
    EXPECT_NEAR(dead.end_s - dead.begin_s, 2.0 / episode.speed_mm_s + 0.005, 1.2e-3);
    const double middle_s = 0.5 * (slip.begin_s + slip.end_s);
    EXPECT_NEAR(std::abs(y(middle_s + 0.01) - y(middle_s - 0.01)) / 0.02, episode.speed_mm_s, 0.006 * episode.speed_mm_s);
  }
  EXPECT_EQ(speeds, (std::set<double>{20, 50, 100, 150, 200}));
}

TEST(Scenarios, TwistsAreQuarterTurns) {
  for (const Episode &episode : scenario_of("twist").episodes) {
    const Phase &twist = phase_of(episode, "twist");
    const auto angle = [&](double t_s) { return episode.tracks[0].at(t_s - episode.begin_s).angle_rad; };
    EXPECT_NEAR(std::abs(angle(twist.end_s) - angle(twist.begin_s)), M_PI / 2, 1e-9);
  }
}

TEST(Scenarios, GridIsThePapers) {
  const Scenario scenario = scenario_of("grid", [](ScenarioOptions &o) { o.seconds = 1100; });
  std::map<std::pair<double, double>, std::set<double>> forces;
  std::map<std::pair<double, double>, int> near;
  for (const Episode &episode : scenario.episodes) {
    const Touch held = episode.tracks[0].at(episode.phases[1].end_s - episode.begin_s);
    forces[{held.x_mm, held.y_mm}].insert(held.force_N);
    near[{held.x_mm, held.y_mm}] = episode.sensors_near;
  }
  EXPECT_EQ(forces.size(), 21u);
  int count[5] = {};
  for (const auto &[place, n] : near) {
    EXPECT_LE(std::abs(place.first), 4.5);
    EXPECT_LE(std::abs(place.second), 13.5);
    // As many sensors are at the least distance.
    std::multiset<double> distances;
    for (int k = 0; k < geometry.sensor_count; k++) {
      distances.insert(std::hypot(double(geometry.x_mm[k]) - place.first, double(geometry.y_mm[k]) - place.second));
    }
    EXPECT_EQ(static_cast<std::size_t>(n), distances.count(*distances.begin()));
    count[n]++;
    EXPECT_EQ(forces[place], (std::set<double>{1, 2.5, 5, 10, 15}));
  }
  EXPECT_EQ(count[1], 3);
  EXPECT_EQ(count[2], 10);
  EXPECT_EQ(count[4], 8);
}

TEST(Scenarios, RandomPlacesFillTheAreaAndForcesAndTimesTheRange) {
  const Scenario scenario = scenario_of("hold", [](ScenarioOptions &o) { o.seconds = 6000; });
  double x_max = 0, y_max = 0, force_min = 99, force_max = 0, hold_min = 99, hold_max = 0;
  for (const Episode &episode : scenario.episodes) {
    const Touch held = episode.tracks[0].at(episode.phases[1].begin_s - episode.begin_s);
    x_max = std::max(x_max, std::abs(held.x_mm));
    y_max = std::max(y_max, std::abs(held.y_mm));
    force_min = std::min(force_min, held.force_N);
    force_max = std::max(force_max, held.force_N);
    hold_min = std::min(hold_min, episode.phases[1].end_s - episode.phases[1].begin_s);
    hold_max = std::max(hold_max, episode.phases[1].end_s - episode.phases[1].begin_s);
  }
  EXPECT_NEAR(hold_min, 0.2, 0.01);
  EXPECT_NEAR(hold_max, 10.0, 0.1);
  EXPECT_LE(x_max, 6.75);
  EXPECT_GT(x_max, 6.6);
  EXPECT_LE(y_max, 15.75);
  EXPECT_GT(y_max, 15.5);
  EXPECT_LT(force_min, 1.1);
  EXPECT_GE(force_min, 1.0);
  EXPECT_GT(force_max, 14.9);
  EXPECT_LE(force_max, 15.0);
}

TEST(Scenarios, TwoContactsAreApartAsTold) {
  std::set<long> distances;
  for (const Episode &episode : scenario_of("two").episodes) {
    ASSERT_EQ(episode.tracks.size(), 2u);
    const Touch a = episode.tracks[0].at(0.4), b = episode.tracks[1].at(0.4);
    distances.insert(std::lround(std::hypot(a.x_mm - b.x_mm, a.y_mm - b.y_mm) * 1e6));
    EXPECT_LE(std::abs(a.y_mm), 18.0);
    EXPECT_LE(std::abs(b.x_mm), 10.0);
  }
  EXPECT_EQ(distances, (std::set<long>{6000000, 9000000, 12000000, 15000000, 18000000, 24000000, 30000000}));
}

TEST(Scenarios, LiftsTakeAWeightOverWhileTheGripStays) {
  const Scenario scenario = scenario_of("lift", [](ScenarioOptions &o) {
    o.forces = "2..8";
    o.tangential = "0.4";
    o.dead_travel_mm = 1.5;
  });
  EXPECT_TRUE(scenario.pulls);
  std::set<long> times_ms;
  std::set<int> quadrants;
  for (const Episode &episode : scenario.episodes) {
    for (const Phase &one : episode.phases) {
      EXPECT_FALSE(one.slip);
    }
    const auto at = [&](double t_s) { return episode.tracks[0].at(t_s - episode.begin_s); };
    const auto pull_N = [&](double t_s) { return std::hypot(at(t_s).pull_x_N, at(t_s).pull_y_N); };
    const Phase &lift = phase_of(episode, "lift"), &carry = phase_of(episode, "carry"), &lower = phase_of(episode, "lower");
    times_ms.insert(std::lround(1e3 * (lift.end_s - lift.begin_s)));
    EXPECT_NEAR(lower.end_s - lower.begin_s, lift.end_s - lift.begin_s, 1e-9);
    const Touch held = at(lift.begin_s), carried = at(carry.begin_s);
    EXPECT_EQ(carried.force_N, held.force_N);
    EXPECT_NEAR(pull_N(lift.begin_s), 0.0, 1e-9);
    EXPECT_NEAR(pull_N(0.5 * (lift.begin_s + lift.end_s)), 0.2 * held.force_N, 1e-9);
    EXPECT_NEAR(pull_N(carry.begin_s), 0.4 * held.force_N, 1e-9);
    EXPECT_NEAR(pull_N(carry.end_s), 0.4 * held.force_N, 1e-9);
    EXPECT_NEAR(pull_N(lower.end_s), 0.0, 1e-9);
    // At 0.8 of what friction holds a fifth of the force's contact sticks.
    EXPECT_NEAR(carried.stuck_N, 0.2 * held.force_N, 1e-9);
    const double moved = std::hypot(carried.x_mm - held.x_mm, carried.y_mm - held.y_mm);
    EXPECT_NEAR(moved, 1.5 * (1.0 - std::cbrt(0.04)), 1e-9);
    EXPECT_NEAR((carried.x_mm - held.x_mm) * carried.pull_y_N, (carried.y_mm - held.y_mm) * carried.pull_x_N, 1e-9);
    EXPECT_GT((carried.x_mm - held.x_mm) * carried.pull_x_N + (carried.y_mm - held.y_mm) * carried.pull_y_N, 0.0);
    EXPECT_NEAR(at(lower.end_s).x_mm, held.x_mm, 1e-9);
    quadrants.insert((carried.pull_x_N > 0.0) + 2 * (carried.pull_y_N > 0.0));
  }
  EXPECT_EQ(times_ms, (std::set<long>{100, 300, 1000}));
  EXPECT_EQ(quadrants.size(), 4u);
}

TEST(Scenarios, WhatIsPulledIsPressedAsBefore) {
  const Scenario plain = scenario_of("taps");
  const Scenario pulled = scenario_of("taps", [](ScenarioOptions &o) { o.tangential = "0.3"; });
  const Scenario aimed = scenario_of("taps", [](ScenarioOptions &o) { o.tangential = "0.3,-120"; });
  EXPECT_FALSE(plain.pulls);
  ASSERT_EQ(plain.episodes.size(), pulled.episodes.size());
  for (std::size_t i = 0; i < plain.episodes.size(); i++) {
    EXPECT_EQ(plain.episodes[i].begin_s, pulled.episodes[i].begin_s);
    for (double t_s : {0.05, 0.2, 0.45}) {
      const Touch before = plain.episodes[i].tracks[0].at(t_s);
      const Touch now = pulled.episodes[i].tracks[0].at(t_s), there = aimed.episodes[i].tracks[0].at(t_s);
      EXPECT_EQ(now.force_N, before.force_N);
      EXPECT_EQ(now.x_mm, before.x_mm);
      EXPECT_EQ(now.y_mm, before.y_mm);
      EXPECT_EQ(now.stuck_N, 0.0);
      EXPECT_NEAR(std::hypot(now.pull_x_N, now.pull_y_N), 0.3 * now.force_N, 1e-12);
      EXPECT_NEAR(there.pull_x_N, -0.15 * now.force_N, 1e-12);
      EXPECT_NEAR(there.pull_y_N, -0.3 * std::sqrt(0.75) * now.force_N, 1e-12);
    }
  }
}

TEST(Scenarios, LongerOnesBeginAlikeAndEffectsDoNotMoveContacts) {
  const Scenario brief = scenario_of("taps"), longer = scenario_of("taps", [](ScenarioOptions &o) {
                                                o.seconds = 300;
                                                o.effects = parse_effects("all");
                                                o.pad_seed = 77;
                                              });
  ASSERT_GT(longer.episodes.size(), brief.episodes.size());
  for (std::size_t i = 0; i < brief.episodes.size(); i++) {
    EXPECT_EQ(brief.episodes[i].begin_s, longer.episodes[i].begin_s);
    EXPECT_EQ(brief.episodes[i].tracks[0].at(0.2), longer.episodes[i].tracks[0].at(0.2));
  }
  const Scenario other = scenario_of("taps", [](ScenarioOptions &o) { o.seed = 2; });
  EXPECT_FALSE(brief.episodes[0].tracks[0].at(0.2) == other.episodes[0].tracks[0].at(0.2));
}
