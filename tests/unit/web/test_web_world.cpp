// The page's simulated pad: what its file of objects keeps of the twin's tables, and what hand, weight and load do.
#include "simulation/twin/held_object.hpp"
#include "simulation/twin/traction_table.hpp"
#include "web/tables/objects_of_twin.hpp"
#include "web/wasm/world.hpp"

extern "C" {
#include "config/geometry.h"
}

#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <stdexcept>

namespace fingertip::web {

constexpr double AMBIENT_Pa = 101325.0;
constexpr unsigned MIDDLE = 7; // the sensor at the origin
constexpr double FRICTION = 0.5;

static const std::vector<std::uint8_t> &file() {
  static const std::vector<std::uint8_t> bytes = written(objects_of_twin(FINGERTIP_TEST_TABLES));
  return bytes;
}

static std::vector<Object> objects() { return read_objects(file().data(), file().size()).objects; }

class WorldTest : public ::testing::Test {
protected:
  World world{objects(), {}, 1};
  std::uint64_t t_us = 0;

  double run(double seconds) {
    t_us += static_cast<std::uint64_t>(1e6 * seconds);
    return world.pressure_Pa(MIDDLE, t_us) - AMBIENT_Pa;
  }
  double pull_N() const { return std::hypot(world.truth().qx_N, world.truth().qy_N); }
};

TEST(Objects, AreTheTwinsTables) {
  const twin::Layer layer = twin::silicone(PAD_mm);
  const std::vector<Object> read = objects();
  ASSERT_EQ(read.size(), object_names().size());
  for (std::size_t i = 0; i < read.size(); i++) {
    SCOPED_TRACE(read[i].name);
    EXPECT_EQ(read[i].name, object_names()[i]);
    const auto table = twin::ContactTable::load_or_build(twin::indenter(read[i].name), layer, FINGERTIP_TEST_TABLES);
    const twin::TractionTable traction(table, layer);
    for (const double force_N : {0.5, 3.0, 20.0}) {
      const double peak_Pa = table.base_pressure_Pa(force_N, 0.0, 0.0);
      EXPECT_NEAR(twin::ForcePlanes::between_forces(read[i].radius_mm, force_N), table.contact_radius_mm(force_N), 1e-4);
      double worst_Pa = 0.0, worst_pulled_Pa = 0.0;
      for (double x_mm = -30.0; x_mm <= 30.0; x_mm += 0.7) {
        for (double y_mm = -40.0; y_mm <= 40.0; y_mm += 0.7) {
          const twin::TractionLoad load{force_N, 0.4 * force_N, 0.2 * force_N, -0.15 * force_N};
          worst_Pa = std::max(worst_Pa, std::abs(read[i].normal.at(force_N, x_mm, y_mm) - table.base_pressure_Pa(force_N, x_mm, y_mm)));
          worst_pulled_Pa =
              std::max(worst_pulled_Pa, std::abs(twin::traction_pressure_Pa(read[i].along_x, read[i].along_y, load, x_mm, y_mm) -
                                                 traction.base_pressure_Pa(load, x_mm, y_mm)));
        }
      }
      EXPECT_LT(worst_Pa, 0.004 * peak_Pa) << force_N;
      EXPECT_LT(worst_pulled_Pa, 0.004 * peak_Pa) << force_N;
    }
  }
}

TEST(Objects, CutAndForeignFilesAreRefused) {
  std::vector<std::uint8_t> cut = file();
  const ObjectsFile whole = read_objects(cut.data(), cut.size());
  EXPECT_FALSE(whole.pad_command.empty());
  EXPECT_THROW(read_objects(cut.data(), cut.size() - whole.pad_command.size() - 1), std::runtime_error);
  EXPECT_THROW(read_objects(cut.data(), 3), std::runtime_error);
  cut[0] ^= 1;
  EXPECT_THROW(read_objects(cut.data(), cut.size()), std::runtime_error);
}

TEST_F(WorldTest, APressIsTheTwins) {
  world.choose(0);
  world.press(2.0, -3.0, 6.0);
  const double pressure_Pa = run(1.0);
  EXPECT_TRUE(world.truth().contact);
  EXPECT_NEAR(world.truth().force_N, 6.0, 1e-6);
  EXPECT_EQ(world.truth().x_mm, 2.0);
  EXPECT_EQ(world.truth().y_mm, -3.0);
  EXPECT_EQ(pull_N(), 0.0);
  const auto table = twin::ContactTable::load_or_build(twin::indenter(object_names()[0]), twin::silicone(PAD_mm), FINGERTIP_TEST_TABLES);
  const double x_mm = static_cast<double>(geometry.x_mm[MIDDLE]) - 2.0;
  const double y_mm = static_cast<double>(geometry.y_mm[MIDDLE]) + 3.0;
  EXPECT_NEAR(pressure_Pa, table.base_pressure_Pa(6.0, x_mm, y_mm), 0.004 * table.base_pressure_Pa(6.0, 0.0, 0.0));
  world.lift();
  EXPECT_EQ(run(0.01), 0.0);
}

TEST_F(WorldTest, WhatIsDraggedSticksGivesThenSlips) {
  world.press(0.0, 0.0, 6.0);
  run(0.5);
  double before_N = 0.0;
  bool has_slipped = false;
  double most_N = 0.0, begins_mm = 0.0;
  for (double y_mm = 0.0; y_mm < 4.0; y_mm += 0.02) {
    world.press(0.0, y_mm, 6.0);
    run(0.01);
    if (!world.truth().slips && !has_slipped) {
      EXPECT_GE(world.truth().qy_N, before_N - 1e-9); // it only grows
      before_N = world.truth().qy_N;
    } else if (!has_slipped) {
      has_slipped = true;
      begins_mm = world.truth().y_mm;
    }
    most_N = std::max(most_N, pull_N());
    EXPECT_LE(pull_N(), FRICTION * world.truth().force_N + 1e-9);
  }
  EXPECT_TRUE(has_slipped);
  EXPECT_GT(begins_mm, 0.3);
  EXPECT_LT(begins_mm, 3.0);
  EXPECT_GT(most_N, 0.9 * FRICTION * 6.0);
  EXPECT_TRUE(world.truth().slips);
  // At a steady speed the law of friction (twin/held_object.hpp) is in balance.
  const double speed_mm_s = 2.0, rested = 1.0 / (1.0 + twin::HeldObject::HEALS_s * speed_mm_s / twin::HeldObject::SETTLES_mm);
  EXPECT_NEAR(world.truth().qy_N, (World::KINETIC_SHARE + (1.0 - World::KINETIC_SHARE) * rested) * FRICTION * 6.0, 0.01 * FRICTION * 6.0);
}

TEST_F(WorldTest, MoreFrictionHolds) {
  world.set_friction(1.0);
  world.hold(0.0, 0.0, 6.0, 4.0, 2.0);
  run(2.0);
  EXPECT_TRUE(world.truth().contact);
  EXPECT_FALSE(world.truth().slips);
  EXPECT_NEAR(world.truth().qx_N, 4.0 * std::cos(2.0), 0.02);
  EXPECT_NEAR(world.truth().qy_N, 4.0 * std::sin(2.0), 0.02);
  world.set_friction(0.5); // 3 N at most
  run(0.05);
  EXPECT_TRUE(world.truth().slips);
  run(1.0);
  EXPECT_FALSE(world.truth().contact); // it slid off
  world.hold(0.0, 0.0, 6.0, 1.0, 0.0);
  run(0.1);
  EXPECT_FALSE(world.truth().contact); // and stays lost
  world.lift();
  world.hold(0.0, 0.0, 6.0, 1.0, 0.0);
  run(0.5);
  EXPECT_TRUE(world.truth().contact);
}

TEST_F(WorldTest, AWeightFallsBouncesAndLies) {
  world.drop(1.0, 2.0, 0.3);
  double most_N = 0.0;
  bool was_touched = false, bounced = false;
  for (int i = 0; i < 300; i++) {
    run(0.001);
    most_N = std::max(most_N, world.truth().force_N);
    bounced = bounced || (was_touched && world.truth().force_N < 0.5 * 0.3 * 9.80665);
    was_touched = was_touched || world.truth().contact;
  }
  // Free fall takes sqrt(2 z / g), 25 ms.
  EXPECT_GT(most_N, 2.0 * 0.3 * 9.80665);
  EXPECT_TRUE(bounced);
  run(3.0);
  EXPECT_NEAR(world.truth().force_N, 0.3 * 9.80665, 0.003);
  EXPECT_EQ(pull_N(), 0.0);
}

TEST_F(WorldTest, BesideThePadNothingIsTouched) {
  world.press(World::half_width_mm() + 0.1, 0.0, 6.0);
  EXPECT_EQ(run(0.5), 0.0);
  EXPECT_FALSE(world.truth().contact);
  world.press(World::half_width_mm() - 0.1, 0.0, 6.0);
  run(0.5);
  EXPECT_TRUE(world.truth().contact);
}

TEST_F(WorldTest, WhatIsNoNumberOrTooMuchDoesNoHarm) {
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  world.press(nan, 0.0, 6.0);
  world.press(0.0, inf, 6.0);
  world.drop(0.0, 0.0, nan);
  world.hold(0.0, 0.0, 1.0, nan, 0.0);
  world.set_friction(nan);
  world.choose(1000);
  EXPECT_EQ(run(0.1), 0.0);
  world.press(0.0, 0.0, 1e9);
  EXPECT_TRUE(std::isfinite(run(1.0)));
  EXPECT_LE(world.truth().force_N, World::FORCE_MAX_N);
  world.press(0.0, 0.0, -5.0);
  EXPECT_NEAR(run(1.0), 0.0, 1e-3);
}

TEST_F(WorldTest, ReadingsAreLinearBetweenSteps) {
  world.press(0.0, 0.0, 6.0);
  const double begin_Pa = world.pressure_Pa(MIDDLE, 20000);
  const double quarter_Pa = world.pressure_Pa(MIDDLE, 20250);
  const double end_Pa = world.pressure_Pa(MIDDLE, 21000);
  EXPECT_GT(end_Pa, begin_Pa + 100.0);
  EXPECT_NEAR(quarter_Pa, begin_Pa + 0.25 * (end_Pa - begin_Pa), 1e-6);
}

TEST_F(WorldTest, TheSameCallsGiveTheSameBits) {
  World other(objects(), {}, 1);
  for (World *one : {&world, &other}) {
    one->choose(2);
    one->press(1.0, 1.0, 5.0);
    one->pressure_Pa(0, 300000);
    one->press(4.0, -2.0, 7.0);
  }
  for (unsigned k = 0; k < geometry.sensor_count; k++) {
    EXPECT_EQ(world.pressure_Pa(k, 700500), other.pressure_Pa(k, 700500));
  }
}

TEST(World, PadsHaveTheTwinsErrors) {
  World plain(objects(), {}, 3), cast(objects(), {{"gain", 10.0}}, 3);
  for (World *one : {&plain, &cast}) {
    one->press(0.0, 0.0, 6.0);
  }
  const twin::Pad pad({{"gain", 10.0}}, geometry.sensor_count, PAD_mm, AMBIENT_Pa, 3);
  for (unsigned k = 0; k < geometry.sensor_count; k++) {
    const double felt_Pa = plain.pressure_Pa(k, 1000000) - AMBIENT_Pa;
    EXPECT_NEAR(cast.pressure_Pa(k, 1000000) - AMBIENT_Pa, felt_Pa * (1.0 + pad.gain_errors()[k]), 1e-6 * std::abs(felt_Pa) + 1e-6);
  }
}

} // namespace fingertip::web
