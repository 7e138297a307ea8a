/* The bound of the report on two contacts, held to what the most likely answer reaches where
 * nothing but the bound's own errors is in the readings: both models fitted from several starts,
 * and two where the pair leaves less than the long contact by as much as keeps false_two. */
#include "two/touches/bound.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <vector>

namespace fingertip::two {
namespace {

constexpr Right RIGHT{1.5, 0.1, 0.02};
constexpr int DRAWS = 150;

class TwoBound : public ::testing::Test {
protected:
  Column disturbed(const Column &readings, const Column &weights) {
    Column Pa = readings;
    for (Eigen::Index k = 0; k < Pa.size(); k++) {
      Pa[k] += random_.normal() / weights[k];
    }
    return Pa;
  }

  /* How much less the pair leaves than the line, and the pair. */
  std::pair<double, Unknowns<PAIR>> looked_at(const Column &readings, const Column &weights, const Unknowns<PAIR> &near,
                                              const Unknowns<LINE> &line) {
    Unknowns<PAIR> wider = near;
    wider.segment<2>(0) += 0.3 * (near.segment<2>(0) - near.segment<2>(3));
    wider.segment<2>(3) += 0.3 * (near.segment<2>(3) - near.segment<2>(0));
    Fitted<PAIR> pair = fitted<PAIR>(rubber_, readings, weights, near);
    const Fitted<PAIR> other = fitted<PAIR>(rubber_, readings, weights, wider);
    pair = other.left < pair.left ? other : pair;
    double left = HUGE_VAL;
    for (const Unknowns<LINE> &start : {line, line_like(near), line_like(pair.at)}) {
      left = std::min(left, fitted<LINE>(rubber_, readings, weights, start).left);
    }
    return {left - pair.left, pair.at};
  }

  /* Share of the touches of this pair in which the most likely answer is right. */
  double reached(const Unknowns<PAIR> &pair, const ReadingErrors &errors, const Unknowns<LINE> &line) {
    const Column readings = rubber_.readings_Pa(pair), weights = per_sd(readings, errors);
    const Column of_line = rubber_.readings_Pa(line);
    std::vector<double> less;
    for (int n = 0; n < DRAWS; n++) {
      less.push_back(looked_at(disturbed(of_line, weights), weights, pair, line).first);
    }
    std::sort(less.begin(), less.end());
    const double enough = less[std::size_t((1.0 - RIGHT.false_two) * DRAWS)];
    int right = 0;
    for (int n = 0; n < DRAWS; n++) {
      const auto [by, found] = looked_at(disturbed(readings, weights), weights, pair, line);
      right += by > enough && is_right(RIGHT, pair, found);
    }
    return double(right) / DRAWS;
  }

  fit_array array_ = truth::firmware_array();
  pad_profile profile_ = shear::profile_of(12.0);
  shear::Objects objects_{FINGERTIP_TABLES_DIR};
  Rubber rubber_{array_, profile_, objects_.on(12.0, "sphere6"), 0.0125};
  Random random_{1, 2, 3};
};

TEST_F(TwoBound, TheMostLikelyAnswerIsNearIt) {
  ReadingErrors errors{2.0, {}, 0.004};
  errors.gain_sd.fill(0.005);
  double all = 0.0, possible = 0.0;
  for (const double apart : {6.0, 7.0, 8.0}) {
    Unknowns<PAIR> pair;
    pair << -2.0, 0.0, 3.0, -2.0 + 0.5 * apart, std::sqrt(0.75) * apart, 3.0;
    const PairBound bound = bound_of(rubber_, pair, errors, RIGHT, random_);
    const double limit = std::min(bound.placed, bound.told);
    const double share = reached(pair, errors, bound.line);
    std::printf("%g mm: placed %.2f, told %.2f, reached %.2f\n", apart, bound.placed, bound.told, share);
    EXPECT_LE(share, limit + 0.12); /* three standard deviations of the draws */
    all += share;
    possible += limit;
  }
  EXPECT_GT(all, 0.75 * possible);
}

TEST_F(TwoBound, FallsWithDistanceAndWithEachError) {
  const auto limit = [&](double apart_mm, double noise_Pa, double gain_sd, double model_share) {
    Unknowns<PAIR> pair;
    pair << -1.0, 2.0, 3.0, -1.0 + 0.6 * apart_mm, 2.0 + 0.8 * apart_mm, 3.0;
    ReadingErrors errors{noise_Pa, {}, model_share};
    errors.gain_sd.fill(gain_sd);
    const PairBound bound = bound_of(rubber_, pair, errors, RIGHT, random_);
    return std::min(bound.placed, bound.told);
  };
  EXPECT_GT(limit(8.0, 0.1, 0.0, 0.0), 0.99);
  EXPECT_LT(limit(8.0, 0.1, 0.0, 0.02), 0.5);
  EXPECT_LT(limit(8.0, 0.1, 0.05, 0.0), 0.5);
  EXPECT_LT(limit(8.0, 500.0, 0.0, 0.0), 0.5);
  EXPECT_LT(limit(6.0, 2.0, 0.005, 0.004), limit(12.0, 2.0, 0.005, 0.004) - 0.3);
}

} // namespace
} // namespace fingertip::two
