// The world of `simulate --lift`: a grasp of a kind happens in it as the kind says.
#include "simulation/cell/fingertip_cell_world.hpp"

#include <gtest/gtest.h>

namespace {

using namespace fingertip;
using namespace fingertip::cell;

class WorldOfKind : public ::testing::Test {
protected:
  Face face{"sphere18", 12.0, FINGERTIP_TEST_TABLES};

  World::Options of(const KindOfGrasp &grasp) {
    World::Options options;
    options.grasp.down_rad = 0.5 * M_PI;
    World::be_of_kind(options, grasp);
    return options;
  }
};

TEST_F(WorldOfKind, needs_what_the_kind_needs) {
  for (const Kind kind : KINDS) {
    for (std::uint64_t n = 0; n < 20; n++) {
      const KindOfGrasp grasp = draw_grasp(kind, 77, n);
      GripperMotion motion(gripper_mechanics("2f85"));
      const World world(of(grasp), face, motion);
      for (double t_s = 0.0; t_s < grasp.steady_s; t_s += 0.013) {
        EXPECT_NEAR(world.need_N(t_s), grasp.least_N(t_s), 1e-6 + 1e-6 * grasp.least_N(t_s))
            << name_of(kind) << " " << n << " " << t_s;
      }
    }
  }
}

TEST_F(WorldOfKind, has_the_kinds_object) {
  const KindOfGrasp grasp = draw_grasp(Kind::fragile, 3, 1);
  const Object object = of(grasp).object;
  EXPECT_EQ(object.mass_kg, grasp.mass_kg);
  EXPECT_EQ(object.crushes_N, grasp.crushes_N);
  EXPECT_NEAR(object.friction * (1.0 + object.uneven_friction), grasp.pads[0].friction, 1e-12);
  EXPECT_NEAR(object.friction * (1.0 - object.uneven_friction), grasp.pads[1].friction, 1e-12);
}

} // namespace
