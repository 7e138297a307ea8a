// Frames whose readings are known: noise, drift, hold and rest of them.
#include "support/validation_array.hpp"
#include "tool/validation/walk.hpp"

#include <cmath>
#include <gtest/gtest.h>

namespace fingertip::validating {
namespace {

constexpr double FRAME_s = 0.02, AIR_Pa = 101325.0, DRIFT_Pa_min = 30.0, PRESS_Pa = 8000.0;
constexpr std::size_t DRIFTS = 3, PULLED_ON = 8;

wire_info info_of() {
  wire_info info{};
  const calibrating::Array array = validation_array();
  info.sensor_count = static_cast<std::uint8_t>(array.sensors());
  info.pitch_mm = static_cast<float>(array.pitch_mm);
  for (std::size_t k = 0; k < array.sensors(); k++) {
    info.x_mm[k] = static_cast<float>(array.x_mm[k]);
    info.y_mm[k] = static_cast<float>(array.y_mm[k]);
  }
  return info;
}

/* Leads a walk: whatever touches is put on and off by the test. */
class Pad {
public:
  explicit Pad(const Pulling &pulling = {}) : walk(info_of(), 300.0, 12.0, pulling) {}

  void wait(double seconds) {
    for (double end_s = t_s_ + seconds; t_s_ < end_s; t_s_ += FRAME_s) {
      wire_packet packet{};
      packet.type = WIRE_RAW;
      packet.t_us = static_cast<std::uint64_t>(std::llround(1e6 * t_s_));
      wire_raw &raw = packet.body.raw;
      raw.sensor_count = info_of().sensor_count;
      raw.valid = (1u << raw.sensor_count) - 1u;
      for (std::size_t k = 0; k < raw.sensor_count; k++) {
        double pressure_Pa = AIR_Pa + pressed_Pa / (1.0 + double(k)) + left_Pa;
        pressure_Pa += k == PULLED_ON ? pulled * pressed_Pa : 0.0;
        pressure_Pa += k == DRIFTS ? DRIFT_Pa_min * t_s_ / 60.0 : 0.0;
        pressure_Pa += frame_ % 2 ? 2.0 : -2.0; // noise: 2 Pa rms
        raw.pressure_Pa_q10[k] = static_cast<std::int32_t>(std::llround(1024.0 * pressure_Pa));
        raw.baseline_Pa_q10[k] = static_cast<std::int32_t>(std::llround(1024.0 * AIR_Pa));
      }
      frame_++;
      for (const Step &step : walk.take(packet)) {
        steps.push_back(step);
      }
    }
  }
  void press(double seconds) {
    pressed_Pa = PRESS_Pa;
    wait(seconds);
    pressed_Pa = 0.0;
    wait(2.0);
  }

  Walk walk;
  std::vector<Step> steps;
  double pressed_Pa = 0.0, left_Pa = 0.0;
  double pulled = 0.0; // of the press, which one sensor feels besides

private:
  double t_s_ = 1.0;
  std::size_t frame_ = 0;
};

TEST(Walk, LeadsThroughAllSteps) {
  Pad pad;
  pad.wait(EMPTY_s + 1.0);
  ASSERT_EQ(pad.steps.size(), 3u);
  EXPECT_NE(pad.walk.advice().find("mark 1, turn 1 of 2"), std::string::npos);
  const std::size_t presses = marks_of(validation_array()).size() * TURNS;
  for (std::size_t i = 0; i < presses; i++) {
    pad.press(2.0);
  }
  EXPECT_NE(pad.walk.advice().find("in the middle"), std::string::npos);
  pad.pressed_Pa = PRESS_Pa;
  pad.wait(HOLD_s + 1.0);
  EXPECT_EQ(pad.walk.advice(), "lift it");
  pad.pressed_Pa = 0.0;
  pad.left_Pa = 50.0;
  pad.wait(REST_s + 2.0);
  ASSERT_TRUE(pad.walk.is_done());
  EXPECT_EQ(pad.steps.size(), steps_of(marks_of(validation_array()), 300.0, 12.0).size());
  const Measured measured = pad.walk.finish();
  EXPECT_TRUE(measured.ended);
  EXPECT_EQ(measured.presses.size(), presses);
  EXPECT_NEAR(measured.presses[0].placement.reading_Pa[1], 0.5 * PRESS_Pa, 3.0);
  ASSERT_TRUE(measured.empty);
  EXPECT_NEAR(measured.empty->seconds, EMPTY_s, 1.5);
  EXPECT_NEAR(measured.empty->drift_Pa_min[DRIFTS], DRIFT_Pa_min, 0.2);
  EXPECT_NEAR(measured.empty->drift_Pa_min[0], 0.0, 0.2);
  EXPECT_NEAR(measured.empty->noise_Pa[0], 2.0, 0.05);
  ASSERT_TRUE(measured.hold);
  EXPECT_NEAR(measured.hold->held_s, HOLD_s + 1.0, 0.5);
  EXPECT_NEAR(measured.hold->early_Pa[0], PRESS_Pa, 3.0);
  EXPECT_NEAR(measured.hold->late_Pa[0], PRESS_Pa, 3.0);
  for (const Hold::After &after : measured.hold->after) {
    ASSERT_FALSE(after.left_Pa.empty());
    EXPECT_NEAR(after.left_Pa[0], 50.0, 2.0);
  }
  for (double share : measured.answered) {
    EXPECT_EQ(share, 1.0);
  }
}

TEST(Walk, ATouchBeginsTheEmptyMinuteAgain) {
  Pad pad;
  pad.wait(0.5 * EMPTY_s);
  pad.press(1.0);
  pad.wait(0.5 * EMPTY_s);
  EXPECT_EQ(pad.steps.size(), 2u);
  pad.wait(0.5 * EMPTY_s + 1.0);
  EXPECT_EQ(pad.steps.size(), 3u);
}

/* On thin rubber what comes back after a press rises by more than calibration's LIGHT_Pa. */
TEST(Walk, RubberThatComesBackIsNoPress) {
  Pad pad;
  pad.wait(EMPTY_s + 1.0);
  pad.pressed_Pa = 5.0 * PRESS_Pa;
  pad.wait(2.0);
  pad.pressed_Pa = 0.0;
  pad.wait(2.0);
  pad.pressed_Pa = 0.05 * 5.0 * PRESS_Pa;
  pad.wait(2.0);
  EXPECT_NE(pad.walk.advice().find("mark 2, turn 1"), std::string::npos) << pad.walk.advice();
  EXPECT_EQ(pad.walk.finish().presses.size(), 1u);
}

/* Leads a walk to its first pull. */
void go_to_pulls(Pad &pad) {
  pad.wait(EMPTY_s + 1.0);
  for (std::size_t i = 0; i < marks_of(validation_array()).size() * TURNS; i++) {
    pad.press(2.0);
  }
  pad.press(HOLD_s + 1.0);
  pad.wait(REST_s + 1.0);
}

TEST(Walk, APullIsAskedForAlongEachWay) {
  Pad pad({100.0, 2.0});
  go_to_pulls(pad);
  for (const char *way : {"+x", "+y", "-x", "-y"}) {
    EXPECT_EQ(pad.walk.advice(), std::string("set the weight down in the middle, its thread slack towards ") + way);
    pad.pressed_Pa = PRESS_Pa;
    pad.wait(1.0);
    EXPECT_EQ(pad.walk.advice(), std::string("let it stand, its thread slack towards ") + way);
    pad.wait(2.0);
    EXPECT_EQ(pad.walk.advice(), std::string("pull: hang the other weight on the thread towards ") + way);
    pad.pulled = 0.2;
    pad.wait(0.5);
    EXPECT_EQ(pad.walk.advice(), "let it hang still");
    pad.wait(1.5);
    EXPECT_EQ(pad.walk.advice(), "taken: lift it");
    pad.pressed_Pa = pad.pulled = 0.0;
    pad.wait(2.0);
  }
  ASSERT_TRUE(pad.walk.is_done());
  const Measured measured = pad.walk.finish();
  EXPECT_TRUE(measured.ended);
  ASSERT_TRUE(measured.hold);
  EXPECT_NEAR(measured.hold->held_s, HOLD_s + 1.0, 0.5);
  EXPECT_EQ(measured.pulls_asked, 4u);
  ASSERT_EQ(measured.pulls.size(), 4u);
  EXPECT_EQ(measured.pulls[3].toward_deg, 270.0);
  EXPECT_EQ(measured.pulls[3].pulling.weight_g, 100.0);
}

TEST(Walk, AWeightThatStandsOrFadesIsNoPull) {
  Pad pad({100.0, 2.0});
  go_to_pulls(pad);
  pad.press(10.0);
  pad.pressed_Pa = PRESS_Pa;
  pad.wait(3.0);
  pad.pressed_Pa = 0.8 * PRESS_Pa;
  pad.wait(10.0);
  pad.pressed_Pa = 0.0;
  pad.wait(2.0);
  EXPECT_FALSE(pad.walk.is_done());
  EXPECT_TRUE(pad.walk.finish().pulls.empty());
}

TEST(Walk, APullIsTakenBackAndAskedForAgain) {
  Pad pad({100.0, 2.0});
  go_to_pulls(pad);
  EXPECT_TRUE(pad.walk.take_back().empty()); // the rest before is no press
  pad.pressed_Pa = PRESS_Pa;
  pad.wait(3.0);
  pad.pulled = 0.2;
  pad.wait(2.0);
  ASSERT_EQ(pad.walk.take_back().size(), 2u);
  const Measured measured = pad.walk.finish();
  EXPECT_TRUE(measured.pulls.empty());
  EXPECT_EQ(measured.presses.size(), marks_of(validation_array()).size() * TURNS);
}

TEST(Walk, APressIsTakenBackAndAskedForAgain) {
  Pad pad;
  pad.wait(EMPTY_s + 1.0);
  EXPECT_TRUE(pad.walk.take_back().empty());
  pad.press(2.0);
  pad.press(2.0);
  EXPECT_NE(pad.walk.advice().find("mark 3"), std::string::npos);
  const std::vector<Step> steps = pad.walk.take_back();
  ASSERT_EQ(steps.size(), 2u);
  EXPECT_EQ(steps[0].kind, Step::Kind::take_back);
  EXPECT_EQ(steps[1].mark, 1u);
  pad.press(2.0);
  const Measured measured = pad.walk.finish();
  ASSERT_EQ(measured.presses.size(), 2u);
  EXPECT_EQ(measured.presses[1].mark, 1u);
}

} // namespace
} // namespace fingertip::validating
