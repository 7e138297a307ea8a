// The solver of placements against Ceres: the same cost, written once more with automatic
// derivatives, must have no lower minimum, from another start, and there the same gains.
#include "support/placements.hpp"

#include <ceres/ceres.h>
#include <gtest/gtest.h>

using namespace fingertip::calibrating;
using fingertip::Random;
using test::KnownPad;

constexpr int SENSORS = 15, SENSOR_UNKNOWNS = 6, // log gain, dx, dy, o, b, r
    PROFILE_UNKNOWNS = 9;

// One reading. Blocks: the sensor's, the profile's (log peak, log width, m, q1, q2, h, log B / s, t1, t2), the
// placement's (x, y, e, w, q1, q2).
struct ReadingCost {
  double x_mm, y_mm, reading_Pa, sd_Pa, earlier_Pa;
  template <typename T> bool operator()(const T *sensor, const T *profile, const T *placement, T *residual) const {
    const T u = x_mm + sensor[1] - placement[0], v = y_mm + sensor[2] - placement[1];
    const T q1 = profile[3] + placement[4], q2 = profile[4] + placement[5];
    const T square = u * u + v * v - 2.0 * q1 * (u * u - v * v) - 4.0 * q2 * u * v;
    const T width = exp(profile[1] + sensor[4] + placement[3]);
    const T wide = exp(-square / (2.0 * width * width));
    const T narrow = exp(-square / (2.0 * NARROW * NARROW * width * width));
    T pulled(0.0);
    for (const auto &[strength, ratio] : PULL) {
      pulled += strength * exp(-square / (2.0 * ratio * ratio * width * width));
    }
    const T value =
        exp(sensor[0] + profile[0] + placement[2] - 2.0 * placement[3]) *
        ((1.0 - profile[2]) * wide + profile[2] * narrow - profile[5] * exp(-square / (2.0 * width * width * exp(2.0 * profile[6]))) +
         (profile[7] * u + profile[8] * v) / width * pulled);
    residual[0] = (reading_Pa - value - sensor[3] + sensor[5] * earlier_Pa) / sd_Pa;
    return true;
  }
};

template <int SIZE> struct Prior {
  int at;
  double mean, sd;
  template <typename T> bool operator()(const T *block, T *residual) const {
    residual[0] = (block[at] - mean) / sd;
    return true;
  }
};

template <int SIZE>
static void add_prior(ceres::Problem &problem, double *block, int at, double mean, double sd, ceres::LossFunction *loss = nullptr) {
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Prior<SIZE>, 1, SIZE>(new Prior<SIZE>{at, mean, sd}), loss, block);
}

struct Found {
  double cost;
  std::vector<double> gain;
};

// With the spreads that the solver has learnt.
static Found by_ceres(const Array &array, const std::vector<Placement> &placements, const Solution &solution, Random &start) {
  const Assumptions assumed;
  double peak_Pa = 0.0, near_Pa = 0.0;
  {
    std::vector<double> peaks;
    for (const Placement &placement : placements) {
      peaks.push_back(*std::max_element(placement.reading_Pa.begin(), placement.reading_Pa.end()));
    }
    std::sort(peaks.begin(), peaks.end());
    peak_Pa = peaks[peaks.size() / 2];
    near_Pa = peaks[9 * peaks.size() / 10];
  }
  std::vector<std::array<double, SENSOR_UNKNOWNS>> sensors(SENSORS);
  for (auto &sensor : sensors) {
    sensor.fill(0.0);
    sensor[0] = 0.05 * start.normal();
  }
  std::array<double, PROFILE_UNKNOWNS> profile{std::log(1.1 * peak_Pa), std::log(5.0), 0.1, 0.0, 0.0, 0.0, std::log(DIP_WIDTHS), 0.0, 0.0};
  std::vector<std::array<double, 6>> own(placements.size());
  ceres::Problem problem;
  ceres::LossFunction *huber = new ceres::HuberLoss(HUBER);
  for (std::size_t i = 0; i < placements.size(); i++) {
    own[i] = {solution.placements[i].x_mm + 0.5 * start.normal(), solution.placements[i].y_mm + 0.5 * start.normal(), 0.0, 0.0, 0.0, 0.0};
    for (std::size_t k = 0; k < SENSORS; k++) {
      const double reading = placements[i].reading_Pa[k];
      const double model = assumed.model_share * peak_Pa, share = assumed.reading_share * reading;
      const double sd =
          std::sqrt(placements[i].noise_Pa * placements[i].noise_Pa + solution.excess * solution.excess * (model * model + share * share));
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<ReadingCost, 1, SENSOR_UNKNOWNS, PROFILE_UNKNOWNS, 6>(
                                   new ReadingCost{array.x_mm[k], array.y_mm[k], reading, sd, placements[i].earlier_Pa[k]}),
                               huber, sensors[k].data(), profile.data(), own[i].data());
    }
    add_prior<6>(problem, own[i].data(), 2, 0.0, solution.spread.force, huber);
    add_prior<6>(problem, own[i].data(), 3, 0.0, solution.spread.width, huber);
    add_prior<6>(problem, own[i].data(), 4, 0.0, solution.spread.ellipse, huber);
    add_prior<6>(problem, own[i].data(), 5, 0.0, solution.spread.ellipse, huber);
  }
  for (auto &sensor : sensors) {
    const double zero_Pa = assumed.offset_share * peak_Pa;
    const double sds[] = {assumed.gain, solution.spread.position_mm, solution.spread.position_mm,
                          zero_Pa,      solution.spread.own_width,   assumed.memory};
    for (int at = 0; at < SENSOR_UNKNOWNS; at++) {
      add_prior<SENSOR_UNKNOWNS>(problem, sensor.data(), at, 0.0, sds[at]);
    }
  }
  add_prior<PROFILE_UNKNOWNS>(problem, profile.data(), 0, std::log(near_Pa), assumed.peak);
  add_prior<PROFILE_UNKNOWNS>(problem, profile.data(), 2, assumed.mixing, assumed.mixing_sd);
  add_prior<PROFILE_UNKNOWNS>(problem, profile.data(), 3, 0.0, assumed.ellipse_of_all);
  add_prior<PROFILE_UNKNOWNS>(problem, profile.data(), 4, 0.0, assumed.ellipse_of_all);
  add_prior<PROFILE_UNKNOWNS>(problem, profile.data(), 5, 0.0, assumed.dip);
  add_prior<PROFILE_UNKNOWNS>(problem, profile.data(), 6, std::log(DIP_WIDTHS), assumed.dip_log_sd);
  add_prior<PROFILE_UNKNOWNS>(problem, profile.data(), 7, 0.0, assumed.pull);
  add_prior<PROFILE_UNKNOWNS>(problem, profile.data(), 8, 0.0, assumed.pull);

  ceres::Solver::Options options;
  options.max_num_iterations = 500;
  options.function_tolerance = 1e-14;
  options.parameter_tolerance = 1e-14;
  options.gradient_tolerance = 1e-12;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  Found found{summary.final_cost, {}};
  double mean = 0.0;
  for (const auto &sensor : sensors) {
    found.gain.push_back(std::exp(sensor[0]));
    mean += found.gain.back() / SENSORS;
  }
  for (double &gain : found.gain) {
    gain /= mean;
  }
  return found;
}

/* Ceres, which starts off the solution, may end in another minimum, and so may the solver. */
TEST(Calibration, finds_the_minimum_that_ceres_finds) {
  int same = 0;
  for (std::uint64_t seed = 1; seed <= 12; seed++) {
    const KnownPad pad(seed, 0.1, seed % 2 ? 0.0 : 0.1);
    auto placements = test::good_session(pad, 12 + 2 * seed, seed);
    if (seed % 3 == 0) { // one that does not belong, which stays
      for (double &reading : placements[5].reading_Pa) {
        reading *= 1.08;
      }
    }
    for (std::size_t i = 0; i < placements.size(); i++) {
      placements[i].earlier_Pa = i ? placements[i - 1].reading_Pa : std::vector<double>(SENSORS);
    }
    const Solution solution = solve(pad.array, placements, true);
    ASSERT_TRUE(solution.solved);
    Random start(seed, 7, 0);
    const Found found = by_ceres(pad.array, placements, solution, start);
    EXPECT_LT(solution.cost, found.cost * 1.1) << seed;
    if (std::abs(found.cost / solution.cost - 1.0) > 1e-6) {
      continue;
    }
    same++;
    for (std::size_t k = 0; k < SENSORS; k++) {
      EXPECT_NEAR(solution.gain[k], found.gain[k], 2e-4) << seed << " " << k;
    }
  }
  EXPECT_GE(same, 9);
}
