#include "support/placements.hpp"
#include "tool/calibration/gain_session.hpp"
#include "tool/calibration/judge.hpp"

#include <functional>
#include <gtest/gtest.h>
#include <numeric>

using namespace fingertip::calibrating;
using fingertip::Random;
using test::good_session;
using test::KnownPad;
using State = Judgement::State;

/* Of thirty placements, each made by `press` on pad and placements of this seed. */
static std::vector<Placement> session(const KnownPad &pad, std::uint64_t seed, std::size_t count,
                                      const std::function<KnownPad::Press(Random &random, int i)> &press,
                                      const std::function<void(Placement &placement, int i)> &change = {}) {
  Random random(seed, 5, 0);
  std::vector<Placement> placements;
  for (int i = 0; i < static_cast<int>(count); i++) {
    placements.push_back(pad.place(press(random, i), 4.0 * i, random));
    if (change) {
      change(placements.back(), i);
    }
  }
  return placements;
}

static Judgement judged(std::uint64_t seed, const std::function<KnownPad::Press(Random &random, int i)> &press,
                        const std::function<void(Placement &placement, int i)> &change = {}, std::size_t count = 30) {
  const KnownPad pad(seed);
  return judge(pad.array, session(pad, seed, count, press, change), true);
}

static KnownPad::Press within(Random &random, double x_mm, double low_mm, double high_mm) {
  const double x = random.uniform(-x_mm, x_mm);
  return {x, random.uniform(low_mm, high_mm)};
}

static KnownPad::Press anywhere(Random &random, int = 0) { return within(random, 9.0, -18.0, 18.0); }

static KnownPad::Press lying(Random &random, double axes) {
  KnownPad::Press press = anywhere(random);
  press.axes = axes;
  press.slant = random.uniform(0.0, M_PI);
  return press;
}

/* Anywhere, with this of it in even and in odd placements. */
static std::function<KnownPad::Press(Random &, int)> with(double KnownPad::Press::*what, double even, double odd) {
  return [=](Random &random, int i) {
    KnownPad::Press press = anywhere(random);
    press.*what = i % 2 ? odd : even;
    return press;
  };
}

static void alternate(Placement &placement, double off_Pa) {
  for (std::size_t k = 0; k < 15; k++) {
    placement.reading_Pa[k] += k % 2 ? off_Pa : -off_Pa;
  }
}

static double rms(const std::vector<double> &values) {
  return std::sqrt(std::inner_product(values.begin(), values.end(), values.begin(), 0.0) / double(values.size()));
}

static void expect_refused(const Judgement &judgement, Reason reason, const std::string &words) {
  EXPECT_EQ(judgement.state, State::refused) << judgement.text;
  EXPECT_STREQ(name_of(judgement.reason), name_of(reason)) << judgement.text;
  EXPECT_NE(judgement.text.find(words), std::string::npos) << judgement.text;
}

TEST(Judge, accepts_good_sessions) {
  for (std::uint64_t seed = 40; seed < 60; seed++) {
    const Judgement judgement = judged(seed, anywhere, {}, 36);
    EXPECT_EQ(judgement.state, State::good) << seed << judgement.text;
    EXPECT_STREQ(name_of(judgement.reason), "none");
    EXPECT_LE(judgement.solution.worst_shape_sd(), judgement.wanted_sd);
  }
}

/* With the width that is expected such a dip looks like zeros that were off by more than OFFSET_MAX. */
TEST(Judge, accepts_a_dip_narrower_than_expected) {
  for (std::uint64_t seed = 160; seed < 170; seed++) {
    KnownPad pad(seed);
    pad.dip = 0.09;
    pad.dip_mm = 14.0;
    const Judgement judgement = judge(pad.array, good_session(pad, 36, seed), true);
    EXPECT_EQ(judgement.state, State::good) << seed << judgement.text;
    EXPECT_LT(rms(judgement.solution.offset_Pa) / judgement.solution.peak_Pa, OFFSET_MAX);
    EXPECT_NEAR(judgement.solution.dip_sd_mm, pad.dip_mm, 2.5); /* five widths, some 27, are expected */
  }
}

TEST(Judge, names_a_sensor_without_readings_before_long) {
  const KnownPad pad(62);
  auto placements = good_session(pad, 8, 62);
  for (Placement &placement : placements) {
    placement.usable &= ~(1u << 7);
  }
  expect_refused(judge(pad.array, placements, false), Reason::silent, "sensors 7 measured nothing");
  placements.back().usable |= 1u << 7;
  EXPECT_EQ(judge(pad.array, placements, false).state, State::more);
}

TEST(Judge, names_a_sensor_that_measures_nothing) {
  for (std::uint64_t seed = 62; seed < 72; seed++) {
    const auto silence = [&](Placement &placement, int) { placement.reading_Pa[seed % 15] = 0.0; };
    expect_refused(judged(seed, anywhere, silence, 20), Reason::silent, "sensors " + std::to_string(seed % 15) + " measured nothing");
  }
}

/* Saturated wherever it has a load: a reading that is no measurement, as the finder leaves it, is not one of nothing. */
TEST(Judge, does_not_take_what_a_sensor_missed_for_nothing) {
  for (std::uint64_t seed = 62; seed < 72; seed++) {
    const auto saturate = [](Placement &placement, int) {
      if (placement.reading_Pa[7] > 0.2 * KnownPad::PEAK_Pa) {
        placement.usable &= ~(1u << 7);
        placement.reading_Pa[7] = 0.0;
      }
    };
    EXPECT_NE(judged(seed, anywhere, saturate).reason, Reason::silent) << seed;
  }
}

TEST(Judge, asks_for_more_until_it_is_good) {
  const KnownPad pad(61);
  const auto placements = good_session(pad, PLACEMENTS_MAX, 61);
  State state = State::more;
  std::size_t count = 0;
  while (state == State::more && count < placements.size()) {
    count++;
    const Judgement judgement = judge(pad.array, {placements.begin(), placements.begin() + std::ptrdiff_t(count)}, false);
    state = judgement.state;
    EXPECT_EQ(state == State::more, !judgement.unsure.empty() || count < PLACEMENTS_WANTED);
  }
  EXPECT_EQ(state, State::good);
  EXPECT_GE(count, PLACEMENTS_WANTED);
  EXPECT_LE(count, 40u);
}

TEST(Judge, refuses_with_the_reason) {
  const struct {
    Reason reason;
    const char *words;
    std::uint64_t seed;
    std::function<KnownPad::Press(Random &random, int i)> press;
    std::function<void(Placement &placement, int i)> change = {};
    std::size_t count = 30;
  } cases[] = {
      {Reason::elongated, "round", 62, [](Random &random, int) { return lying(random, 1.25); }},
      {Reason::elongated, "round", 63, with(&KnownPad::Press::axes, 1.25, 1.25)},
      {Reason::offsets, "tare", 64, anywhere, [](Placement &placement, int) { alternate(placement, 500.0); }},
      {Reason::drift, "warm up", 65, anywhere,
       [](Placement &placement, int) {
         for (int k = 0; k < 15; k++) {
           placement.rest_Pa.push_back(1e5 + (k % 2 ? 100.0 : -100.0) * placement.t_s);
         }
       }},
      {Reason::slope, "level the pad", 75, with(&KnownPad::Press::slope, 0.5, 0.5)},
      {Reason::weights, "same weight", 66, with(&KnownPad::Press::force, 1.3, 1.0)},
      {Reason::one_end, "part of the pad", 67, [](Random &random, int) { return within(random, 9.0, 6.0, 18.0); }},
      {Reason::cluster, "near one place", 68, [](Random &random, int) { return within(random, 5.0, -5.0, 5.0); }},
      {Reason::too_few, "(7)", 69, anywhere, {}, 7},
      /* Two of five lean or lie. */
      {Reason::stray, "of the placements fit each other", 71,
       [](Random &random, int i) { return i % 5 < 2 ? lying(random, 1.8) : anywhere(random); }},
      /* Every other placement finds another gain at one sensor: as a cable that touches now and then. */
      {Reason::halves, "every other placement", 74, anywhere,
       [](Placement &placement, int i) { placement.reading_Pa[7] *= i % 2 ? 0.95 : 1.05; }, 44},
  };
  for (const auto &each : cases) {
    const Judgement judgement = judged(each.seed, each.press, each.change, each.count);
    expect_refused(judgement, each.reason, each.words);
  }
  expect_refused(judge(KnownPad(70).array, {}, true), Reason::too_few, "no placement was found");
}

/* Thin rubber, a sensor or two measure a placement: gains that are not known are stated so, and with a dip the
 * firmware's fit would go astray. */
TEST(Judge, keeps_what_many_placements_determine) {
  KnownPad pad(73);
  pad.dip = 0.05;
  for (std::size_t count : {32u, 44u}) {
    const auto placements = session(pad, 73, count, with(&KnownPad::Press::width_mm, 2.4, 2.4));
    const Judgement judgement = judge(pad.array, placements, true);
    EXPECT_EQ(judgement.state, State::good) << judgement.text;
    EXPECT_STREQ(name_of(judgement.reason), "unsure");
    EXPECT_NE(judgement.text.find("good "), std::string::npos) << judgement.text;
    EXPECT_EQ(judgement.kept.gain_sd[3], Assumptions{}.gain);
    EXPECT_GT(judgement.kept.reading_sd[3], 2.0 * judgement.solution.reading_sd[3]);
    EXPECT_NEAR(judgement.solution.sigma_mm, 2.4, 0.3);
    EXPECT_EQ(judgement.kept.dip_share, 0.0);
    EXPECT_GT(solve(pad.array, placements).dip_share, 0.01);
  }
}

/* Presses as the solution has them are located well with this dip, the placements are not. */
TEST(Judge, keeps_no_dip_with_which_placements_go_astray) {
  KnownPad pad(5, 0.05);
  pad.dip = 0.07;
  pad.dip_mm = 10.0;
  const auto placements = session(pad, 5, 24, with(&KnownPad::Press::width_mm, 2.8, 2.8));
  EXPECT_EQ(judge(pad.array, placements, true).kept.dip_share, 0.0);
  EXPECT_GT(solve(pad.array, placements).dip_share, 0.05);
}

/* Of sensors that are alike: nothing of the gains, the places and the own widths. */
TEST(Judge, keeps_width_and_dip_alone_where_gains_help_nothing) {
  int kept = 0;
  for (std::uint64_t seed = 80; seed < 90; seed++) {
    KnownPad pad(seed, 0.0);
    pad.dip = 0.05;
    const Judgement judgement = judge(pad.array, good_session(pad, 44, seed), true);
    if (judgement.text.find("width and dip alone") == std::string::npos) {
      continue;
    }
    kept++;
    EXPECT_EQ(judgement.state, State::good);
    EXPECT_STREQ(name_of(judgement.reason), "useless");
    const calibration stored = calibration_of(judgement.kept, std::nullopt, 0);
    for (std::size_t k = 0; k < 15; k++) {
      EXPECT_EQ(stored.sensors[k].gain, 1.0f);
      EXPECT_EQ(stored.sensors[k].off_x_um, 0);
      EXPECT_EQ(stored.sensors[k].off_y_um, 0);
      EXPECT_EQ(stored.sensors[k].wider_q15, 0);
      EXPECT_NE(judgement.solution.gain[k], 1.0);
    }
    EXPECT_GT(stored.sigma_um, 0);
  }
  EXPECT_GT(kept, 0);
}

TEST(Judge, refuses_sensors_in_other_places) {
  KnownPad pad(72);
  for (std::size_t k = 0; k < 15; k++) {
    pad.x_mm[k] += k % 2 ? 0.8 : -0.8;
    pad.y_mm[k] += k % 3 ? 0.8 : -0.8;
  }
  expect_refused(judge(pad.array, good_session(pad, 30, 72), true), Reason::layout, "pad that it was built for");
}

TEST(Force, one_known_weight_gives_the_scale) {
  const KnownPad pad(75);
  const auto placements = good_session(pad, 30, 75);
  const Solution s = solve(pad.array, placements);
  const auto scale = force_scale(pad.array, placements, s, 3.0, {});
  ASSERT_TRUE(scale);
  const auto twice = force_scale(pad.array, placements, s, 6.0, {});
  EXPECT_NEAR(twice->scale, 2.0 * scale->scale, 1e-12);
  EXPECT_NEAR(twice->sd, 2.0 * scale->sd, 1e-12);
  /* The force under the bump is 2 pi PEAK s^2 n / (n - 1), of which a Gaussian holds most. */
  const double under_N = 2e-6 * M_PI * KnownPad::PEAK_Pa * 5.5 * 5.5 * 12.0 / 11.0;
  const double right = force_scale(pad.array, placements, s, under_N, {})->scale;
  EXPECT_GT(right, 1.0);
  EXPECT_LT(right, 1.15);
  EXPECT_FALSE(force_scale(pad.array, {}, Solution{}, 3.0, {}));
  /* A fit with a prior on a narrower contact says less, and its scale makes up for it. */
  const auto narrower = force_scale(pad.array, placements, s, 3.0, {3.1, 0.1});
  EXPECT_GT(narrower->scale, 1.03 * scale->scale);
  /* Rubber that loses 4 % in the half second: a tap may be off by more than that. */
  auto fading = placements;
  for (Placement &placement : fading) {
    placement.fading = 0.04;
  }
  const auto faded = force_scale(pad.array, fading, s, 3.0, {});
  EXPECT_EQ(faded->scale, scale->scale);
  EXPECT_GT(faded->sd / faded->scale, 0.08);
  EXPECT_LT(faded->sd / faded->scale, 0.14);
  EXPECT_LT(scale->sd / scale->scale, 0.02);
}

TEST(Scatter, gains_bring_the_placements_together) {
  const KnownPad pad(76);
  const auto placements = good_session(pad, 30, 76);
  const Solution s = solve(pad.array, placements);
  const std::vector<double> ones(pad.array.sensors(), 1.0);
  const Scatter before = scatter(pad.array, placements, s, ones, {});
  const Scatter after = scatter(pad.array, placements, s, s.gain, {});
  EXPECT_LT(after.location_mm, 0.6 * before.location_mm);
  EXPECT_LT(after.force, 0.5 * before.force);
  const Scatter shaped = scatter(pad.array, placements, s, s.gain, shape_of(s));
  EXPECT_LT(shaped.force, 0.5 * before.force);
}
