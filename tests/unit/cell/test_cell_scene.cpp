#include "simulation/cell/scene.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <set>

namespace {

using namespace fingertip::cell;

TEST(Scene, TheSameSeedDrawsTheSame) {
  const std::vector<std::string> faces = faces_of("round");
  for (const std::uint64_t n : {0U, 7U, 91U}) {
    const Scene one = draw_scene(faces, 5, n), again = draw_scene(faces, 5, n);
    EXPECT_EQ(one.object.mass_kg, again.object.mass_kg);
    EXPECT_EQ(one.ends_s, again.ends_s);
    EXPECT_NE(one.object.mass_kg, draw_scene(faces, 6, n).object.mass_kg);
    EXPECT_NE(one.object.mass_kg, draw_scene(faces, 5, n + 1).object.mass_kg);
  }
}

TEST(Scene, DrawsWhatItSays) {
  const std::vector<std::string> faces = faces_of("round");
  std::set<std::string> drawn;
  std::set<int> kinds;
  for (std::uint64_t n = 0; n < 500; n++) {
    const Scene scene = draw_scene(faces, 9, n);
    drawn.insert(scene.face);
    EXPECT_GE(scene.object.mass_kg, 0.1);
    EXPECT_LE(scene.object.mass_kg, 1.0);
    EXPECT_GE(scene.object.friction, 0.25);
    EXPECT_LE(scene.object.friction, 1.0);
    EXPECT_LE(scene.disturbances.size(), 2U);
    double worst_N = 0.0;
    for (double t_s = 0.0; t_s < scene.ends_s; t_s += 0.005) {
      worst_N = std::max(worst_N, scene.least_N(t_s));
    }
    EXPECT_LE(worst_N, 1.01 * FORCE_MOST_N);
    for (const Disturbance &one : scene.disturbances) {
      kinds.insert(static_cast<int>(one.kind));
      EXPECT_GT(one.begin_s, scene.lift_s);
      EXPECT_LT(one.begin_s + one.seconds, scene.ends_s);
    }
  }
  EXPECT_EQ(drawn.size(), faces.size());
  EXPECT_EQ(kinds.size(), 4U);
}

TEST(Scene, DisturbancesAddUp) {
  Scene scene = draw_scene({"sphere15"}, 1, 1);
  scene.lift_s = 0.4;
  scene.lift_mm = 8.0;
  scene.object.mass_kg = 0.5;
  scene.object.friction = 0.5;
  scene.grasp.down_rad = M_PI / 2.0;
  using Kind = Disturbance::Kind;
  scene.disturbances = {{Kind::pour, 1.0, 1.0, 0.8, 0.0},
                        {Kind::slick, 3.0, 0.5, 0.25, 0.0},
                        {Kind::jerk, 4.0, 0.4, 6.0, 0.0},
                        {Kind::knock, 5.0, 0.02, 0.1, 0.0}};
  EXPECT_NEAR(scene.least_N(0.9), 0.5 * 9.81, 1e-9);
  EXPECT_NEAR(scene.least_N(2.5), 0.9 * 9.81, 1e-9);
  EXPECT_NEAR(scene.least_N(3.8), 0.9 * 9.81 / 0.75, 1e-9);
  // Up first: a quarter of the way heavier by 6 m/s2, then lighter.
  EXPECT_NEAR(scene.least_N(4.1), 0.9 * (9.81 + 6.0) / 0.75, 1e-6);
  EXPECT_NEAR(scene.least_N(4.3), 0.9 * (9.81 - 6.0) / 0.75, 1e-6);
  EXPECT_NEAR(scene.drive(0.4).lifted_mm, 8.0, 1e-9);
  EXPECT_TRUE(scene.drive(0.39).table);
  EXPECT_FALSE(scene.drive(0.41).table);
  // What the knock gives, and that the hand's way is what its acceleration makes.
  double impulse_Ns = 0.0, speed_mm_s = 0.0, way_mm = 0.0;
  constexpr double STEP_s = 1e-5;
  for (double t_s = 0.5 * STEP_s; t_s < 6.0; t_s += STEP_s) {
    const Drive now = scene.drive(t_s);
    impulse_Ns -= now.knock_N.y * STEP_s; // upwards is -y
    if (t_s < 0.4) {
      speed_mm_s -= 1e3 * now.hand_m_s2.y * STEP_s;
      way_mm += speed_mm_s * STEP_s;
    }
  }
  EXPECT_NEAR(impulse_Ns, 0.5 * 0.1, 1e-4);
  EXPECT_NEAR(way_mm, 8.0, 0.01);
}

TEST(Scene, KnowsNoOtherObjects) { EXPECT_THROW(faces_of("bananas"), std::runtime_error); }

} // namespace
