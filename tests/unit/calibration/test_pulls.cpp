/* Pulls out of frames whose loads are known, and what is made of them. */
#include "tool/calibration/pulls.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

using namespace fingertip::calibrating;

constexpr double KNOWN_N = 0.9, FORCE_N = 3.0, RATE_Hz = 50.0;

/* One object after another, frame by frame. */
class Bench {
public:
  explicit Bench(double known_N = KNOWN_N) : finder_(known_N) {}

  double zero_x_N = 0.08, zero_y_N = -0.05; /* read without a load */
  double noise_N = 0.02, sd_N = 0.06;
  double x_mm = 2.0, y_mm = -3.0;
  bool good = true;

  /* The load goes from where it is to this, in so long; the object by so much. */
  Bench &go(double seconds, double qx_N, double qy_N, double way_mm = 0.0, double force_N = FORCE_N) {
    const int frames = static_cast<int>(std::lround(seconds * RATE_Hz));
    const double from_x_N = qx_N_, from_y_N = qy_N_, from_N = force_N_, from_mm = x_mm;
    for (int i = 1; i <= frames; i++) {
      const double part = static_cast<double>(i) / frames;
      qx_N_ = from_x_N + part * (qx_N - from_x_N);
      qy_N_ = from_y_N + part * (qy_N - from_y_N);
      force_N_ = from_N + part * (force_N - from_N);
      x_mm = from_mm + part * way_mm;
      frame(force_N_ > 0.0);
    }
    return *this;
  }
  Bench &touch() { return go(0.1, 0, 0).go(1.0, 0, 0); }
  Bench &lift() { return go(0.1, 0, 0, 0, 0).go(0.5, 0, 0, 0, 0); }

  PullFinder::State state() const { return finder_.state(); }
  PullFinder::Refusal refusal() const { return finder_.refusal(); }
  const std::vector<Pull> &pulls() const { return pulls_; }

private:
  void frame(bool contact) {
    t_s_ += 1.0 / RATE_Hz;
    const double qx_N = qx_N_ + zero_x_N + noise_N * normal_(random_), qy_N = qy_N_ + zero_y_N + noise_N * normal_(random_);
    if (const auto found = finder_.take({t_s_, contact, good && contact, qx_N, qy_N, sd_N, force_N_, x_mm, y_mm})) {
      pulls_.push_back(*found);
    }
  }

  PullFinder finder_;
  std::vector<Pull> pulls_;
  std::mt19937 random_{1};
  std::normal_distribution<double> normal_;
  double t_s_ = 0.0, qx_N_ = 0.0, qy_N_ = 0.0, force_N_ = 0.0;
};

/* So many pulls in turn towards +x, +y, -x, -y, each reading this share of what is known. */
static std::vector<Pull> pulls_that_read(std::size_t count, double (*reading)(std::size_t)) {
  std::vector<Pull> pulls;
  for (std::size_t i = 0; i < count; i++) {
    const double angle_rad = M_PI_2 * static_cast<double>(i % 4), size_N = reading(i) * KNOWN_N;
    pulls.push_back({0.0, size_N * std::cos(angle_rad), size_N * std::sin(angle_rad)});
  }
  return pulls;
}

TEST(PullFinder, TakesWhatChangedFromRestToPull) {
  Bench bench;
  EXPECT_EQ(bench.state(), PullFinder::State::free);
  bench.touch();
  EXPECT_EQ(bench.state(), PullFinder::State::resting);
  bench.go(0.5, 0.6, -0.6, 0.3).go(0.5, 0.6, -0.6);
  EXPECT_EQ(bench.state(), PullFinder::State::pulled);
  EXPECT_TRUE(bench.pulls().empty());
  bench.go(2.0, 0.6, -0.6);
  ASSERT_EQ(bench.pulls().size(), 1u);
  EXPECT_EQ(bench.state(), PullFinder::State::taken);
  EXPECT_NEAR(bench.pulls()[0].qx_N, 0.6, 0.01);
  EXPECT_NEAR(bench.pulls()[0].qy_N, -0.6, 0.01);
  EXPECT_NEAR(bench.pulls()[0].force_N, FORCE_N, 1e-9);
  bench.go(3.0, 0.6, 0.6).lift();
  EXPECT_EQ(bench.pulls().size(), 1u) << "one of each contact";
  bench.touch().go(0.5, -0.9, 0).go(2.0, -0.9, 0);
  ASSERT_EQ(bench.pulls().size(), 2u);
  EXPECT_NEAR(bench.pulls()[1].qx_N, -0.9, 0.01);
}

TEST(PullFinder, TheRiseIsNotInTheMean) {
  for (double rise_s : {0.1, 0.5, 1.0, 2.0}) {
    Bench bench;
    bench.touch().go(rise_s, 0.9, 0).go(3.0, 0.9, 0);
    ASSERT_EQ(bench.pulls().size(), 1u) << rise_s;
    EXPECT_NEAR(bench.pulls()[0].qx_N, 0.9, 0.015) << rise_s;
  }
}

TEST(PullFinder, TakesNothingThatMovesOrHasNoRest) {
  Bench slides;
  slides.touch().go(0.3, 0.9, 0).go(2.0, 0.9, 0, 8.0);
  EXPECT_EQ(slides.refusal(), PullFinder::Refusal::slid);
  Bench creeps; /* 0.6 mm in a second: not far, but not still */
  creeps.touch().go(0.3, 0.9, 0).go(2.0, 0.9, 0, 1.2);
  Bench rises;
  rises.touch().go(6.0, 1.8, 0);
  Bench pressed;
  pressed.touch().go(0.3, 0.9, 0).go(3.0, 0.9, 0, 0, 2 * FORCE_N);
  Bench brief;
  brief.touch().go(0.3, 0.9, 0).go(1.0, 0.9, 0).go(0.3, 0, 0).go(1.0, 0, 0);
  EXPECT_EQ(brief.state(), PullFinder::State::resting);
  Bench restless;
  restless.go(0.1, 0.0, 0).go(0.4, 0.9, 0).go(3.0, 0.9, 0);
  Bench weak;
  weak.sd_N = 0.3;
  weak.touch().go(0.3, 0.9, 0).go(3.0, 0.9, 0);
  EXPECT_EQ(weak.refusal(), PullFinder::Refusal::weak);
  for (const Bench *bench : {&slides, &creeps, &rises, &pressed, &brief, &restless, &weak}) {
    EXPECT_TRUE(bench->pulls().empty());
  }
}

TEST(PullFinder, AWarningBreaksAPull) {
  Bench bench;
  bench.touch().go(0.3, 0.9, 0).go(1.0, 0.9, 0);
  bench.good = false;
  bench.go(0.1, 0.9, 0);
  bench.good = true;
  bench.go(1.0, 0.9, 0);
  EXPECT_TRUE(bench.pulls().empty());
  bench.go(0.7, 0.9, 0);
  EXPECT_EQ(bench.pulls().size(), 1u);
}

TEST(PullFinder, FramesThatAreMissingMakeNoMean) {
  for (double step_s : {0.3, 0.7, 2.0}) {
    PullFinder finder(KNOWN_N);
    for (int i = 1; i < 40; i++) {
      EXPECT_FALSE(finder.take({step_s * i, true, true, i > 20 ? KNOWN_N : 0.0, 0.0, 0.06, FORCE_N})) << step_s << " " << i;
    }
    EXPECT_EQ(finder.state(), PullFinder::State::settling);
  }
}

TEST(PullJudgement, IsGoodWithEnoughPullsThatAgree) {
  const auto reading = [](std::size_t i) { return i % 3 == 0 ? 0.88 : 0.91; };
  EXPECT_EQ(judge_pulls({}, KNOWN_N, false).state, PullJudgement::State::more);
  EXPECT_EQ(judge_pulls(pulls_that_read(7, reading), KNOWN_N, false).state, PullJudgement::State::more);
  EXPECT_EQ(judge_pulls(pulls_that_read(7, reading), KNOWN_N, true).state, PullJudgement::State::refused);
  const PullJudgement good = judge_pulls(pulls_that_read(8, reading), KNOWN_N, false);
  EXPECT_EQ(good.state, PullJudgement::State::good) << good.text;
  EXPECT_EQ(good.kept, 8u);
  EXPECT_NEAR(good.reading, (3 * 0.88 + 5 * 0.91) / 8, 1e-9);
  /* 0.0155 of one, over the root of 8, and 1 % of the string. */
  EXPECT_NEAR(good.reading_sd, std::hypot(0.0155 / 0.899 / std::sqrt(8.0), 0.01), 2e-4);
}

TEST(PullJudgement, LeavesAStrayPullOut) {
  const PullJudgement judgement = judge_pulls(pulls_that_read(10, [](std::size_t i) { return i == 3 ? 0.5 : 0.9; }), KNOWN_N, false);
  EXPECT_EQ(judgement.state, PullJudgement::State::good) << judgement.text;
  EXPECT_EQ(judgement.kept, 9u);
  EXPECT_NEAR(judgement.reading, 0.9, 1e-9);
}

TEST(PullJudgement, RefusesWhatDoesNotAgree) {
  const PullJudgement weights =
      judge_pulls(pulls_that_read(12, [](std::size_t i) { return 0.6 + 0.06 * static_cast<double>(i); }), KNOWN_N, false);
  EXPECT_EQ(weights.state, PullJudgement::State::refused);
  EXPECT_NE(weights.text.find("use one and the same weight"), std::string::npos) << weights.text;
  const PullJudgement ways = judge_pulls(pulls_that_read(12, [](std::size_t i) { return i % 2 ? 0.9 : 1.03; }), KNOWN_N, false);
  EXPECT_EQ(ways.state, PullJudgement::State::refused);
  EXPECT_NE(ways.text.find("directions disagree"), std::string::npos) << ways.text;
}

TEST(PullJudgement, WantsBothAxes) {
  std::vector<Pull> pulls = pulls_that_read(16, [](std::size_t) { return 0.9; });
  for (Pull &pull : pulls) {
    if (std::abs(pull.qy_N) > 0.5) {
      std::swap(pull.qx_N, pull.qy_N);
    }
  }
  const PullJudgement more = judge_pulls(pulls, KNOWN_N, false);
  EXPECT_EQ(more.state, PullJudgement::State::more);
  EXPECT_EQ(more.text, "0 of 3 pulls along y");
  EXPECT_EQ(judge_pulls(pulls, KNOWN_N, true).state, PullJudgement::State::refused);
}
