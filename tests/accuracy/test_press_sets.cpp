// The simulated presses against what is known of the bonded layer without simulating:
// conservation of force, width and height of the best Gaussian.
#include "library/pad/layer.hpp"
#include "report/reference/dataset.hpp"
#include "report/reference/press_sets.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <tuple>

using namespace fingertip::reference;

namespace {

constexpr std::uint64_t SEED = 7;

// Integral over the base by Simpson's rule, N per N.
double force_through(const Layer &layer) {
  const double step_mm = layer.thickness_mm() / 100.0;
  const int steps = 2400;
  double sum = 0.0;
  for (int i = 0; i <= steps; i++) {
    const double r_mm = i * step_mm;
    const double weight = i == 0 || i == steps ? 1.0 : i % 2 == 1 ? 4.0 : 2.0;
    sum += weight * 2.0 * M_PI * r_mm * layer.point_load_Pa(r_mm);
  }
  return sum * step_mm / 3.0 * 1e-6;
}

TEST(Layer, BaseCarriesTheWholeForce) {
  for (double thickness_mm : {6.0, 12.0}) {
    EXPECT_NEAR(1.0, force_through(Layer(thickness_mm)), 1e-6);
  }
}

TEST(Layer, TableIsInterpolatedPrecisely) {
  // Against the Hankel integral by Simpson's rule, between the nodes of the table.
  const double thickness_mm = 7.3;
  const Layer layer(thickness_mm);
  for (double r_mm : {0.0, 0.013, 1.7, 3.21, 9.003, 25.37, 70.1}) {
    const int steps = 40000;
    const double step = 40.0 / steps;
    double sum = 0.0;
    for (int i = 1; i < steps; i++) {
      const double u = i * step;
      sum += (i % 2 == 1 ? 4.0 : 2.0) * u * fingertip::twin::base_transfer(u, 0.49) * j0(u * r_mm / thickness_mm);
    }
    const double direct_Pa = sum * step / 3.0 * 1e6 / (2.0 * M_PI * thickness_mm * thickness_mm);
    EXPECT_NEAR(layer.point_load_Pa(r_mm), direct_Pa, 1e-7 * layer.point_load_Pa(0.0));
  }
}

TEST(Layer, BestGaussianUnderAPointLoad) {
  // Least squares over the whole base: sigma = 0.447 h, and it holds 0.899 of the force.
  const Layer layer(12.0);
  double best_cost = 0.0, best_sigma_mm = 0.0, best_share = 0.0;
  for (double sigma_mm = 4.0; sigma_mm < 7.0; sigma_mm += 0.002) {
    double pg = 0.0, gg = 0.0;
    for (double r_mm = 0.0; r_mm < 150.0; r_mm += 0.1) {
      const double g = std::exp(-0.5 * r_mm * r_mm / (sigma_mm * sigma_mm));
      pg += layer.point_load_Pa(r_mm) * g * r_mm;
      gg += g * g * r_mm;
    }
    // p^2 is common to all: the cost falls by pg^2 / gg.
    if (-pg * pg / gg < best_cost) {
      best_cost = -pg * pg / gg;
      best_sigma_mm = sigma_mm;
      best_share = 2.0 * M_PI * pg / gg * sigma_mm * sigma_mm * 1e-6;
    }
  }
  EXPECT_NEAR(0.447, best_sigma_mm / 12.0, 0.002);
  EXPECT_NEAR(0.899, best_share, 0.003);
}

TEST(ContactPressure, ConservesForceAndPushes) {
  for (Indenter indenter : ALL_INDENTERS) {
    for (double force_N : {1.0, 5.0, 25.0}) {
      double sum = 0.0, x = 0.0, y = 0.0, reach_mm = 0.0;
      for (const PointLoad &load : contact_pressure(indenter, force_N, 6.0)) {
        EXPECT_TRUE(load.share > 0.0);
        sum += load.share;
        x += load.share * load.x_mm;
        y += load.share * load.y_mm;
        reach_mm = std::max(reach_mm, std::hypot(load.x_mm, load.y_mm));
      }
      EXPECT_NEAR(1.0, sum, 1e-13);
      EXPECT_NEAR(0.0, x, 1e-13);
      EXPECT_NEAR(0.0, y, 1e-13);
      EXPECT_TRUE(reach_mm <= (indenter == Indenter::sphere_15mm ? 6.0 : 3.0 * std::sqrt(2.0)));
    }
  }
}

TEST(ContactPressure, PeakPerNewton) {
  // Under the contact's centre, 5 N: the ranges a full contact solution gives for the indenters.
  for (const auto &[thickness_mm, low_kPa, high_kPa] : {std::array{6.0, 11.4, 18.0}, std::array{12.0, 4.3, 5.0}}) {
    const Layer layer(thickness_mm);
    for (Indenter indenter : ALL_INDENTERS) {
      double kPa = 0.0;
      for (const PointLoad &load : contact_pressure(indenter, 5.0, thickness_mm)) {
        kPa += 1e-3 * load.share * layer.point_load_Pa(std::hypot(load.x_mm, load.y_mm));
      }
      EXPECT_TRUE(kPa > low_kPa && kPa < high_kPa);
    }
  }
}

TEST(Press, RepeatsAndPassesTheGate) {
  const Array array = firmware_array();
  for (PressSet set : ALL_PRESS_SETS) {
    for (std::size_t i = 0; i < 300; i++) {
      const Press press = make_press(set, array, SEED, i);
      const Press again = make_press(set, array, SEED, i);
      EXPECT_TRUE(press.pressure_Pa == again.pressure_Pa);
      EXPECT_TRUE(press.pressure_Pa != make_press(set, array, SEED, i + 1).pressure_Pa);
      EXPECT_TRUE(press.pressure_Pa != make_press(set, array, SEED + 1, i).pressure_Pa);
      EXPECT_TRUE(press.noise_Pa >= 2.0 && press.noise_Pa <= 20.0);
      EXPECT_TRUE(*std::max_element(press.pressure_Pa.begin(), press.pressure_Pa.end()) >= 20.0 * press.noise_Pa);
      const bool inside = std::abs(press.x_mm) <= 9.0 && std::abs(press.y_mm) <= 18.0;
      EXPECT_EQ(set != PressSet::B, inside);
      EXPECT_TRUE(std::abs(press.x_mm) <= 15.0 && std::abs(press.y_mm) <= 24.0);
    }
  }
}

TEST(Press, Quantisation) {
  EXPECT_EQ(1024, quantise({1.0004})[0]);
  EXPECT_EQ(-1, quantise({-0.0007})[0]);
  EXPECT_EQ(2048, quantise({1.6}, 1.0)[0]);
  EXPECT_EQ(64 * 3, quantise({0.2}, 1.0 / 16.0)[0]);
}

} // namespace
