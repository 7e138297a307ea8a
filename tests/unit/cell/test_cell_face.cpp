#include "libfingertip/random.hpp"
#include "simulation/cell/face.hpp"
#include "simulation/cell/plate.hpp"
#include "simulation/twin/traction_table.hpp"

extern "C" {
#include "config/geometry.h"
}

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

namespace {

using namespace fingertip;
using namespace fingertip::cell;

TEST(Face, FeelsWhatTheTwinDoes) {
  for (const char *name : {"sphere6", "sphere15", "cube6"}) {
    const twin::Layer layer = twin::silicone(12.0);
    const auto table = twin::ContactTable::load_or_build(twin::indenter(name), layer, FINGERTIP_TEST_TABLES);
    const twin::TractionTable traction(table, layer);
    const Face face(name, 12.0, FINGERTIP_TEST_TABLES);
    Random random(3, 1, 1);
    for (int i = 0; i < 300; i++) {
      twin::Touch touch;
      touch.force_N = random.log_uniform(0.5, 40.0);
      touch.stuck_N = touch.force_N * random.uniform(0.0, 0.99);
      touch.x_mm = random.uniform(-12.0, 12.0);
      touch.y_mm = random.uniform(-21.0, 21.0);
      touch.angle_rad = random.uniform(-M_PI, M_PI);
      const double pull_N = 0.5 * (touch.force_N - touch.stuck_N);
      const double direction = random.uniform(-M_PI, M_PI);
      touch.pull_x_N = pull_N * std::cos(direction);
      touch.pull_y_N = pull_N * std::sin(direction);
      const Pressures sensed_Pa = face.base_Pa(touch);
      const double peak_Pa = table.base_pressure_Pa(touch.force_N, 0.0, 0.0);
      const double c = std::cos(touch.angle_rad), s = std::sin(touch.angle_rad);
      const twin::TractionTable::Load load{touch.force_N, touch.stuck_N, c * touch.pull_x_N + s * touch.pull_y_N,
                                           c * touch.pull_y_N - s * touch.pull_x_N};
      for (std::size_t k = 0; k < SENSORS; k++) {
        const double dx = static_cast<double>(geometry.x_mm[k]) - touch.x_mm;
        const double dy = static_cast<double>(geometry.y_mm[k]) - touch.y_mm;
        const double along_x = c * dx + s * dy, along_y = c * dy - s * dx;
        const double expected_Pa =
            table.base_pressure_Pa(touch.force_N, along_x, along_y) + traction.base_pressure_Pa(load, along_x, along_y);
        ASSERT_NEAR(sensed_Pa[k], expected_Pa, 1e-9 * peak_Pa) << name << " " << i;
      }
    }
    EXPECT_EQ(face.base_Pa({}), Pressures{});
  }
}

TEST(Face, KnowsNoOther) { EXPECT_THROW(Face("banana", 12.0, FINGERTIP_TEST_TABLES), std::runtime_error); }

TEST(Plate, CarriesForceAndMoment) {
  constexpr double HALF_X_mm = 18.0, HALF_Y_mm = 27.0, STEP_mm = 0.25;
  const twin::Layer layer = twin::silicone(12.0);
  const Plate plate(layer, HALF_X_mm, HALF_Y_mm);
  double force = 0.0, moment_x_mm = 0.0, moment_y_mm = 0.0;
  for (double x = -HALF_X_mm + 0.5 * STEP_mm; x < HALF_X_mm; x += STEP_mm) {
    for (double y = -HALF_Y_mm + 0.5 * STEP_mm; y < HALF_Y_mm; y += STEP_mm) {
      const double cell_m2 = 1e-6 * STEP_mm * STEP_mm;
      force += plate.normal_Pa_N(x, y) * cell_m2;
      moment_x_mm += x * plate.along_x_Pa_N(x) * cell_m2;
      moment_y_mm += y * plate.along_y_Pa_N(y) * cell_m2;
    }
  }
  EXPECT_NEAR(force, 1.0, 0.01);
  EXPECT_NEAR(moment_x_mm, 6.0, 0.1);
  EXPECT_NEAR(moment_y_mm, 6.0, 0.1);
  // Held in by its own width, the middle carries more than the sides.
  EXPECT_GT(plate.normal_Pa_N(0.0, 0.0), 1.8 * plate.normal_Pa_N(HALF_X_mm, 0.0));
}

TEST(Plate, IsAsStiffAsGentAndLindleysStrip) {
  // Long, between plates: E A / h (1 + w^2 / (3 h^2)), w its width.
  const twin::Layer layer = twin::silicone(12.0);
  constexpr double HALF_X_mm = 18.0, HALF_Y_mm = 5000.0;
  const Plate plate(layer, HALF_X_mm, HALF_Y_mm);
  const double area_mm2 = 4.0 * HALF_X_mm * HALF_Y_mm;
  const double expected = 1e-6 * layer.youngs_modulus_Pa * area_mm2 / 12.0 * (1.0 + 36.0 * 36.0 / (3.0 * 144.0));
  EXPECT_NEAR(plate.stiffness_N_mm() / expected, 1.0, 0.02);
}

TEST(Plate, HidesSlidingFromTheBase) {
  const Face face("plate", 12.0, FINGERTIP_TEST_TABLES);
  twin::Touch touch;
  touch.force_N = 5.0;
  const Pressures here = face.base_Pa(touch);
  touch.x_mm = 6.0;
  touch.angle_rad = 0.3;
  EXPECT_EQ(face.base_Pa(touch), here);
  touch.pull_x_N = 2.0;
  const Pressures pulled = face.base_Pa(touch);
  double most_Pa = 0.0;
  for (std::size_t k = 0; k < SENSORS; k++) {
    most_Pa = std::max(most_Pa, std::abs(pulled[k] - here[k]));
  }
  EXPECT_GT(most_Pa, 10.0);
  EXPECT_LT(most_Pa, 0.1 * here[7]);
}

} // namespace
