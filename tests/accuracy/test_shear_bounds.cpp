/* The Cramer-Rao bounds of the report on tangential load, held to what the estimate's noise is. */
#include "shear/static/bounds.hpp"

#include <cmath>
#include <gtest/gtest.h>

namespace fingertip::shear {
namespace {

constexpr double NOISE_Pa = 4.0;

twin::Touch touch_at(double x_mm, double y_mm) {
  twin::Touch touch;
  touch.x_mm = x_mm;
  touch.y_mm = y_mm;
  touch.force_N = 5.0;
  touch.pull_x_N = 1.0;
  touch.pull_y_N = -0.5;
  return touch;
}

class Bounds : public ::testing::Test {
protected:
  Bound bound(const twin::Touch &touch, const Errors &errors, Told told) {
    return bound_of(array_, profile_, touch, errors, told);
  }
  fit_array array_ = truth::firmware_array();
  pad_profile profile_ = profile_of(12.0);
};

/* Readings of the profile's own model, so that nothing but noise is in the errors. */
Readings model_Pa(const fit_array &array, const pad_profile &profile, const twin::Touch &touch) {
  Readings readings{};
  for (std::size_t k = 0; k < SENSORS; k++) {
    const double dx = 9.0 * static_cast<double>(array.x[k]) - touch.x_mm;
    const double dy = 9.0 * static_cast<double>(array.y[k]) - touch.y_mm;
    const double r2 = dx * dx + dy * dy;
    for (const auto &term : profile.normal) {
      const double v = std::pow(static_cast<double>(term.sd_mm), 2) + 4.0;
      readings[k] +=
          1e6 * touch.force_N * static_cast<double>(term.share) * std::exp(-r2 / (2.0 * v)) / (2.0 * M_PI * v);
    }
    for (const auto &term : profile.tangential) {
      const double v = std::pow(static_cast<double>(term.sd_mm), 2) + 1.3 * 4.0;
      readings[k] += 1e6 * (touch.pull_x_N * dx + touch.pull_y_N * dy) * static_cast<double>(term.moment_mm) *
                     std::exp(-r2 / (2.0 * v)) / (2.0 * M_PI * v * v);
    }
  }
  return readings;
}

TEST_F(Bounds, TheEstimatesNoiseIsWhatTheyAllow) {
  Fingertip fingertip(profile_);
  const KnownPad pad{truth::perfect_pad(), {}};
  for (const auto &[x_mm, y_mm] : {std::pair{0.0, 0.0}, {4.0, -3.0}, {-6.0, 8.0}, {2.0, 14.0}}) {
    const twin::Touch touch = touch_at(x_mm, y_mm);
    const Readings readings = model_Pa(array_, profile_, touch);
    Random random(1, 2, 3);
    constexpr int FRAMES = 3000;
    Eigen::Vector2d ratio_sum = Eigen::Vector2d::Zero(), place_sum = ratio_sum;
    Eigen::Matrix2d ratio_squares = Eigen::Matrix2d::Zero(), place_squares = ratio_squares;
    for (int i = 0; i < FRAMES; i++) {
      Said said;
      ASSERT_TRUE(fingertip.feel(readings, pad, NOISE_Pa, ALL_SENSORS, random, said));
      ASSERT_TRUE(said.valid);
      const Eigen::Vector2d ratio(said.qx, said.qy), place(said.x_mm, said.y_mm);
      ratio_sum += ratio / FRAMES;
      place_sum += place / FRAMES;
      ratio_squares += ratio * ratio.transpose() / FRAMES;
      place_squares += place * place.transpose() / FRAMES;
    }
    const Bound least = bound(touch, {NOISE_Pa, nullptr, 0.0}, Told::nothing);
    const Eigen::Matrix2d ratio = ratio_squares - ratio_sum * ratio_sum.transpose();
    const Eigen::Matrix2d place = place_squares - place_sum * place_sum.transpose();
    for (int i = 0; i < 2; i++) {
      const double ratio_share = std::sqrt(ratio(i, i) / least.ratio(i, i));
      const double place_share = std::sqrt(place(i, i) / least.place_mm2(i, i));
      EXPECT_GT(ratio_share, 0.85) << x_mm << " " << y_mm; /* its priors are worth some per cent */
      EXPECT_LT(ratio_share, 1.1) << x_mm << " " << y_mm;
      EXPECT_GT(place_share, 0.85) << x_mm << " " << y_mm;
      EXPECT_LT(place_share, 1.1) << x_mm << " " << y_mm;
    }
  }
}

TEST_F(Bounds, GoWithTheErrors) {
  const twin::Touch touch = touch_at(3.0, 5.0);
  const Bound one = bound(touch, {4.0, nullptr, 0.0}, Told::nothing);
  const Bound two = bound(touch, {8.0, nullptr, 0.0}, Told::nothing);
  EXPECT_LT((two.ratio - 4.0 * one.ratio).norm(), 1e-6 * two.ratio.norm());
  EXPECT_LT((two.place_mm2 - 4.0 * one.place_mm2).norm(), 1e-6 * two.place_mm2.norm());
  Readings gain_sd;
  gain_sd.fill(0.02);
  const Bound gains = bound(touch, {4.0, &gain_sd, 0.0}, Told::nothing);
  EXPECT_GT(gains.ratio.trace(), 2.0 * one.ratio.trace());
  /* A model's error is a share of the peak: it does not fall with the force, noise's does. */
  twin::Touch light = touch;
  light.force_N = 0.5 * touch.force_N;
  light.pull_x_N = 0.5 * touch.pull_x_N;
  light.pull_y_N = 0.5 * touch.pull_y_N;
  const Bound model = bound(touch, {1e-3, nullptr, 0.01}, Told::nothing);
  const Bound light_model = bound(light, {1e-3, nullptr, 0.01}, Told::nothing);
  EXPECT_NEAR(light_model.ratio.trace() / model.ratio.trace(), 1.0, 1e-3);
  const Bound light_noise = bound(light, {4.0, nullptr, 0.0}, Told::nothing);
  EXPECT_NEAR(light_noise.ratio.trace() / one.ratio.trace(), 4.0, 1e-3);
}

TEST_F(Bounds, KnowledgeTakesThemDown) {
  const twin::Touch touch = touch_at(8.0, 16.0);
  const Errors errors{NOISE_Pa, nullptr, 0.003};
  const double nothing = bound(touch, errors, Told::nothing).ratio.trace();
  const double priors = bound(touch, errors, Told::priors).ratio.trace();
  const double round = bound(touch, errors, Told::round).ratio.trace();
  EXPECT_LT(priors, 0.95 * nothing);
  EXPECT_LT(round, 0.8 * priors);
}

TEST_F(Bounds, AreAsSymmetricAsTheArray) {
  const Errors errors{NOISE_Pa, nullptr, 0.001};
  const Bound here = bound(touch_at(4.0, 7.0), errors, Told::priors);
  twin::Touch mirrored = touch_at(-4.0, -7.0);
  mirrored.pull_x_N *= -1.0;
  mirrored.pull_y_N *= -1.0;
  const Bound there = bound(mirrored, errors, Told::priors);
  EXPECT_LT((here.ratio - there.ratio).norm(), 1e-6 * here.ratio.norm());
  EXPECT_LT((here.place_mm2 - there.place_mm2).norm(), 1e-6 * here.place_mm2.norm());
}

} // namespace
} // namespace fingertip::shear
