#include "libfingertip/error.hpp"
#include "support/placements.hpp"
#include "tool/calibration/gain_session.hpp"
#include "tool/calibration/placements.hpp"

#include <cmath>
#include <functional>
#include <gtest/gtest.h>

using namespace fingertip::calibrating;
using fingertip::Random;
using test::KnownPad;
using State = PlacementFinder::State;

constexpr double AMBIENT_Pa = 101325.0;

/* A stretch of time: what the sensors feel at its times. */
struct Feed {
  explicit Feed(double frames_per_s = 200.0, double frame_noise_Pa = 4.0) : rate_Hz(frames_per_s), noise_Pa(frame_noise_Pa) {}

  /* force(t) of the usual one at a place(t), t from the beginning of this stretch. */
  void run(double seconds, const std::function<double(double)> &force, const std::function<std::pair<double, double>(double)> &place = {}) {
    for (const double end_s = t_s + seconds; t_s < end_s; t_s += 1.0 / rate_Hz) {
      const double t = t_s - (end_s - seconds);
      const auto [x, y] = place ? place(t) : std::pair<double, double>{2.0, 3.0};
      Frame frame;
      frame.t_s = t_s;
      frame.valid = valid;
      for (std::size_t k = 0; k < 15; k++) {
        const double felt_Pa = force(t) * pad.gain[k] * pad.base_Pa({x, y}, k);
        frame.pressure_Pa.push_back(AMBIENT_Pa + 10.0 * static_cast<double>(k) + drift_Pa_s * t_s + felt_Pa + noise_Pa * random.normal());
        frame.zero_Pa.push_back(AMBIENT_Pa + 10.0 * static_cast<double>(k) + zero_off_Pa);
      }
      if (auto placement = finder.take(frame)) {
        found.push_back(*placement);
      }
    }
  }
  void rest(double seconds) {
    run(seconds, [](double) { return 0.0; });
  }
  void stand(double seconds, double force = 1.0, const std::function<std::pair<double, double>(double)> &place = {}) {
    run(
        seconds, [=](double) { return force; }, place);
  }
  void press(double force = 1.0) {
    run(0.3, [=](double t) { return force * t / 0.3; });
  }
  void lift(double force = 1.0) {
    run(0.3, [=](double t) { return force * (1.0 - t / 0.3); });
  }
  void place(double force = 1.0) {
    press(force);
    stood_s.push_back(t_s);
    stand(2.0, force);
    lift(force);
    rest(1.0);
  }
  /* Largest difference of a reading from what the place makes, as a share of the peak. */
  double error(const Placement &placement, double force = 1.0) const {
    double worst = 0.0;
    for (std::size_t k = 0; k < 15; k++) {
      worst = std::max(worst, std::abs(placement.reading_Pa[k] - force * pad.gain[k] * pad.base_Pa({2.0, 3.0}, k)));
    }
    return worst / (force * KnownPad::PEAK_Pa);
  }

  KnownPad pad{1};
  PlacementFinder finder{15};
  Random random{1, 9, 0};
  std::vector<Placement> found;
  std::vector<double> stood_s; /* when each place() had its force */
  double rate_Hz, noise_Pa, t_s = 10.0, drift_Pa_s = 0.0, zero_off_Pa = 0.0;
  std::uint32_t valid = 0x7FFF;
};

TEST(Placements, are_found_at_any_rate_and_noise) {
  for (const auto &[rate_Hz, noise_Pa] : {std::pair{13.0, 2.0}, {20.0, 11.0}, {57.0, 2.0}, {315.0, 11.0}, {1308.0, 11.0}}) {
    Feed feed(rate_Hz, noise_Pa);
    feed.rest(1.0);
    for (int i = 0; i < 5; i++) {
      feed.place(0.3 + 0.3 * i);
    }
    ASSERT_EQ(feed.found.size(), 5u) << rate_Hz;
    for (int i = 0; i < 5; i++) {
      const Placement &placement = feed.found[static_cast<std::size_t>(i)];
      EXPECT_LT(feed.error(placement, 0.3 + 0.3 * i), 0.004) << rate_Hz << " " << i;
      EXPECT_EQ(placement.usable, 0x7FFFu);
      EXPECT_GT(placement.noise_Pa, 0.05 * noise_Pa / std::sqrt(rate_Hz));
      EXPECT_LT(placement.noise_Pa, noise_Pa);
      /* Half a second to a second after it stood: of a frame's width more or less. */
      EXPECT_NEAR(placement.t_s, feed.stood_s[static_cast<std::size_t>(i)] + 0.75, 0.15);
    }
  }
}

TEST(Placements, zeros_that_are_off_or_move_do_not_matter) {
  Feed feed;
  feed.zero_off_Pa = 250.0;
  feed.drift_Pa_s = 20.0;
  feed.rest(2.0);
  feed.place();
  feed.valid = 0x7FFF & ~(1u << 7); /* and a sensor that is not measured is left out */
  feed.place();
  ASSERT_EQ(feed.found.size(), 2u);
  EXPECT_LT(feed.error(feed.found[0]), 0.003);
  EXPECT_EQ(feed.found[0].usable, 0x7FFFu);
  EXPECT_EQ(feed.found[1].usable, feed.valid);
  for (std::size_t k = 0; k < 15; k++) {
    const double rest_s = feed.found[0].t_s - RESTED_BEFORE_s;
    EXPECT_NEAR(feed.found[0].rest_Pa[k], AMBIENT_Pa + 10.0 * static_cast<double>(k) + feed.drift_Pa_s * rest_s, 4.0);
  }
}

TEST(Placements, frames_without_a_reading_end_none) {
  Feed feed(50.0);
  feed.rest(1.0);
  feed.press();
  feed.valid = 0; /* all are doubted, as after a brisk press */
  feed.stand(0.2);
  feed.valid = 0x7FFF;
  feed.stand(1.5);
  EXPECT_EQ(feed.found.size(), 1u);
}

TEST(Placements, one_for_each_until_it_is_lifted) {
  Feed feed;
  feed.rest(1.0);
  feed.press();
  EXPECT_EQ(feed.finder.state(), State::settling);
  feed.stand(1.5);
  EXPECT_EQ(feed.finder.state(), State::taken);
  feed.run(8.0, [](double t) { return 1.0 - 0.02 * t; });
  EXPECT_EQ(feed.found.size(), 1u);
  feed.lift(0.84);
  feed.rest(0.5);
  EXPECT_EQ(feed.finder.state(), State::resting);
}

TEST(Placements, relaxing_rubber_is_still) {
  Feed feed;
  feed.rest(1.0);
  feed.press();
  feed.run(2.0, [](double t) { return 1.0 - 0.16 * (1.0 - std::exp(-t)) - 0.01 * t; });
  ASSERT_EQ(feed.found.size(), 1u);
  EXPECT_NEAR(feed.found[0].fading, 0.046, 0.006);
}

TEST(Placements, a_hand_is_none) {
  /* It sways by 0.4 mm or trembles by 3 % at a few hertz, slides, or presses harder and harder. */
  Feed sways, trembles, slides, grows;
  for (Feed *feed : {&sways, &trembles, &slides, &grows}) {
    feed->rest(1.0);
    feed->press();
  }
  sways.stand(8.0, 1.0, [](double t) { return std::make_pair(2.0 + 0.4 * std::sin(9.0 * t), 3.0 + 0.3 * std::sin(7.0 * t)); });
  trembles.run(8.0, [](double t) { return 1.0 + 0.03 * std::sin(20.0 * t) + 0.03 * std::sin(13.0 * t); });
  slides.stand(8.0, 1.0, [](double t) { return std::make_pair(2.0 - 0.8 * t, 3.0); });
  grows.run(8.0, [](double t) { return std::exp(0.25 * t); });
  for (Feed *feed : {&sways, &trembles, &slides, &grows}) {
    EXPECT_TRUE(feed->found.empty());
    EXPECT_EQ(feed->finder.state(), State::refused);
    EXPECT_EQ(feed->finder.refusal(), PlacementFinder::Refusal::unsteady);
    /* And then a weight. */
    feed->lift();
    feed->rest(1.0);
    feed->place();
    ASSERT_EQ(feed->found.size(), 1u);
    EXPECT_LT(feed->error(feed->found[0]), 0.003);
  }
}

TEST(Placements, too_light_is_said_and_forgotten) {
  Feed feed;
  feed.rest(1.0);
  feed.place(0.07);
  EXPECT_TRUE(feed.found.empty());
  EXPECT_EQ(feed.finder.refusal(), PlacementFinder::Refusal::light);
  feed.place();
  ASSERT_EQ(feed.found.size(), 1u);
  EXPECT_LT(feed.error(feed.found[0]), 0.003);
}

/* What rubber does after a release: below zero by 8 % of the peak, back within seconds. */
TEST(Placements, an_undershoot_is_no_contact) {
  Feed feed;
  feed.rest(1.0);
  feed.place();
  feed.run(6.0, [](double t) { return -0.08 * std::exp(-t / 1.5); });
  feed.place();
  ASSERT_EQ(feed.found.size(), 2u);
  EXPECT_LT(feed.error(feed.found[1]), 0.006);
  EXPECT_EQ(feed.finder.state(), State::resting);
}

TEST(Placements, something_on_the_pad_at_the_beginning_is_lifted_first) {
  Feed feed;
  feed.stand(3.0);
  EXPECT_TRUE(feed.found.empty());
  feed.lift();
  feed.rest(1.0);
  feed.place();
  ASSERT_EQ(feed.found.size(), 1u);
  EXPECT_LT(feed.error(feed.found[0]), 0.003);
}

TEST(Placements, a_gap_or_a_restart_begins_anew) {
  for (double jump_s : {3.0, -5.0}) {
    Feed feed;
    feed.rest(1.0);
    feed.press();
    feed.stand(0.5);
    feed.t_s += jump_s;
    feed.stand(0.9);
    EXPECT_TRUE(feed.found.empty()) << jump_s;
  }
}

TEST(Placements, follow_one_another_in_time_over_a_restart) {
  Feed feed;
  feed.t_s = 1000.0;
  for (int i = 0; i < 3; i++) {
    feed.rest(1.0);
    feed.place();
    feed.t_s = 3.0;
  }
  ASSERT_EQ(feed.found.size(), 3u);
  for (std::size_t i = 1; i < 3; i++) {
    EXPECT_NEAR(feed.found[i].t_s - feed.found[i - 1].t_s, 4.6, 0.8);
    EXPECT_LT(feed.error(feed.found[i]), 0.003);
  }
}

TEST(Placements, need_sensors_that_lie_on_a_pad) {
  for (const auto &[pitch_mm, x_mm] : {std::pair{9.0F, 1e30F}, {1e-20F, 9.0F}, {0.0F, 0.0F}, {9.0F, NAN}, {INFINITY, 9.0F}}) {
    wire_info info{};
    info.sensor_count = 2;
    info.pitch_mm = pitch_mm;
    info.x_mm[1] = x_mm;
    EXPECT_THROW(array_of(info), fingertip::Error) << pitch_mm << " " << x_mm;
  }
}
