#include "libfingertip/error.hpp"
#include "library/pad/layer.hpp"
#include "library/pad/profile.hpp"
#include "support/host_packets.hpp"

#include <cmath>
#include <functional>
#include <gtest/gtest.h>

using namespace fingertip;

const wire_info INFO = test::make_info(0, 0).body.info;

static pad_profile profile_of(double thickness_mm) { return pad::profile_of({thickness_mm}, INFO); }

/* The integral of f over wave numbers, by the trapezoidal rule of other nodes than the profile's. */
static double over_waves(const std::function<double(double)> &f) {
  double sum = 0;
  for (int i = 1; i < 30000; i++) {
    sum += 0.001 * f(0.001 * i);
  }
  return sum;
}

constexpr double h_mm = 10;

static double normal_of(const pad_profile &pad, double H) {
  double sum = 0;
  for (const auto &term : pad.normal) {
    sum += double(term.share) * std::exp(-0.5 * std::pow(H * double(term.sd_mm) / h_mm, 2));
  }
  return sum;
}

static double tangential_of(const pad_profile &pad, double H) {
  double sum = 0;
  for (const auto &term : pad.tangential) {
    sum += H * double(term.moment_mm) / h_mm * std::exp(-0.5 * std::pow(H * double(term.sd_mm) / h_mm, 2));
  }
  return sum;
}

/* Relative errors over the plane. By Parseval's theorem that of the waves is that of the pressure. */
struct Misfit {
  double normal, tangential;
};
static Misfit misfit_of(const pad_profile &pad) {
  auto T = [](double H) { return twin::base_transfer(H, 0.49); };
  auto Q = [](double H) { return twin::tangential_transfer(H, 0.49); };
  return {std::sqrt(over_waves([&](double H) { return H * std::pow(T(H) - normal_of(pad, H), 2); }) /
                    over_waves([&](double H) { return H * T(H) * T(H); })),
          std::sqrt(over_waves([&](double H) { return H * std::pow(Q(H) - tangential_of(pad, H), 2); }) /
                    over_waves([&](double H) { return H * Q(H) * Q(H); }))};
}

TEST(PadProfile, HoldsTheLayerWithinItsError) {
  pad_profile pad = profile_of(h_mm);
  EXPECT_TRUE(pad_profile_is_valid(&pad));
  EXPECT_LT(misfit_of(pad).normal, 0.0180);
  EXPECT_LT(misfit_of(pad).tangential, 0.0120);
}

TEST(PadProfile, GrowsWithTheThickness) {
  const pad_profile thin = profile_of(6), thick = profile_of(12);
  for (int j = 0; j < PAD_NORMAL_TERMS; j++) {
    EXPECT_FLOAT_EQ(thick.normal[j].share, thin.normal[j].share);
    EXPECT_FLOAT_EQ(thick.normal[j].sd_mm, 2 * thin.normal[j].sd_mm);
  }
  for (int j = 0; j < PAD_TANGENTIAL_TERMS; j++) {
    EXPECT_FLOAT_EQ(thick.tangential[j].moment_mm, 2 * thin.tangential[j].moment_mm);
    EXPECT_FLOAT_EQ(thick.tangential[j].sd_mm, 2 * thin.tangential[j].sd_mm);
  }
  for (double thickness_mm : {double(PAD_THICKNESS_MIN_mm), double(PAD_THICKNESS_MAX_mm)}) {
    pad_profile pad = profile_of(thickness_mm);
    EXPECT_TRUE(pad_profile_is_valid(&pad)) << thickness_mm;
  }
}

/* Contacts' tails are no Gaussian's: 0.90 to 0.97 of the force is held on 6 to 12 mm. */
TEST(PadProfile, KnowsWhatAGaussianHoldsOfTheForce) {
  for (double thickness_mm : {6.0, 9.0, 12.0}) {
    const float ratio = profile_of(thickness_mm).force_ratio;
    EXPECT_GT(ratio, 0.86F) << thickness_mm;
    EXPECT_LT(ratio, 0.98F) << thickness_mm;
  }
}

TEST(PadProfile, HasWhatItIsTold) {
  pad_profile pad = pad::profile_of({12, 9.5, true}, INFO);
  EXPECT_EQ(pad.thickness_mm, 12);
  EXPECT_EQ(pad.overhang_mm, 9.5F);
  EXPECT_EQ(pad.from_touch, 1);
  EXPECT_EQ(pad.tangential_scale, 1);
  pad = profile_of(12);
  EXPECT_EQ(pad.overhang_mm, 0);
  EXPECT_EQ(pad.from_touch, 0);
}

TEST(PadProfile, RefusesWhatIsNoPad) {
  for (double thickness_mm : {double(PAD_THICKNESS_MIN_mm) - 0.1, 20.1, -1.0, double(NAN)}) {
    EXPECT_THROW(profile_of(thickness_mm), Error) << thickness_mm;
  }
  EXPECT_THROW(pad::profile_of({12, -1}, INFO), Error);
  EXPECT_THROW(pad::profile_of({12, 101}, INFO), Error);
  wire_info two = INFO;
  two.sensor_count = 2;
  EXPECT_THROW(pad::profile_of({12}, two), Error);
}

TEST(PadProfile, KnowsWhenEdgesSpoilTheZero) {
  EXPECT_FALSE(pad::edges_spoil_the_zero({12}));
  EXPECT_FALSE(pad::edges_spoil_the_zero({12, 6}));
  EXPECT_TRUE(pad::edges_spoil_the_zero({12, 5.9}));
}
