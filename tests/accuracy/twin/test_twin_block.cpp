#include "block_fem.hpp"
#include "library/pad/block_table.hpp"
#include "simulation/twin/contact_table.hpp"
#include "simulation/twin/scenarios.hpp"

#include <algorithm>
#include <fstream>
#include <gtest/gtest.h>

namespace fingertip::twin {

const std::filesystem::path CACHE = FINGERTIP_TEST_CACHE_DIR;
constexpr double FIELD_STEP_mm = 0.5;
const BlockGrid COARSE{5, 8.0, 0.7, 0.04, 3.0};

static Block around(double thickness_mm, double overhang_mm) { return {silicone(thickness_mm), 9.0 + overhang_mm, 18.0 + overhang_mm}; }

// Under a force of 1 N spread as exp(-r^2 / (2 s^2)) on a layer without end, at dx, dy from it: by
// Hankel transforms, MPa. Of x, y, z; z is down.
struct LayerField {
  Layer layer;
  double s_mm;

  Eigen::Vector3d at(double dx, double dy) const {
    const double h = layer.thickness_mm, r = std::hypot(dx, dy);
    double down = 0.0, ahead = 0.0;
    const double step = 0.02;
    for (double H = 0.5 * step; H < 30.0; H += step) {
      const double wave = std::exp(-0.5 * H * H * s_mm * s_mm / (h * h)) * H * step;
      down += base_transfer(H, layer.poisson) * ::j0(H * r / h) * wave;
      ahead += tangential_transfer(H, layer.poisson) * ::j1(H * r / h) * wave;
    }
    const double norm = 1.0 / (2.0 * M_PI * h * h);
    return {r > 0.0 ? norm * ahead * dx / r : 0.0, r > 0.0 ? norm * ahead * dy / r : 0.0, norm * down};
  }
  // Largest pressure under a force down, along x or y.
  Eigen::Vector3d peak() const {
    double ahead = 0.0;
    for (double r = 0.3; r < 1.5; r += 0.1) {
      ahead = std::max(ahead, at(r * layer.thickness_mm, 0.0)[0]);
    }
    return {ahead, ahead, at(0.0, 0.0)[2]};
  }
};

// Of a block's answer, Pa / N: x, y, down.
static Eigen::Vector3d node(const BlockAnswer &answer, int i, int j) {
  const std::size_t n = std::size_t(i * answer.nodes_y + j);
  return {static_cast<double>(answer.along_x[n]), static_cast<double>(answer.along_y[n]), static_cast<double>(answer.down[n])};
}

// A load spread as LayerField's on the block's surface.
static Eigen::Vector3d spread(const BlockAnswer &answer, const Block &block, const Place &load, double s_mm) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double weights = 0.0;
  for (int i = 0; i < answer.nodes_x; i++) {
    for (int j = 0; j < answer.nodes_y; j++) {
      const double dx = block.half_x_mm * (2.0 * i / (answer.nodes_x - 1) - 1.0) - load.x_mm;
      const double dy = block.half_y_mm * (2.0 * j / (answer.nodes_y - 1) - 1.0) - load.y_mm;
      const double weight = std::exp(-0.5 * (dx * dx + dy * dy) / (s_mm * s_mm));
      sum += weight * node(answer, i, j);
      weights += weight;
    }
  }
  return sum / weights;
}

static double bell(double dx, double dy, double s_mm) {
  return std::exp(-0.5 * (dx * dx + dy * dy) / (s_mm * s_mm)) / (2.0 * M_PI * s_mm * s_mm);
}

// The whole block under loads down and along x and y, four times a quarter, by twenty-node elements, felt through a bell.
TEST(TwinBlock, AgreesWithElementsOfTwentyNodesUnderTheLoadItself) {
  const Block block = around(12.0, 6.0);
  const double load_mm = 2.2, felt_mm = 1.5;
  const std::array<std::vector<double>, 3> edges{std::vector<double>{0, 2.3, 4.6, 6.9, 9.2, 11.4, 13.4, 14.4, 15},
                                                 {0, 3, 6, 9, 11.5, 13.5, 15.5, 17.5, 19.5, 21.5, 23, 24},
                                                 {0, 0.6, 1.8, 3.8, 6.4, 9.2, 12}};
  const std::array<Place, 4> places{{{0, 0}, {9, 0}, {0, 18}, {9, 18}}};
  const std::array<Place, 2> loads{{{4.0, 5.0}, {7.5, 14.0}}};
  std::array<std::array<Eigen::Vector3d, 2>, 4> found;
  found.fill({Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()});
  for (bool odd_x : {false, true}) {
    for (bool odd_y : {false, true}) {
      BlockFem fem(edges, block.layer.poisson, odd_x, odd_y);
      // A quarter of a function and its mirrors, with their signs.
      const auto images = [&](const Place &place, double s_mm, bool flips_x, bool flips_y) {
        return [=](double x, double y) {
          double sum = 0.0;
          for (double sign_x : {1.0, -1.0}) {
            for (double sign_y : {1.0, -1.0}) {
              sum += (flips_x ? sign_x : 1.0) * (flips_y ? sign_y : 1.0) * bell(x - sign_x * place.x_mm, y - sign_y * place.y_mm, s_mm);
            }
          }
          return sum;
        };
      };
      for (std::size_t n = 0; n < loads.size(); n++) {
        for (int along = 0; along < 3; along++) {
          const auto field = images(loads[n], load_mm, odd_x != (along == 0), odd_y != (along == 1));
          fem.load([&](double x, double y) -> Eigen::Vector3d {
            return (along == 2 ? -0.25 : 0.25) * field(x, y) * Eigen::Vector3d::Unit(along);
          });
          for (std::size_t p = 0; p < places.size(); p++) {
            found[p][n][along] += fem.base_work(images(places[p], felt_mm, odd_x, odd_y));
          }
        }
      }
    }
  }
  // A bell's mean, to the fourth order of its breadth, is that of four places.
  const double away_mm = std::sqrt(2.0) * felt_mm;
  std::vector<Place> around_them;
  for (const Place &place : places) {
    for (const auto &[dx, dy] : {std::pair{away_mm, 0.0}, {-away_mm, 0.0}, {0.0, away_mm}, {0.0, -away_mm}}) {
      around_them.push_back({place.x_mm + dx, place.y_mm + dy});
    }
  }
  const std::vector<BlockAnswer> answers = solve_block(block, around_them, FIELD_STEP_mm, COARSE);
  const LayerField layer{block.layer, std::hypot(load_mm, felt_mm)};
  const Eigen::Vector3d peak = layer.peak();
  Eigen::Vector3d off = Eigen::Vector3d::Zero(), difference = off;
  for (std::size_t p = 0; p < places.size(); p++) {
    for (std::size_t n = 0; n < loads.size(); n++) {
      Eigen::Vector3d added = Eigen::Vector3d::Zero();
      for (std::size_t m = 4 * p; m < 4 * p + 4; m++) {
        added += 0.25e-6 * spread(answers[m], block, loads[n], load_mm);
      }
      const Eigen::Vector3d whole = layer.at(places[p].x_mm - loads[n].x_mm, places[p].y_mm - loads[n].y_mm) + added;
      const Eigen::Vector3d o = (whole - found[p][n]).cwiseQuotient(peak);
      off = off.cwiseMax(o.cwiseAbs());
      difference = difference.cwiseMax(added.cwiseQuotient(peak).cwiseAbs());
    }
  }
  EXPECT_LT(off.maxCoeff(), 0.01);
  EXPECT_GT(difference.minCoeff(), 0.05);
}

// Largest difference of the answers, and largest of the second, in parts of the layer's peaks.
static std::pair<double, double> off_and_size(const std::vector<BlockAnswer> &a, const std::vector<BlockAnswer> &b,
                                              const Eigen::Vector3d &peak) {
  double off = 0.0, size = 0.0;
  for (std::size_t n = 0; n < a.size(); n++) {
    for (int i = 0; i < a[n].nodes_x; i++) {
      for (int j = 0; j < a[n].nodes_y; j++) {
        const Eigen::Vector3d here = 1e-6 * node(b[n], i, j).cwiseQuotient(peak);
        off = std::max(off, (1e-6 * node(a[n], i, j).cwiseQuotient(peak) - here).lpNorm<Eigen::Infinity>());
        size = std::max(size, here.lpNorm<Eigen::Infinity>());
      }
    }
  }
  return {off, size};
}

TEST(TwinBlock, SettlesAsElementsGrowSmaller) {
  // The nearer the ends, the more there is to settle.
  const Block block = around(12.0, 4.5);
  const std::vector<Place> places{{9, 18}};
  const Eigen::Vector3d peak = LayerField{block.layer, 0.0}.peak();
  const auto fine = solve_block(block, places, FIELD_STEP_mm, {7, 6.0, 0.5, 0.008, 3.0});
  const auto [usual, size] = off_and_size(solve_block(block, places, FIELD_STEP_mm), fine, peak);
  const double coarse = off_and_size(solve_block(block, places, FIELD_STEP_mm, COARSE), fine, peak).first;
  EXPECT_LT(usual, 5e-4);
  EXPECT_GT(coarse, 2.0 * usual);
  EXPECT_GT(size, 0.3);
}

TEST(TwinBlock, TendsToTheLayerWithoutEnd) {
  double before = 1.0;
  for (double overhang_mm : {6.0, 12.0, 18.0}) {
    const Block block = around(6.0, overhang_mm);
    const Eigen::Vector3d peak = LayerField{block.layer, 0.0}.peak();
    const std::vector<BlockAnswer> answers = solve_block(block, {{0, 0}, {9, 18}}, 1.0, COARSE);
    double most = 0.0;
    for (const BlockAnswer &answer : answers) {
      for (int i = 0; i < answer.nodes_x; i++) {
        for (int j = 0; j < answer.nodes_y; j++) {
          const double x = block.half_x_mm * (2.0 * i / (answer.nodes_x - 1) - 1.0);
          const double y = block.half_y_mm * (2.0 * j / (answer.nodes_y - 1) - 1.0);
          if (std::abs(x) <= 9.0 && std::abs(y) <= 18.0) {
            const Eigen::Vector3d here = 1e-6 * node(answer, i, j).cwiseQuotient(peak);
            most = std::max(most, here.lpNorm<Eigen::Infinity>());
          }
        }
      }
    }
    EXPECT_LT(most, 0.2 * before) << overhang_mm;
    before = most;
  }
  EXPECT_LT(before, 0.003);
}

// What four points cost against all of the contact's own pressure, in parts of the layer's peak
// under that load; and what the middle alone would.
TEST(TwinBlock, FourPointsStandForTheContact) {
  struct Case {
    const char *name;
    double overhang_mm, allowed, middle_costs;
  };
  for (const Case &one : {Case{"sphere6", 9.0, 0.001, 0.003}, Case{"sphere15", 9.0, 0.003, 0.006}, Case{"sphere6", 6.0, 0.004, 0.015},
                          Case{"sphere15", 6.0, 0.013, 0.03}, Case{"cube6", 6.0, 0.011, 0.04}}) {
    const double force_N = 8.0;
    const Place middle{9.0, 18.0};
    const std::vector<Place> sensors = sensor_places();
    const Block block = around(12.0, one.overhang_mm);
    const BlockTable table = BlockTable::load_or_build(block, sensors, CACHE);
    const double radius_mm = ContactTable::load_or_build(indenter(one.name), block.layer, CACHE).contact_radius_mm(force_N);
    const Grid grid{192, 0.25};
    const Contact contact = ContactSolver(indenter(one.name), block.layer, grid).solve(force_N);
    const Eigen::Vector3d peak = LayerField{block.layer, 0.0}.peak();
    double off = 0.0, of_middle = 0.0;
    for (std::size_t k = 0; k < sensors.size(); k++) {
      if (sensors[k].x_mm < 0.0 || sensors[k].y_mm < 0.0) {
        continue; // a mirror of another
      }
      for (int c = 0; c < 3; c++) {
        const auto added = [&](double radius, double dx, double dy) {
          return 1e-6 * table.added_Pa(k, {double(c == 2), double(c == 0), double(c == 1), radius}, middle.x_mm + dx, middle.y_mm + dy);
        };
        double sum = 0.0;
        for (int i = 0; i < grid.nodes; i++) {
          for (int j = 0; j < grid.nodes; j++) {
            const double p_Pa = contact.pressure_Pa[std::size_t(i * grid.nodes + j)];
            if (p_Pa > 0.0) {
              sum += 1e-6 * grid.step_mm * grid.step_mm * p_Pa / force_N *
                     added(0.0, (i - grid.nodes / 2) * grid.step_mm, (j - grid.nodes / 2) * grid.step_mm);
            }
          }
        }
        off = std::max(off, std::abs(added(radius_mm, 0.0, 0.0) - sum) / peak[c]);
        of_middle = std::max(of_middle, std::abs(added(0.0, 0.0, 0.0) - sum) / peak[c]);
      }
    }
    EXPECT_LT(off, one.allowed) << one.name << ", " << one.overhang_mm << " mm";
    EXPECT_GT(of_middle, one.middle_costs) << one.name << ", " << one.overhang_mm << " mm";
  }
}

TEST(TwinBlock, TheTableIsTheSolution) {
  const Block block = around(12.0, 4.5);
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "block_table";
  std::filesystem::remove_all(folder);
  double done = 0.0; // share
  const std::vector<Place> sensors{{9, 18}, {-9, 18}, {-9, -18}, {0, 9}};
  const BlockTable table = BlockTable::load_or_build(block, sensors, folder, [&](double share) { done = share; });
  EXPECT_EQ(done, 1.0);
  const BlockAnswer answer = solve_block(block, {{-9, 18}}, 0.7)[0]; // other nodes, no mirror
  const Eigen::Vector3d peak = 1e6 * LayerField{block.layer, 0.0}.peak();
  double off = 0.0;
  for (int i = 0; i < answer.nodes_x; i++) {
    for (int j = 0; j < answer.nodes_y; j++) {
      const double x = block.half_x_mm * (2.0 * i / (answer.nodes_x - 1) - 1.0);
      const double y = block.half_y_mm * (2.0 * j / (answer.nodes_y - 1) - 1.0);
      const Eigen::Vector3d here{table.added_Pa(1, {0, 1, 0, 0}, x, y), table.added_Pa(1, {0, 0, 1, 0}, x, y),
                                 table.added_Pa(1, {1, 0, 0, 0}, x, y)};
      off = std::max(off, (here - node(answer, i, j)).cwiseQuotient(peak).lpNorm<Eigen::Infinity>());
    }
  }
  EXPECT_LT(off, 5e-4);
  const BlockTable::Load load{2.0, 0.5, -0.3, 1.0}, mirror_x{2.0, -0.5, -0.3, 1.0}, mirror_both{2.0, -0.5, 0.3, 1.0};
  EXPECT_NEAR(table.added_Pa(0, load, 3.0, 7.0), table.added_Pa(1, mirror_x, -3.0, 7.0), 1e-9);
  EXPECT_NEAR(table.added_Pa(0, load, 3.0, 7.0), table.added_Pa(2, mirror_both, -3.0, -7.0), 1e-9);
  EXPECT_EQ(table.added_Pa(0, {1, 0, 0, 0}, 99.0, 7.0), table.added_Pa(0, {1, 0, 0, 0}, block.half_x_mm, 7.0));
  // From the cache, and again where it is damaged.
  const auto again = [&] {
    done = 0.0;
    const BlockTable read = BlockTable::load_or_build(block, sensors, folder, [&](double share) { done = share; });
    EXPECT_EQ(read.added_Pa(3, load, -1.0, 2.0), table.added_Pa(3, load, -1.0, 2.0));
    return done;
  };
  EXPECT_EQ(again(), 0.0);
  const std::filesystem::path file = std::filesystem::directory_iterator(folder)->path();
  std::fstream(file, std::ios::in | std::ios::out | std::ios::binary).seekp(5000).put('x');
  EXPECT_EQ(again(), 1.0);
  std::filesystem::remove_all(folder);
}

} // namespace fingertip::twin
