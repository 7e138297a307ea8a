#include "grasp/control/finger.hpp"
#include "libfingertip/random.hpp"
#include "simulation/cell/face.hpp"
#include "simulation/twin/traction_table.hpp"

extern "C" {
#include "common/contact_flags.h"
#include "config/geometry.h"
#include "fit/fit.h"
}

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

using namespace fingertip;
using namespace fingertip::cell;

TEST(Face, FeelsWhatTheTwinDoes) {
  for (const char *name : {"sphere6", "sphere15", "cube6"}) {
    const twin::Layer layer = twin::silicone(12.0);
    const auto table = twin::ContactTable::load_or_build(twin::indenter(name), layer, FINGERTIP_TEST_TABLES);
    const twin::TractionTable traction(table, layer);
    const Face face(name, FINGERTIP_TEST_TABLES);
    Random random(3, 1, 1);
    for (int i = 0; i < 300; i++) {
      Patch touch;
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
    EXPECT_EQ(face.base_Pa({}), Pressures(SENSORS));
  }
}

TEST(Face, KnowsNoOther) { EXPECT_THROW(Face("banana", FINGERTIP_TEST_TABLES), std::runtime_error); }

// Of a line or an area: as many contacts side by side.
TEST(Face, ALongContactIsItsPartsAndKeepsForceAndPlace) {
  const Face face("sphere15", FINGERTIP_TEST_TABLES);
  Patch point;
  point.force_N = 2.0;
  const double peak_Pa = face.base_Pa(point)[7];
  Patch line = point;
  line.length_mm = 24.0;
  line.angle_rad = 0.5 * M_PI; // along y
  const Pressures lengthwise = face.base_Pa(line);
  EXPECT_LT(lengthwise[7], 0.75 * peak_Pa);
  EXPECT_NEAR(lengthwise[6], lengthwise[8], 1e-6 * peak_Pa);
  EXPECT_GT(lengthwise[8], 2.5 * lengthwise[2]); // beside it
  line.off_length_mm = 6.0;                      // more weight at the end towards +y, its place there
  line.y_mm = 6.0;
  const Pressures leaning = face.base_Pa(line);
  EXPECT_GT(leaning[8], 1.5 * leaning[6]);
  // The nodes of a long one with their force, by hand.
  Patch two = point;
  two.length_mm = 8.0;
  Pressures sum(SENSORS);
  for (const double u_mm : {-2.0, 2.0}) {
    Patch half = point;
    half.force_N = 1.0;
    half.x_mm = u_mm;
    const Pressures part = face.base_Pa(half);
    for (std::size_t k = 0; k < SENSORS; k++) {
      sum[k] += part[k];
    }
  }
  for (std::size_t k = 0; k < SENSORS; k++) {
    EXPECT_NEAR(face.base_Pa(two)[k], sum[k], 1e-9 * peak_Pa);
  }
}

TEST(Face, AnAreaIsHeldInByItsOwnWidth) {
  const Face face("sphere15", FINGERTIP_TEST_TABLES);
  Patch area;
  area.force_N = 10.0;
  area.length_mm = 36.0;
  area.width_mm = 54.0;
  const Pressures pressed = face.base_Pa(area);
  EXPECT_GT(pressed[7], 1.15 * pressed[2]);
  EXPECT_GT(pressed[2], 1.15 * pressed[0]);
}

// Force and load by the place, as a grasp reads them (grasp/control/finger.cpp) after 0.2 s.
static GripReading felt(GripFinger &finger, const Pressures &base_Pa, double &t_s) {
  fit_array array{};
  EXPECT_EQ(fit_array_init(&array, geometry.sensor_count, geometry.x_mm, geometry.y_mm, geometry.pitch_mm), FT_OK);
  std::array<std::int32_t, FT_MAX_SENSORS> q10{};
  std::transform(base_Pa.begin(), base_Pa.end(), q10.begin(),
                 [](double Pa) { return static_cast<std::int32_t>(std::lround(1024.0 * Pa)); });
  fit_settings settings{};
  settings.iterations = 7;
  settings.noise_Pa_q10 = 5120;
  fit_result fit{};
  fit_gaussian(&array, q10.data(), (1u << SENSORS) - 1, &settings, &fit);
  const double sigma_mm = double{fit.sigma_mm}, force_N = 2e-6 * M_PI * double{fit.p0_Pa} * sigma_mm * sigma_mm;
  for (const double until_s = t_s + 0.2; t_s < until_s; t_s += 0.0025) {
    finger.take({t_s, CONTACT_FLAG_CONTACT | CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_ELONGATED, force_N, 1e-6 * t_s, double{fit.x_mm},
                 double{fit.y_mm}, sigma_mm});
  }
  return finger.sample(t_s, {});
}

TEST(Face, AGraspReadsForceAndLoadOfLinesAndAreas) {
  const Face face("sphere15", FINGERTIP_TEST_TABLES);
  for (const double length_mm : {0.0, 12.0, 24.0, 36.0}) {
    for (const double width_mm : {0.0, 12.0, 24.0, 36.0, 50.0}) {
      for (const bool across : {false, true}) {
        Patch patch;
        patch.force_N = 5.0;
        patch.length_mm = length_mm;
        patch.width_mm = width_mm;
        GripFinger finger;
        double t_s = 1.0;
        felt(finger, face.base_Pa(patch), t_s);
        finger.end_zero();
        (across ? patch.pull_x_N : patch.pull_y_N) = 1.0;
        patch.stuck_N = 3.0; // friction 0.5
        const GripReading reading = felt(finger, face.base_Pa(patch), t_s);
        // The fit takes the width of what lies right across the pad for that of its short side.
        const double off = length_mm > 24.0 ? 0.4 : 0.2;
        EXPECT_NEAR(std::hypot(reading.pulled_x, reading.pulled_y), 0.2, 0.2 * off + 0.04) << length_mm << " x " << width_mm << across;
        EXPECT_NEAR(reading.force_N, patch.force_N, 0.7 * off * patch.force_N) << length_mm << " x " << width_mm << across;
      }
    }
  }
}
