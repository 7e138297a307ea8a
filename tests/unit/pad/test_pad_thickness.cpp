#include "library/pad/profile.hpp"
#include "report/measure/sessions.hpp"

#include <gtest/gtest.h>

using namespace fingertip;

constexpr measure::PadOptions USUAL{.memory_percent = 1.0, .misplaced_mm = 0.1};

/* Of a session of 24 placements on a pad of the twin. */
static pad::Thickness found_on(double layer_mm, const measure::PadOptions &options, std::uint64_t seed) {
  const measure::Feet feet(layer_mm, FINGERTIP_TABLES_DIR);
  measure::SessionPad pad(options, layer_mm, seed);
  measure::Session session(feet, measure::SessionKind::good, seed, 24);
  std::vector<calibrating::Placement> placements;
  while (auto placement = session.next(pad)) {
    placements.push_back(*placement);
  }
  const auto solution = calibrating::solve(measure::session_array(), placements);
  EXPECT_TRUE(solution.solved);
  return pad::thickness_of(solution.sigma_mm, solution.sigma_sd_mm);
}

TEST(PadThickness, IsThatOfTheRubber) {
  const measure::PadOptions like_real{.gain_percent = 20.0, .misplaced_mm = 0.1, .dip_percent = 5.0, .widths_percent = 3.5};
  const measure::PadOptions kinds[] = {{}, USUAL, like_real};
  for (const double layer_mm : {9.0, 12.0, 15.0}) {
    for (std::uint64_t seed = 0; seed < 6; seed++) {
      const pad::Thickness found = found_on(layer_mm, kinds[seed % 3], 7000 + seed);
      EXPECT_NEAR(found.mm, layer_mm, 0.05 * layer_mm) << layer_mm << " " << seed;
      EXPECT_LT(found.sd_mm, 0.075 * layer_mm);
      EXPECT_TRUE(found.agrees_with(layer_mm));
      EXPECT_EQ(pad::disagreement(found, layer_mm), "");
    }
  }
}

TEST(PadThickness, OneSetWrongBy15PercentIsSaid) {
  for (std::uint64_t seed = 0; seed < 6; seed++) {
    const pad::Thickness found = found_on(12.0, USUAL, 7100 + seed);
    for (const double set_mm : {12.0 * 0.85, 12.0 * 1.15}) {
      EXPECT_FALSE(found.agrees_with(set_mm));
      EXPECT_NE(pad::disagreement(found, set_mm).find(text_of(found)), std::string::npos);
    }
  }
}

TEST(PadThickness, AProfileFollowsWhereAFingertipWantsOne) {
  wire_info info{};
  info.capabilities = WIRE_CAPABILITY_TANGENTIAL;
  calibration made{};
  made.sigma_um = 5500;
  made.sigma_sd_um = 60;
  EXPECT_TRUE(pad::thickness_for_profile(info, made));
  info.stored = WIRE_STORED_PAD;
  EXPECT_FALSE(pad::thickness_for_profile(info, made));
  info = {};
  EXPECT_FALSE(pad::thickness_for_profile(info, made));
  info.capabilities = WIRE_CAPABILITY_TANGENTIAL;
  made.sigma_um = 2900; /* some 6 mm of rubber */
  EXPECT_FALSE(pad::thickness_for_profile(info, made));
}

TEST(PadThickness, AWiderResponseIsThickerRubber) {
  double before_mm = 0.0;
  for (double sigma_mm = 2.0; sigma_mm < 12.0; sigma_mm += 0.5) {
    const pad::Thickness found = pad::thickness_of(sigma_mm, 0.02);
    EXPECT_GT(found.mm, before_mm);
    EXPECT_GT(pad::thickness_of(sigma_mm, 0.5).sd_mm, found.sd_mm);
    before_mm = found.mm;
  }
}

TEST(PadThickness, ACalibrationWithoutAWidthTellsNone) {
  calibration made{};
  EXPECT_FALSE(pad::thickness_of(made));
  made.sigma_um = 5590;
  made.sigma_sd_um = 20;
  EXPECT_NEAR(pad::thickness_of(made)->mm, 12.0, 0.3);
}
