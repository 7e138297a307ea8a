#include "layer_collocation.hpp"
#include "simulation/twin/best_gaussian.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <gtest/gtest.h>

namespace fingertip::twin {

const std::filesystem::path CACHE = FINGERTIP_TEST_CACHE_DIR;

static std::size_t at(const Grid &grid, int i, int j) {
  return std::size_t(grid.nodes / 2 + i) * std::size_t(grid.nodes) + std::size_t(grid.nodes / 2 + j);
}

static double sum(const std::vector<double> &values) {
  double total = 0.0;
  for (double value : values) {
    total += value;
  }
  return total;
}

TEST(TwinLayer, ShortAndLongWavesHaveTheirLimits) {
  for (double nu : {0.3, 0.49, 0.499}) {
    EXPECT_NEAR(base_transfer(0.0, nu), 1.0, 1e-12);
    EXPECT_NEAR(base_transfer(1e-5, nu), 1.0, 1e-6);
    EXPECT_LT(base_transfer(1.0, nu), 1.0);
    // Short waves: 4 (1-nu) / (3-4nu) (2 (1-nu) + H) exp(-H).
    const double a = 2.0 * (1.0 - nu);
    EXPECT_NEAR(base_transfer(20.0, nu) * std::exp(20.0), 2.0 * a * (a + 20.0) / (3.0 - 4.0 * nu), 1e-6);
    EXPECT_EQ(base_transfer(1e6, nu), 0.0);
    const double bulk = (1.0 - 2.0 * nu) / (2.0 * (1.0 - nu) * (1.0 - nu));
    EXPECT_NEAR(surface_compliance(0.0, nu), bulk, 1e-12);
    EXPECT_NEAR(surface_compliance(1.01e-4, nu), bulk, 1e-5 * bulk);
    EXPECT_NEAR(surface_compliance(50.0, nu), 1.0 / 50.0, 1e-12);
    EXPECT_NEAR(surface_compliance(1e6, nu), 1e-6, 1e-15);
  }
}

TEST(TwinLayer, CollocationAgrees) {
  for (double nu : {0.0, 0.3, 0.45, 0.49, 0.499}) {
    for (double H : {1e-3, 0.01, 0.1, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0}) {
      const LayerWave wave = solve_layer_wave(H, nu, 36);
      EXPECT_NEAR(wave.base_per_pressure, base_transfer(H, nu), 1e-10) << "H " << H << " nu " << nu;
      EXPECT_NEAR(wave.base_per_traction, tangential_transfer(H, nu), 1e-10) << "H " << H << " nu " << nu;
      EXPECT_NEAR(wave.sinks_per_pressure, (1.0 - nu) * surface_compliance(H, nu), 1e-10) << "H " << H << " nu " << nu;
    }
  }
}

// The base carries the moment of a traction and no force; short waves press as pressure does.
TEST(TwinLayer, TractionHasItsLimits) {
  for (double nu : {0.3, 0.49, 0.499}) {
    EXPECT_EQ(tangential_transfer(0.0, nu), 0.0);
    EXPECT_NEAR(tangential_transfer(1e-9, nu), 1e-9, 1e-20);
    EXPECT_NEAR(tangential_share(1e-9, nu), 1e-9, 1e-20);
    const double a = 2.0 * (1.0 - nu);
    EXPECT_NEAR(tangential_transfer(20.0, nu) * std::exp(20.0), 2.0 * a * (20.0 + 1.0 - 2.0 * nu) / (3.0 - 4.0 * nu), 1e-6);
    EXPECT_EQ(tangential_transfer(1e6, nu), 0.0);
    EXPECT_NEAR(tangential_share(1e6, nu), 1.0, 1e-6);
    for (double H : {0.2, 1.0, 3.0, 10.0}) { // as one fraction
      const double b = 1.0 - 2.0 * nu, cosh = std::cosh(H);
      const double D = (3.0 - 4.0 * nu) * cosh * cosh + H * H + b * b;
      EXPECT_NEAR(tangential_transfer(H, nu), a * (H * cosh + b * std::sinh(H)) / D, 1e-15);
    }
  }
}

TEST(TwinLayer, GentGivesTheRubberOfThePaper) { EXPECT_NEAR(youngs_modulus_Pa(15.0), 0.563e6, 0.001e6); }

// Uniform pressure on a disc of a half-space: 2 (1-nu^2) p a / E in the middle, 2 / pi of that at
// the edge (Boussinesq). The layer is far thicker than the grid is wide; that shifts all alike.
TEST(TwinContact, DiscOnAThickLayerSinksAsBoussinesqSays) {
  const Layer layer{400.0, 1e6, 0.49};
  const Grid grid{512, 0.1};
  ContactSolver solver(indenter("sphere6"), layer, grid);
  const double radius_mm = 2.5;
  std::vector<double> pressure(std::size_t(grid.nodes) * std::size_t(grid.nodes), 0.0);
  for (int i = -30; i <= 30; i++) {
    for (int j = -30; j <= 30; j++) {
      // The share of the cell inside.
      int inside = 0;
      for (int k = 0; k < 64; k++) {
        inside += std::hypot(i + (k % 8 - 3.5) / 8, j + (k / 8 - 3.5) / 8) * grid.step_mm <= radius_mm;
      }
      pressure[at(grid, i, j)] = 1e5 * inside / 64;
    }
  }
  const std::vector<double> sunk = solver.displacement_mm(pressure);
  const double middle = 2.0 * (1.0 - 0.49 * 0.49) * 1e5 * radius_mm / 1e6;
  EXPECT_NEAR(sunk[at(grid, 0, 0)] - sunk[at(grid, 25, 0)], middle * (1.0 - 2.0 / M_PI), 0.01 * middle * (1.0 - 2.0 / M_PI));
}

TEST(TwinContact, SphereOnAThickLayerIsHertz) {
  const Layer layer{400.0, 1e6, 0.49};
  const Grid grid{384, 0.05};
  ContactSolver solver(indenter("sphere15"), layer, grid);
  const double radius_mm = 7.5, modulus_MPa = 1.0 / (1.0 - 0.49 * 0.49), force_N = 0.2;
  const double a = std::cbrt(0.75 * force_N * radius_mm / modulus_MPa);
  const Contact contact = solver.solve(force_N);
  EXPECT_NEAR(std::sqrt(contact.contact_area_mm2 / M_PI), a, 0.01 * a);
  const double peak = 1.5e6 * force_N / (M_PI * a * a);
  EXPECT_NEAR(contact.pressure_Pa[at(grid, 0, 0)], peak, 0.01 * peak);
  const int half = static_cast<int>(std::lround(0.5 * a / grid.step_mm));
  const double r = half * grid.step_mm / a;
  EXPECT_NEAR(contact.pressure_Pa[at(grid, half, 0)], peak * std::sqrt(1.0 - r * r), 0.01 * peak);
}

TEST(TwinContact, EveryIndenterPressesWithItsForceAndNowhereElse) {
  for (const Indenter &one : indenters()) {
    for (double thickness_mm : {12.0, 6.0}) {
      const Layer layer = silicone(thickness_mm);
      const Grid grid = grid_for(one, layer);
      ContactSolver solver(one, layer, {grid.nodes / 2, 2 * grid.step_mm});
      const double area_m2 = 4e-6 * grid.step_mm * grid.step_mm;
      for (double force_N : {0.02, 1.0, 50.0}) {
        const Contact contact = solver.solve(force_N);
        EXPECT_NEAR(area_m2 * sum(contact.pressure_Pa), force_N, 1e-9 * force_N) << one.name;
        EXPECT_NEAR(area_m2 * sum(contact.base_Pa), force_N, 1e-9 * force_N) << one.name;
        EXPECT_GE(*std::min_element(contact.pressure_Pa.begin(), contact.pressure_Pa.end()), 0.0);
      }
    }
  }
}

TEST(TwinContact, NoSurfaceOverlapsAndContactsTouch) {
  const Layer layer = silicone(12.0);
  const Indenter &sphere = indenter("sphere6");
  const Grid grid{288, 0.25};
  ContactSolver solver(sphere, layer, grid);
  const Contact contact = solver.solve(5.0);
  const std::vector<double> sunk = solver.displacement_mm(contact.pressure_Pa);
  for (int i = -40; i <= 40; i++) {
    const double height = sphere.profile_mm(i * grid.step_mm, 0.0);
    const double gap = sunk[at(grid, i, 0)] + height - contact.indentation_mm;
    if (contact.pressure_Pa[at(grid, i, 0)] > 0.0) {
      EXPECT_NEAR(gap, 0.0, 1e-4);
    } else {
      EXPECT_GE(gap, -1e-4);
    }
  }
}

// Twice the room around the contact changes nothing at the sensors.
TEST(TwinContact, TheImagesOfThePeriodicGridAreFarAway) {
  for (double thickness_mm : {12.0, 6.0}) {
    const Layer layer = silicone(thickness_mm);
    const Indenter &cube = indenter("cube6");
    const Grid near_grid = {grid_for(cube, layer).nodes / 2, 0.5};
    const Grid far_grid = {2 * near_grid.nodes, 0.5};
    const Contact close = ContactSolver(cube, layer, near_grid).solve(10.0);
    const Contact far = ContactSolver(cube, layer, far_grid).solve(10.0);
    const double peak = close.base_Pa[at(near_grid, 0, 0)];
    for (int i = 0; i <= 90; i += 9) {
      EXPECT_NEAR(close.base_Pa[at(near_grid, i, 0)], far.base_Pa[at(far_grid, i, 0)], 2e-4 * peak);
    }
  }
}

// What the fit sees of it: a Gaussian of sigma 0.45 h that holds 0.9 of the force.
TEST(TwinTable, ThePressureIsNearlyTheGaussianOfTheFit) {
  for (double thickness_mm : {12.0, 6.0}) {
    const ContactTable table = ContactTable::load_or_build(indenter("sphere6"), silicone(thickness_mm), CACHE);
    const BestGaussian::Fit best = BestGaussian(table, thickness_mm).at(2.0);
    EXPECT_NEAR(best.sigma_mm / thickness_mm, 0.45, 0.03);
    EXPECT_NEAR(2e-6 * M_PI * best.p0_Pa * best.sigma_mm * best.sigma_mm / 2.0, 0.9, 0.02);
  }
}

TEST(TwinTable, InterpolatesToTwoThousandthsOfThePeak) {
  for (const char *name : {"sphere6", "cube6"}) {
    const Layer layer = silicone(6.0);
    const ContactTable table = ContactTable::load_or_build(indenter(name), layer, CACHE);
    const Grid grid = grid_for(indenter(name), layer);
    ContactSolver solver(indenter(name), layer, grid);
    for (double force_N : {0.03, 0.7, 4.4, 13.0, 41.0}) {
      const Contact contact = solver.solve(force_N);
      const double peak = contact.base_Pa[at(grid, 0, 0)];
      for (int i = -41; i <= 41; i += 3) {
        for (int j = 0; j <= 60; j += 5) {
          EXPECT_NEAR(table.base_pressure_Pa(force_N, i * grid.step_mm, j * grid.step_mm), contact.base_Pa[at(grid, i, j)], 2e-3 * peak)
              << name << " " << force_N << " N";
        }
      }
      EXPECT_NEAR(table.indentation_mm(force_N), contact.indentation_mm, 0.01 * contact.indentation_mm);
    }
    EXPECT_EQ(table.base_pressure_Pa(0.0, 1.0, 1.0), 0.0);
    EXPECT_EQ(table.base_pressure_Pa(1.0, 46.0, 0.0), 0.0);
    EXPECT_NEAR(table.base_pressure_Pa(1e-3, 1.0, 2.0), 0.05 * table.base_pressure_Pa(0.02, 1.0, 2.0), 1e-6);
  }
}

TEST(TwinTable, ADamagedFileIsSolvedAnew) {
  const std::filesystem::path cache = CACHE / "damaged";
  std::filesystem::remove_all(cache);
  const Layer layer = silicone(3.0); // a small grid
  const Indenter &body = indenter("lime");
  const double good = ContactTable::load_or_build(body, layer, cache).base_pressure_Pa(3, 2, 1);
  const std::filesystem::path file = *std::filesystem::directory_iterator(cache);
  const auto long_ago = std::filesystem::last_write_time(file) - std::chrono::hours(1);
  std::filesystem::last_write_time(file, long_ago);
  ContactTable::load_or_build(body, layer, cache);
  EXPECT_EQ(std::filesystem::last_write_time(file), long_ago) << "the cache was not used";
  {
    std::fstream damaged(file, std::ios::in | std::ios::out | std::ios::binary);
    damaged.seekp(100000);
    damaged.put('x');
  }
  std::filesystem::last_write_time(file, long_ago);
  const ContactTable again = ContactTable::load_or_build(body, layer, cache);
  EXPECT_GT(std::filesystem::last_write_time(file), long_ago);
  EXPECT_EQ(again.base_pressure_Pa(3, 2, 1), good);
}

} // namespace fingertip::twin
