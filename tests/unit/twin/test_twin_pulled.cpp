#include "scenes.hpp"

#include <gtest/gtest.h>
#include <set>

using namespace fingertip::twin;

constexpr double MS_s = 1e-3, GRAVITY_m_s2 = 9.81;

static double pull_N(const Touch &touch) { return std::hypot(touch.pull_x_N, touch.pull_y_N); }

static double way_mm(const Touch &from, const Touch &to) { return std::hypot(to.x_mm - from.x_mm, to.y_mm - from.y_mm); }

TEST(Drag, HoldsAKnownLoadThenSlidesAtFrictionBothWaysAlongBothAxes) {
  const Scenario scenario = scenario_of("drag", [](ScenarioOptions &o) {
    o.indenter = "sphere15";
    o.friction = "0.4..0.6";
    o.tangential = "0.25";
    o.speeds_mm_s = {5, 20};
  });
  EXPECT_TRUE(scenario.pulls);
  std::set<std::pair<long, long>> directions;
  std::set<double> frictions;
  for (const Episode &episode : scenario.episodes) {
    const auto at = [&](double t_s) { return episode.tracks[0].at(t_s - episode.begin_s); };
    const Phase &load = phase_of(episode, "load"), &carry = phase_of(episode, "carry"), &slip = phase_of(episode, "slip"),
                &after = phase_of(episode, "after");
    EXPECT_GE(carry.end_s - carry.begin_s, 3.0 - 1e-9);
    const double force_N = at(load.begin_s).force_N, slides_N = episode.friction * force_N;
    EXPECT_EQ(force_N, 3.0);
    EXPECT_NEAR(episode.mass_kg * GRAVITY_m_s2, force_N, 1e-9);
    frictions.insert(episode.friction);
    const Touch before = at(load.begin_s), known = at(carry.end_s), slides = at(slip.begin_s);
    EXPECT_NEAR(pull_N(before), 0.0, 1e-9);
    for (double t_s = carry.begin_s; t_s <= carry.end_s; t_s += 0.1) {
      EXPECT_NEAR(pull_N(at(t_s)), 0.75, 1e-9);
      EXPECT_NEAR(way_mm(known, at(t_s)), 0.0, 1e-9);
    }
    const double held = 1.0 - 0.75 / slides_N;
    EXPECT_NEAR(way_mm(before, known), 1.0 - std::cbrt(held * held), 1e-9);
    for (double t_s = slip.begin_s; t_s <= slip.end_s; t_s += 7 * MS_s) {
      EXPECT_NEAR(pull_N(at(t_s)), slides_N, 1e-9);
      EXPECT_NEAR(at(t_s).stuck_N, 0.0, 1e-9);
    }
    EXPECT_NEAR(way_mm(before, slides), 1.0, 1e-4);
    const double middle_s = 0.5 * (slip.begin_s + slip.end_s);
    EXPECT_NEAR(way_mm(at(middle_s), at(middle_s + 0.05)) / 0.05, episode.speed_mm_s, 0.1);
    for (double t_s = episode.begin_s; t_s < episode.end_s; t_s += MS_s) {
      EXPECT_LE(pull_N(at(t_s)), episode.friction * at(t_s).force_N + 1e-9);
      EXPECT_LE(std::abs(at(t_s).x_mm), 6.75 + 1e-9);
      EXPECT_LE(std::abs(at(t_s).y_mm), 15.75 + 1e-9);
    }
    EXPECT_NEAR(pull_N(at(after.begin_s)), 0.0, 1e-9);
    directions.insert({std::lround(slides.pull_x_N / slides_N), std::lround(slides.pull_y_N / slides_N)});
    EXPECT_NEAR((at(slip.end_s).x_mm - slides.x_mm) / 8.0, slides.pull_x_N / slides_N, 1e-6);
    EXPECT_NEAR((at(slip.end_s).y_mm - slides.y_mm) / 8.0, slides.pull_y_N / slides_N, 1e-6);
  }
  EXPECT_EQ(directions, (std::set<std::pair<long, long>>{{1, 0}, {0, 1}, {-1, 0}, {0, -1}}));
  EXPECT_GE(frictions.size(), 4u);
  EXPECT_GE(*frictions.begin(), 0.4);
  EXPECT_LE(*frictions.rbegin(), 0.6);
}

static const Scenario &slides() {
  static const Scenario scenario = scenario_of("slide", [](ScenarioOptions &o) { o.seconds = 600; });
  return scenario;
}

TEST(Slide, SlipsWhereTheLoadReachesFrictionAndNowhereElse) {
  EXPECT_GT(slides().episodes.size(), 100u);
  int slid = 0;
  for (const Episode &episode : slides().episodes) {
    const Track &track = episode.tracks[0];
    bool began = false;
    for (const Phase &phase : episode.phases) {
      EXPECT_EQ(phase.slip, phase.name == "slip");
      // To the millisecond in which the phases are given, and 1e-5 to which tracks are.
      for (double t_s = phase.begin_s; t_s < phase.end_s; t_s += MS_s) {
        const double local_s = t_s - episode.begin_s;
        const Touch touch = track.at(local_s);
        const double holds_N = episode.friction * touch.force_N;
        EXPECT_LE(pull_N(touch), holds_N + 1e-4);
        if (phase.slip && t_s > phase.begin_s + 1.5 * MS_s && t_s < phase.end_s - 1.5 * MS_s) {
          EXPECT_NEAR(pull_N(touch), track.tangential.friction.at(local_s) * touch.force_N, 2e-4);
          EXPECT_GE(pull_N(touch), 0.8 * holds_N - 2e-4);
          EXPECT_NEAR(touch.stuck_N, 0.0, 5e-4);
        }
        if (!began && !phase.slip && touch.force_N > 0.1) {
          EXPECT_LT(pull_N(touch), holds_N + 1e-4) << episode.press;
        }
      }
      if (phase.slip && !began) {
        began = true;
        // In the millisecond that ends in slip, a fast hand's load rises by a few percent.
        const double local_s = phase.begin_s - episode.begin_s;
        const double most = std::max(pull_N(track.at(local_s)) / track.at(local_s).force_N,
                                     pull_N(track.at(local_s + MS_s)) / track.at(local_s + MS_s).force_N);
        EXPECT_GE(most, 0.97 * episode.friction) << episode.press;
      }
    }
    EXPECT_EQ(began, episode.press != "carry");
    EXPECT_EQ(episode.speed_mm_s > 0.0, began);
    slid += began;
  }
  EXPECT_GT(slid, 75);
}

TEST(Slide, MovesAsMassAndForcesSay) {
  int compared = 0;
  for (const Episode &episode : slides().episodes) {
    if (episode.press != "loosen") {
      continue;
    }
    // All of the weight is carried when the grip gives way; the finger has half of it.
    const double mass_kg = 0.5 * episode.mass_kg;
    const auto at = [&](double t_s) { return episode.tracks[0].at(t_s - episode.begin_s); };
    const Phase &slip = phase_of(episode, "slip");
    constexpr double SPAN_s = 0.008;
    for (double t_s = slip.begin_s + 0.01; t_s < slip.end_s - 0.012; t_s += 0.004) {
      const Track &track = episode.tracks[0];
      const auto way = [&](double at_s) { return track.pusher_mm.at(at_s - episode.begin_s); };
      const double found_mm_s2 = (way(t_s + SPAN_s) - 2.0 * way(t_s) + way(t_s - SPAN_s)) / (SPAN_s * SPAN_s);
      // The mean pull with the weights of that difference.
      double mean_N = 0.0;
      for (int i = -8; i <= 8; i++) {
        mean_N += pull_N(at(t_s + 1e-3 * i)) * (8 - std::abs(i)) / 64.0;
      }
      const double expected_mm_s2 = 1e3 * (mass_kg * GRAVITY_m_s2 - mean_N) / mass_kg;
      EXPECT_NEAR(found_mm_s2, expected_mm_s2, 12.0 + 0.01 * std::abs(expected_mm_s2));
      compared++;
    }
  }
  EXPECT_GT(compared, 100);
}

TEST(Slide, IsCaughtAndRestsOnThePad) {
  for (const Episode &episode : slides().episodes) {
    const Track &track = episode.tracks[0];
    const double end_s = phase_of(episode, "release").begin_s - episode.begin_s;
    EXPECT_NEAR(track.pusher_mm.at(end_s), track.pusher_mm.at(end_s - 0.05), 0.01) << episode.press;
    EXPECT_NEAR(pull_N(track.at(end_s)), 0.0, 0.01);
    const double gripped_N = track.at(0.3).force_N, held_N = track.at(end_s).force_N;
    if (episode.press == "overload" || episode.press == "loosen") {
      const Phase &slip = phase_of(episode, "slip");
      EXPECT_GT(held_N, 1.5 * track.at(slip.begin_s - episode.begin_s).force_N);
      EXPECT_LT(slip.end_s - slip.begin_s, 0.3);
    } else {
      EXPECT_EQ(held_N, gripped_N);
    }
    for (double t_s = 0.0; t_s < episode.end_s - episode.begin_s; t_s += 5 * MS_s) {
      EXPECT_LE(std::abs(track.at(t_s).x_mm), 6.75 + 0.5);
      EXPECT_LE(std::abs(track.at(t_s).y_mm), 15.75 + 0.5);
    }
  }
}

TEST(Slide, DiffersFromActToActFromCreepingToFalling) {
  struct Range {
    double low = 1e9, high = 0.0;
    void add(double value) {
      low = std::min(low, value);
      high = std::max(high, value);
    }
    void is_about(double from, double least, double most, double to) const {
      EXPECT_TRUE(low >= from && low <= least && high >= most && high <= to) << low << " to " << high;
    }
  } speed_mm_s, mass_kg, friction;
  std::set<std::string> presses;
  std::array<int, 4> quadrants{};
  for (const Episode &episode : slides().episodes) {
    presses.insert(episode.press);
    if (episode.press != "carry") {
      speed_mm_s.add(episode.speed_mm_s);
    }
    mass_kg.add(episode.mass_kg);
    friction.add(episode.friction);
    const Track &track = episode.tracks[0];
    quadrants[std::size_t((track.along_x > 0.0) + 2 * (track.along_y > 0.0))]++;
  }
  EXPECT_EQ(presses, (std::set<std::string>{"pull", "overload", "loosen", "carry"}));
  speed_mm_s.is_about(0.0, 4.0, 180.0, 1e9);
  mass_kg.is_about(0.1, 0.12, 0.48, 0.5);
  friction.is_about(0.3, 0.32, 0.78, 0.8);
  EXPECT_GT(*std::min_element(quadrants.begin(), quadrants.end()), 10);
}

TEST(Slide, SticksAndSlipsWhereKineticFrictionIsLow) {
  const Scenario scenario = scenario_of("slide", [](ScenarioOptions &o) {
    o.kinetic_share = 0.5;
    o.speeds_mm_s = {5};
    o.seconds = 60;
  });
  int most = 0;
  for (const Episode &episode : scenario.episodes) {
    most = std::max(most,
                    static_cast<int>(std::count_if(episode.phases.begin(), episode.phases.end(), [](const Phase &p) { return p.slip; })));
  }
  EXPECT_GE(most, 4);
}

TEST(Screw, PressesTheBaseAsIfNothingTurnedUnlessTheContactIsNotRound) {
  for (const char *name : {"sphere6", "cube6"}) {
    const bool round = std::string(name) == "sphere6";
    const Scenario scenario = scenario_of("screw", [&](ScenarioOptions &o) { o.indenter = name; });
    EXPECT_FALSE(scenario.pulls);
    double worst = 0.0;
    for (const Episode &episode : scenario.episodes) {
      const auto at = [&](double t_s) { return episode.tracks[0].at(t_s - episode.begin_s); };
      const double begin_s = phase_of(episode, "wind").begin_s, end_s = phase_of(episode, "after").end_s;
      const auto before_Pa = base_Pa(at(begin_s), table_of(name), &traction_of(name));
      const double peak_Pa = *std::max_element(before_Pa.begin(), before_Pa.end());
      for (double t_s = begin_s; t_s < end_s; t_s += 0.02) {
        const Touch touch = at(t_s);
        EXPECT_EQ(pull_N(touch), 0.0);
        EXPECT_EQ(touch.x_mm, at(begin_s).x_mm);
        EXPECT_EQ(touch.force_N, 6.0);
        const auto now_Pa = base_Pa(touch, table_of(name), &traction_of(name));
        for (std::size_t k = 0; k < now_Pa.size(); k++) {
          worst = std::max(worst, std::abs(now_Pa[k] - before_Pa[k]) / peak_Pa);
        }
      }
    }
    // What is left of a sphere is the table's, which is a square's.
    EXPECT_EQ(worst < 3e-4, round) << worst;
  }
}

TEST(Screw, WindsUpUntilFrictionGivesWayToBothSides) {
  const Scenario scenario = scenario_of("screw", [](ScenarioOptions &o) { o.friction = "0.4"; });
  const Layer layer = silicone(LAYER_mm);
  const double shear_MPa = 1e-6 * layer.youngs_modulus_Pa / (2.0 * (1.0 + layer.poisson));
  const double radius_mm = table_of("sphere6").contact_radius_mm(6.0);
  const double limit_rad = wind_up_rad(1.0, 0.4 * 6.0, shear_MPa, radius_mm);
  std::set<bool> sides;
  for (const Episode &episode : scenario.episodes) {
    std::vector<std::string> names;
    std::vector<double> turns;
    for (const Phase &one : episode.phases) {
      names.push_back(one.name);
      const auto angle = [&](double t_s) { return episode.tracks[0].at(t_s - episode.begin_s).angle_rad; };
      turns.push_back(angle(one.end_s) - angle(one.begin_s));
      EXPECT_FALSE(one.slip);
    }
    ASSERT_EQ(names, (std::vector<std::string>{"touch", "hold", "wind", "spin", "wind", "spin", "unwind", "after", "release"}));
    const double side = turns[2] > 0.0 ? 1.0 : -1.0;
    sides.insert(turns[2] > 0.0);
    EXPECT_NEAR(turns[2], side * limit_rad, 1e-4);
    EXPECT_NEAR(turns[4], -2.0 * side * limit_rad, 1e-4);
    EXPECT_GE(side * turns[3], M_PI / 6.0 - 1e-9);
    EXPECT_LE(side * turns[5], -M_PI / 6.0 + 1e-9);
    EXPECT_NEAR(turns[6], side * 2.0 * wind_up_rad(0.5, 2.4, shear_MPa, radius_mm), 1e-4);
  }
  EXPECT_EQ(sides.size(), 2u);
}

TEST(Screw, GivesWayToALoadWhileItSpins) {
  const Scenario scenario = scenario_of("screw", [](ScenarioOptions &o) { o.tangential = "0.2"; });
  EXPECT_TRUE(scenario.pulls);
  const double radius_mm = table_of("sphere6").contact_radius_mm(6.0);
  for (const Episode &episode : scenario.episodes) {
    const auto at = [&](double t_s) { return episode.tracks[0].at(t_s - episode.begin_s); };
    for (const Phase &one : episode.phases) {
      const Touch from = at(one.begin_s), to = at(one.end_s);
      if (one.name == "wind" || one.name == "unwind" || one.name == "spin") {
        EXPECT_NEAR(pull_N(from), 1.2, 1e-9);
        const double turned = one.name == "spin" ? std::abs(to.angle_rad - from.angle_rad) : 0.0;
        // Half of (3 pi / 8) mu F is what holds along a way that is a unit of the turn.
        EXPECT_NEAR(way_mm(from, to), turned * radius_mm * 0.4 * 8.0 / (3.0 * M_PI), 1e-3);
      }
    }
  }
}

TEST(Lift, ThreeTimesTwoHundredWithShareForceAndPlaceOfTheirOwn) {
  const Scenario scenario = scenario_of("lift", [](ScenarioOptions &o) {
    o.seconds = 3000;
    o.forces = "1..10";
    o.tangential = "0.1..0.4";
  });
  EXPECT_EQ(scenario.name, "lift-sphere6-h12-gain0-tangential0.1..0.4");
  std::array<int, 3> counts{}; // 0.1, 0.3, 1 s
  std::array<int, 6> shares{}; // each 0.05
  for (const Episode &episode : scenario.episodes) {
    const Phase &lift = phase_of(episode, "lift"), &carry = phase_of(episode, "carry");
    const long ms = std::lround(1e3 * (lift.end_s - lift.begin_s));
    counts[ms == 100 ? 0 : ms == 300 ? 1 : 2]++;
    const Touch carried = episode.tracks[0].at(carry.begin_s - episode.begin_s);
    const double share = pull_N(carried) / carried.force_N;
    EXPECT_GE(share, 0.1);
    EXPECT_LE(share, 0.4);
    shares[std::min<std::size_t>(5, std::size_t((share - 0.1) / 0.05))]++;
    EXPECT_GE(carried.force_N, 1.0);
    EXPECT_LE(carried.force_N, 10.0);
  }
  for (int count : counts) {
    EXPECT_GE(count, 200);
  }
  for (int count : shares) {
    EXPECT_GT(count, 60);
  }
}
