// The reference itself: rationed starts against Ceres from every start, and the cache against
// solving again.
#include "report/reference/dataset.hpp"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <string>

using namespace fingertip::reference;

namespace {

constexpr std::uint64_t SEED = 11;
const std::string cache_dir = FINGERTIP_TEST_CACHE_DIR;

bool same(const Fit &a, const Fit &b) {
  return a.theta.p0_Pa == b.theta.p0_Pa && a.theta.x_mm == b.theta.x_mm && a.theta.y_mm == b.theta.y_mm &&
         a.theta.sigma_mm == b.theta.sigma_mm && a.cost == b.cost && a.force_N == b.force_N &&
         a.location_sd_mm == b.location_sd_mm && a.condition_number == b.condition_number && a.at_bound == b.at_bound;
}

bool same(const std::vector<Case> &a, const std::vector<Case> &b) {
  bool equal = a.size() == b.size();
  for (std::size_t i = 0; equal && i < a.size(); i++) {
    equal = a[i].pressure_Pa_q10 == b[i].pressure_Pa_q10 && a[i].usable == b[i].usable &&
            a[i].observable == b[i].observable && same(a[i].best, b[i].best);
  }
  return equal;
}

class Cache : public testing::Test {
protected:
  void SetUp() override { std::filesystem::remove_all(cache_dir); }
  void TearDown() override { std::filesystem::remove_all(cache_dir); }
};

} // namespace

TEST_F(Cache, RationedStartsMissNoMinimum) {
  const Array array = firmware_array();
  int observable_presses = 0;
  for (PressSet set : ALL_PRESS_SETS) {
    for (Mask mask : {Mask::none, Mask::peak}) {
      for (const Case &c : load_cases(set, mask, SEED, 60, cache_dir)) {
        if (!c.observable) {
          continue;
        }
        std::vector<double> pressure_Pa;
        for (std::int32_t q10 : c.pressure_Pa_q10) {
          pressure_Pa.push_back(q10 / 1024.0);
        }
        const Fit full = fit(array, pressure_Pa, c.usable, c.press.noise_Pa, {}, Starts::all);
        EXPECT_TRUE(c.best.cost <= full.cost * (1.0 + 1e-9));
        EXPECT_TRUE(std::hypot(c.best.theta.x_mm - full.theta.x_mm, c.best.theta.y_mm - full.theta.y_mm) < 1e-6);
        observable_presses++;
      }
    }
  }
  EXPECT_GT(observable_presses, 250);
}

TEST_F(Cache, NoNeighbourOfTheRecordIsBetter) {
  // Any neighbour 1 um away costs more.
  const Array array = firmware_array();
  for (const Case &c : load_cases(PressSet::D, Mask::none, SEED, 100, cache_dir)) {
    const auto cost = [&](double dx_mm, double dy_mm) {
      double sum = 0.0;
      for (std::size_t k = 0; k < array.x_mm.size(); k++) {
        const double dx = array.x_mm[k] - c.best.theta.x_mm - dx_mm;
        const double dy = array.y_mm[k] - c.best.theta.y_mm - dy_mm;
        const double s = c.best.theta.sigma_mm;
        const double r =
            c.best.theta.p0_Pa * std::exp(-0.5 * (dx * dx + dy * dy) / (s * s)) - c.pressure_Pa_q10[k] / 1024.0;
        sum += 0.5 * r * r;
      }
      return sum;
    };
    if (c.observable) {
      EXPECT_NEAR(c.best.cost, cost(0.0, 0.0), 1e-9 * c.best.cost);
      for (int i = 0; i < 4; i++) {
        EXPECT_TRUE(cost(i == 0 ? 1e-3 : i == 1 ? -1e-3 : 0.0, i == 2 ? 1e-3 : i == 3 ? -1e-3 : 0.0) > cost(0.0, 0.0));
      }
    }
  }
}

TEST_F(Cache, RepeatsAndGrows) {
  const auto fresh = load_cases(PressSet::B, Mask::random, SEED, 200, cache_dir);
  const std::string file = cache_dir + "/reference_11_B_random.bin";
  const auto written = std::filesystem::last_write_time(file);
  EXPECT_TRUE(same(fresh, load_cases(PressSet::B, Mask::random, SEED, 200, cache_dir)));
  EXPECT_TRUE(written == std::filesystem::last_write_time(file));

  // Fewer do not shrink it, more keep what is there, none at all gives the same again.
  load_cases(PressSet::B, Mask::random, SEED, 50, cache_dir);
  auto more = load_cases(PressSet::B, Mask::random, SEED, 260, cache_dir);
  more.resize(200);
  EXPECT_TRUE(same(fresh, more));
  std::filesystem::remove(file);
  EXPECT_TRUE(same(fresh, load_cases(PressSet::B, Mask::random, SEED, 200, cache_dir)));
}

TEST_F(Cache, DamageIsSolvedAgain) {
  const auto fresh = load_cases(PressSet::A, Mask::none, SEED, 30, cache_dir);
  const std::string file = cache_dir + "/reference_11_A_none.bin";
  {
    std::fstream damaged(file, std::ios::in | std::ios::out | std::ios::binary);
    damaged.seekp(3);
    damaged.put('\x5A');
  }
  EXPECT_TRUE(same(fresh, load_cases(PressSet::A, Mask::none, SEED, 30, cache_dir)));
  std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2 + 3);
  EXPECT_TRUE(same(fresh, load_cases(PressSet::A, Mask::none, SEED, 30, cache_dir)));
}
